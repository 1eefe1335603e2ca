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

    Derivatives are those of the equations: the elimination itself is not differentiated.
    """
    found, order, rank = _eliminate(jax.lax.stop_gradient(matrix))

    def solve(_, right):
        return (found @ right[order])[order]

    def transposed(_, right):
        return (right[rank] @ found)[rank]

    return lambda right: jax.lax.custom_linear_solve(
        lambda x: matrix @ x, right, solve, transposed
    )


def _eliminate(matrix: Float[Array, "n n"]) -> tuple[Array, Array, Array]:
    """The inverse as it lies when rows and columns stay where they are; which row served each column, and
    which column each row served.

    A column takes the row that is largest in it, each measured by its own largest entry: units of the rows
    do not matter.
    """
    index = jnp.arange(matrix.shape[0])
    size = jnp.max(jnp.abs(matrix), axis=1)

    def column(carry, k):
        rest, free, rank = carry
        column = jax.lax.dynamic_index_in_dim(rest, k, 1, keepdims=False)
        p = jnp.argmax(jnp.abs(column) * free)
        row = jax.lax.dynamic_index_in_dim(rest, p, 0, keepdims=False)
        row = jnp.where(index == k, 1.0, row) / row[k]
        served = index == p
        rest = jnp.where(index == k, 0.0, rest) - column[:, None] * row
        rest = jnp.where(served[:, None], row, rest)
        # a row that has served is not taken again
        return (rest, jnp.where(served, 0.0, free), jnp.where(served, k, rank)), p

    scale = 1.0 / jnp.where(size > 0, size, 1.0)
    (found, _, rank), order = jax.lax.scan(column, (matrix, scale, jnp.zeros_like(index)), index)
    return found, order, rank
