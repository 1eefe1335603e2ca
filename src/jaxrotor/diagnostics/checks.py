"""Are these signals, a sample rate, a window? Each refusal names its argument."""

from typing import Any

import numpy as np
import scipy.signal

from ..core.arguments import numbers, real_array, short
from ..core.errors import InputError

# The fewest samples of which anything is made: a quintic spline needs six.
_FEWEST = 8


def signal(values: Any, place: str, like: np.ndarray | None = None) -> np.ndarray:
    """(nt,) real and finite; as many as `like` has."""
    if np.iscomplexobj(values):
        raise InputError(f"`{place}`: must be real, but is complex: give x and y apart")
    found = real_array(values)
    if found is None:
        raise InputError(f"`{place}`: must be a row of numbers, but is {short(values)}")
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


def orders(values: Any) -> np.ndarray:
    """(k,) positive, each once."""
    found = np.atleast_1d(numbers("a turn", above=0.0)(values, "`orders`:"))
    if np.unique(found).size < found.size:
        raise InputError(f"`orders`: must differ, but are {short(values)}: name each once")
    return found


def window(name: Any, size: int) -> np.ndarray:
    """(size,), periodic, as it suits a discrete Fourier transform."""
    try:
        if not isinstance(name, (str, tuple)):
            raise TypeError
        return np.asarray(scipy.signal.get_window(name, size, fftbins=True))
    except (TypeError, ValueError):
        raise InputError(
            f'`window`: must be one that scipy.signal.get_window knows, such as "hann" or "flattop", but is '
            f"{short(name)}"
        ) from None
