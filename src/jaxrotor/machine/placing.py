"""Matrices of elements into one over all nodes."""

from collections.abc import Iterable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


def placed(
    parts: Iterable[tuple[Array, tuple[tuple[int, ...], ...]]], n: int
) -> Float[Array, "6 n 6 n"]:
    """The sum of `parts`: matrices (6 ends, 6 ends, members) with the nodes of each end."""
    found = jnp.zeros(36 * n * n)
    for matrix, nodes in parts:
        node = np.repeat(np.array(nodes), 6, axis=0)  # (6 ends, members)
        component = np.tile(np.arange(6), len(nodes))[:, None] + np.zeros_like(node)
        row = component * n + node
        # one index: four would each be looked through for negative ones, in the program
        at = row[:, None] * 6 * n + row[None]
        found = found.at[at].add(matrix, mode="promise_in_bounds")
    return found.reshape(6, n, 6, n)
