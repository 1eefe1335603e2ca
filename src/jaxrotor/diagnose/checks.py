"""Are these signals, a sample rate, a window? Each refusal names its argument."""

from typing import Any

import numpy as np
import scipy.signal

from ..errors import InputError

# The fewest samples of which anything is made: a quintic spline needs six.
_FEWEST = 8


def signal(values: Any, place: str, like: np.ndarray | None = None) -> np.ndarray:
    """(nt,) real and finite; as many as `like` has."""
    try:
        found = np.asarray(values)
        found = found if np.iscomplexobj(found) else found.astype(float)
    except (TypeError, ValueError):
        raise InputError(f"`{place}`: must be a row of numbers, but is {values!r}") from None
    if np.iscomplexobj(found):
        raise InputError(f"`{place}`: must be real, but is complex: give x and y apart")
    if found.ndim != 1 or found.size < _FEWEST:
        raise InputError(
            f"`{place}`: must be one row of {_FEWEST} samples at least, but has shape {found.shape}: "
            "give one signal, run longer or sample faster"
        )
    if not np.isfinite(found).all():
        row = int(np.argmin(np.isfinite(found)))
        raise InputError(
            f"`{place}`: must be finite, but sample {row} is {found[row]}: cut it there"
        )
    if like is not None and found.size != like.size:
        raise InputError(
            f"`{place}`: must have as many samples as the other signals, {like.size}, but has "
            f"{found.size}: sample both together"
        )
    return found


def positive(value: Any, place: str, unit: str) -> float:
    found = _number(value, place, unit)
    if not 0 < found < np.inf:
        raise InputError(f"`{place}`: must be positive and finite ({unit}), but is {found:g}")
    return found


def finite(value: Any, place: str, unit: str) -> float:
    found = _number(value, place, unit)
    if not np.isfinite(found):
        raise InputError(f"`{place}`: must be finite ({unit}), but is {found:g}")
    return found


def _number(value: Any, place: str, unit: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"`{place}`: must be a number in {unit}, but is {value!r}") from None


def whole(value: Any, place: str, least: int = 1) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"`{place}`: must be a whole number, {least} at least, but is {value!r}")
    return int(value)


def orders(values: Any) -> np.ndarray:
    """(k,) positive, each once."""
    try:
        found = np.atleast_1d(np.asarray(values, float))
    except (TypeError, ValueError):
        raise InputError(f"`orders`: must be numbers per turn, but are {values!r}") from None
    if found.ndim != 1 or not found.size or not np.all((found > 0) & np.isfinite(found)):
        raise InputError(f"`orders`: must be positive numbers per turn, but are {values!r}")
    if np.unique(found).size < found.size:
        raise InputError(f"`orders`: must differ, but are {values!r}: name each once")
    return found


def window(name: Any, size: int) -> np.ndarray:
    """(size,), periodic, as it suits a discrete Fourier transform."""
    try:
        return np.asarray(scipy.signal.get_window(name, size, fftbins=True))
    except (TypeError, ValueError):
        raise InputError(
            f'`window`: must be one that scipy.signal.get_window knows, such as "hann" or "flattop", but is '
            f"{name!r}"
        ) from None
