"""Roots of small systems of equations, which derivatives pass through."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def root(
    left: Callable[[Array], Array], start: Float[Array, " n"], steps: int
) -> Float[Array, " n"]:
    """Where `left` is zero, by so many of Newton's steps; its derivatives are those of the implicit
    function."""

    def solved(f: Callable[[Array], Array], x: Array) -> Array:
        return jax.lax.fori_loop(
            0, steps, lambda _, x: x - jnp.linalg.solve(jax.jacfwd(f)(x), f(x)), x
        )

    return jax.lax.custom_root(left, start, solved, tangent)


def tangent(linear: Callable[[Array], Array], y: Array) -> Array:
    """Of the implicit function: where the linear map gives y."""
    return jnp.linalg.solve(jax.jacfwd(linear)(y), y)
