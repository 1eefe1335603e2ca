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


def placed_columns(x: Array, columns: Sequence[int] | np.ndarray, count: int) -> Array:
    """So many columns of zeros, and each of `x` (..., k) added to its own: by slices. With a pattern it were
    a product of two matrices, which is a library's and keeps the loop around it from being one kernel."""
    first = int(columns[0]) if len(columns) else 0
    if np.array_equal(columns, np.arange(first, first + len(columns))):
        own = [(0, 0)] * (x.ndim - 1)
        return jnp.pad(x, [*own, (first, count - first - len(columns))])
    left, found = list(enumerate(columns)), None
    filled = jnp.concatenate([x, jnp.zeros((*x.shape[:-1], 1), x.dtype)], axis=-1)
    while left:  # once, but for columns that several are added to
        index, again = np.full(count, x.shape[-1]), []
        for own, column in left:
            if index[column] == x.shape[-1]:
                index[column] = own
            else:
                again.append((own, column))
        layer, left = picked(filled, index), again
        found = layer if found is None else found + layer
    return jnp.zeros((*x.shape[:-1], count), x.dtype) if found is None else found


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
