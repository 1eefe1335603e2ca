"""The inverse of a small matrix inside a step: Gauss-Jordan elimination written out.

A library call (LAPACK) costs more than this at the sizes of a machine, and keeps the loop around it from
being one kernel; so does a scatter.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def inverse(matrix: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Not finite where the matrix is singular.

    A column takes the row that is largest in it, each measured by its own largest entry: units of the rows
    do not matter.
    """
    index = jnp.arange(matrix.shape[0])
    size = jnp.max(jnp.abs(matrix), axis=1)

    # in place: the inverse's columns grow where the matrix's are done with
    def column(carry, k):
        rest, free = carry
        column = jax.lax.dynamic_index_in_dim(rest, k, 1, keepdims=False)
        p = jnp.argmax(jnp.where(free > 0, jnp.abs(column) * free, -1.0))
        row = jax.lax.dynamic_index_in_dim(rest, p, 0, keepdims=False)
        row = jnp.where(index == k, 1.0, row) / row[k]
        served = index == p
        rest = jnp.where(index == k, 0.0, rest) - column[:, None] * row
        rest = jnp.where(served[:, None], row, rest)
        # a row that has served is not taken again
        return (rest, jnp.where(served, 0.0, free)), p

    scale = 1.0 / jnp.where(size > 0, size, 1.0)
    (found, _), order = jax.lax.scan(column, (matrix, scale), index)
    # rows stayed where they were: row order[k] served column k
    rank = jnp.sum(jnp.where(order[:, None] == index, index[:, None], 0), axis=0)
    return found[order][:, rank]


def solution(matrix: Float[Array, "n n"], right: Float[Array, " n"]) -> Float[Array, " n"]:
    """`matrix⁻¹ right`, by `inverse`; differentiated as the equation it solves."""
    known = inverse(jax.lax.stop_gradient(matrix))
    return jax.lax.custom_linear_solve(
        lambda x: matrix @ x, right, lambda _, b: known @ b, lambda _, b: b @ known
    )
