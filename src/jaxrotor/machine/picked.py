"""Reading known places of an array."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

# Slices that one read is made of at most.
_MOST = 32


def picked(x: Array, index: Sequence[int] | np.ndarray) -> Array:
    """`x[..., index]`, by slices: the reverse of an indexed read is a scatter, which keeps the loop around it
    from being one kernel."""
    places = np.asarray(index, int)
    if places.size == 0:
        return x[..., :0]
    runs = np.split(places, np.flatnonzero(np.diff(places) != 1) + 1)
    if len(runs) > _MOST:
        return x[..., places]
    parts = [x[..., run[0] : run[-1] + 1] for run in runs]
    return parts[0] if len(parts) == 1 else jnp.concatenate(parts, axis=-1)
