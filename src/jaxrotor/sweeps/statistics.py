"""What a sweep says of each output: percentiles, shares within limits."""

from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr
from scipy import stats

from .planning import NO_STEP


def done(found: xr.Dataset) -> xr.Dataset:
    """A store that was opened as it lies, without the rows that fill up a batch and those still to come."""
    if "done" not in found:
        return found
    each = found.sizes["case"] // found.sizes["chunk"]
    there = (found["case"].values >= 0) & np.repeat(found["done"].values == 1, each)
    return found.isel(case=np.flatnonzero(there)).sortby("case")


def ran_to_end(found: xr.Dataset) -> np.ndarray:
    """Of each case, in one row."""
    if "failure" in found:
        return found["failure"].values.ravel() == ""
    return np.isnan(found["failed_at"].values) & (found["steps_a_sample"].values != NO_STEP)


def numbers_of(found: xr.Dataset, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Name -> (n,) of those outputs that are one number for each machine; of a machine measure with several
    the largest, which counts."""
    found = done(found)
    axes = axes_of(found)
    out = {}
    for name in names:
        array = found[name]
        own = [d for d in array.dims if d not in axes]
        if any(d in found.coords for d in own):
            continue  # over time or speed
        values = np.asarray(array, float)
        values = values.reshape(*values.shape[: len(axes)], -1)
        out[name] = np.max(values, axis=-1).ravel()  # NaN of a failed machine stays
    return out


def axes_of(found: xr.Dataset) -> tuple[str, ...]:
    """The dimensions of the cases: `case`, or those of a grid."""
    return tuple(str(d) for d in found["failed_at"].dims)


def percentiles(values: np.ndarray, of: Sequence[float]) -> np.ndarray:
    """Of what is finite."""
    sound = values[np.isfinite(values)]
    return np.percentile(sound, of) if sound.size else np.full(len(of), np.nan)


def share(within: np.ndarray) -> tuple[float, float, float]:
    """The share that is true, and the ends of its 95 % interval by Wilson's score, which holds for
    independent cases; Sobol points and Latin hypercubes mostly do better."""
    k, n = int(np.sum(within)), len(within)
    if n == 0:
        return np.nan, 0.0, 1.0
    low, high = stats.binomtest(k, n).proportion_ci(0.95, method="wilson")
    return k / n, float(low), float(high)
