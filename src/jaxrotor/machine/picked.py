"""Known places of an array."""

from collections.abc import Sequence
from typing import Any

import jax
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


def gathered(x: Any, places: np.ndarray) -> Any:
    """`x` at places (..., k), each k numbers from zero up, one for each of the first k axes; of NumPy or JAX.
    Outside of loops: one operation, where an index in brackets is a dozen, for each of its arrays is looked
    through for negative ones in the program."""
    k = places.shape[-1]
    if isinstance(x, np.ndarray):
        return x[tuple(np.moveaxis(places, -1, 0))]
    shape = (*places.shape[:-1], *x.shape[k:])
    if not np.prod(shape):
        return jnp.zeros(shape, x.dtype)
    window = tuple(range(places.ndim - 1, len(shape)))
    axes = tuple(range(k))
    dimensions = jax.lax.GatherDimensionNumbers(window, axes, axes)
    size = (*[1] * k, *x.shape[k:])
    places = places.astype(np.int32)
    return jax.lax.gather(x, places, dimensions, size, mode="promise_in_bounds")


def block(x: Any, rows: np.ndarray, columns: np.ndarray) -> Any:
    """`x[np.ix_(rows, columns)]`, as `gathered` does it."""
    return gathered(x, np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).astype(int))


def some_rows(x: Any, rows: np.ndarray) -> Any:
    """`x[rows]`, as `gathered` does it."""
    return gathered(x, np.asarray(rows, int)[:, None])


def summed(values: Array, places: np.ndarray, size: int) -> Array:
    """Values added into so many zeros, each at its place; of one shape both. As `gathered`, one operation."""
    if not values.size:
        return jnp.zeros(size)
    dimensions = jax.lax.ScatterDimensionNumbers((), (0,), (0,))
    return jax.lax.scatter_add(
        jnp.zeros(size),
        places.ravel()[:, None].astype(np.int32),
        values.ravel(),
        dimensions,
        mode="promise_in_bounds",
    )
