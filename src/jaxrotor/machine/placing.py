"""Matrices of elements into one over all nodes."""

from collections.abc import Iterable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.picked import summed


def placed(
    parts: Iterable[tuple[Array, tuple[tuple[int, ...], ...]]], n: int
) -> Float[Array, "6 n 6 n"]:
    """The sum of `parts`: matrices (6 ends, 6 ends, members) with the nodes of each end."""
    values, places = [jnp.zeros(0)], [np.zeros(0, int)]
    for matrix, nodes in parts:
        node = np.repeat(np.array(nodes), 6, axis=0)  # (6 ends, members)
        component = np.tile(np.arange(6), len(nodes))[:, None] + np.zeros_like(node)
        row = component * n + node
        places.append((row[:, None] * 6 * n + row[None]).ravel())
        values.append(matrix.ravel())
    some = values[1:] or values
    found = summed(jnp.concatenate(some), np.concatenate(places), 36 * n * n)
    return found.reshape(6, n, 6, n)
