"""The samples of a run, as its file keeps them."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr

from ..core.errors import InputError

# m, of a station that does not move across the axis; samples that make a run.
STILL, SHORTEST = 1e-9, 8


@dataclass(frozen=True)
class Samples:
    """What a run left in its file."""

    data: xr.Dataset

    @cached_property
    def t(self) -> np.ndarray:
        return self.data["time"].values

    @cached_property
    def stations(self) -> list[str]:
        return [str(s) for s in self.data["station"].values]

    @cached_property
    def position(self) -> np.ndarray:
        return self.data["position"].values

    def xy(self, name: str) -> np.ndarray:
        return self.position[:, self.stations.index(name), :2]

    def speed(self, name: str) -> np.ndarray:
        return self.data["speed"].values[:, self.stations.index(name)]

    def signals(self, quantity: str) -> dict[str, np.ndarray]:
        """Part -> values, of all that have it."""
        return {
            str(a.attrs["element"]): a.values
            for a in self.data.data_vars.values()
            if a.attrs.get("quantity") == quantity
        }

    @cached_property
    def swaying(self) -> list[str]:
        """Stations that move across the axis, what moves most first."""
        peaks = {n: float(np.nanmax(np.hypot(*self.xy(n).T), initial=0)) for n in self.stations}
        return sorted((n for n, p in peaks.items() if p > STILL), key=lambda n: -peaks[n])


def read_samples(path: Path) -> Samples:
    """Raises `InputError` for a file that is damaged or no run of ours."""
    try:
        with xr.open_dataset(path, engine="h5netcdf") as found:
            data = found.load()
    except Exception as error:  # HDF5 has many of its own
        words = type(error).__name__
        raise InputError(f"`{path}`: cannot be read ({words}): run the study again") from None
    if not {"position", "speed", "time", "station"} <= {*data.variables}:
        raise InputError(f"`{path}`: is no run of jaxrotor: name the response.nc of one")
    # of a run that failed, what was computed before
    finite = np.isfinite(data["position"].values).all(axis=(1, 2))
    finite &= np.isfinite(data["speed"].values).all(axis=1)
    whole = finite.size if finite.all() else int(np.argmin(finite))
    if whole < SHORTEST:
        raise InputError(
            f"`{path}`: holds {whole} samples, too few to be shown: run the study again"
        )
    return Samples(data.isel(time=slice(0, whole)))
