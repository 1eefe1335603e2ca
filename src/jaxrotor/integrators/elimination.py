"""Linear equations inside a step: Gauss-Jordan elimination written out.

A library call (LAPACK) costs more than this at the sizes of a machine, and keeps the loop around it from
being one kernel; so does a scatter.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def solver_of(matrix: Float[Array, "n n"]) -> Callable[[Float[Array, " n"]], Float[Array, " n"]]:
    """`b -> matrix^-1 b`, for many `b`. Not finite where the matrix is singular.

    Rows are measured by their largest entry, and each column takes the row that is largest in it by that
    measure: units of the rows do not matter. Rows stay where they are; `order` says which served when.
    """
    n = matrix.shape[0]
    index = jnp.arange(n)
    size = jax.lax.stop_gradient(jnp.max(jnp.abs(matrix), axis=1))

    def eliminate(carry, k):
        rest, free = carry
        column = jax.lax.dynamic_index_in_dim(rest, k, 1, keepdims=False)
        # free is the scale of rows that have not served, and zero for the others
        p = jnp.argmax(jnp.abs(jax.lax.stop_gradient(column)) * free)
        row = jax.lax.dynamic_index_in_dim(rest, p, 0, keepdims=False)
        pivot = jax.lax.dynamic_index_in_dim(row, k, 0, keepdims=False)
        row = jnp.where(index == k, 1.0, row) / pivot
        served = index == p
        rest = jnp.where(index == k, 0.0, rest) - column[:, None] * row
        rest = jnp.where(served[:, None], row, rest)
        return (rest, jnp.where(served, 0.0, free)), p

    scale = 1.0 / jnp.where(size > 0, size, 1.0)
    (found, _), order = jax.lax.scan(eliminate, (matrix, scale), index)
    return lambda right: (found @ right[order])[order]
