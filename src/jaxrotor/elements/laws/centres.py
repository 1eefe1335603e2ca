"""Two centres in the plane across the axis: how they stand to each other, and what acts between them.

An attachment at one station acts against the ground, at two between them; the second is the one around.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.protocol import Motion, Vec6

# Nearer to each other than the root of this (m²) centres have no direction.
_TOGETHER = 1e-30


def relative(motions: tuple[Motion, ...]) -> tuple[Float[Array, "2"], Float[Array, "2"]]:
    """The first station's centre less the second's (or the ground's): m, m/s."""
    q, v = motions[0]
    if len(motions) == 1:
        return q[:2], v[:2]
    return q[:2] - motions[1][0][:2], v[:2] - motions[1][1][:2]


def radially(push: Callable[[Array], Array], e: Float[Array, "2"]) -> Float[Array, "2"]:
    """The vector of size `push(length of e)` along `e`. `push(0)` must be zero: then the vector is smooth
    where the centres meet, `push'(0) e`, though its direction is not."""
    size, n = direction(e)
    start = jax.grad(push)(jnp.zeros_like(size))
    return jnp.where(e @ e > _TOGETHER, push(size) * n, start * e)


def direction(e: Float[Array, "2"]) -> tuple[Float[Array, ""], Float[Array, "2"]]:
    """Length and unit vector; x where there is no direction, with derivatives of zero."""
    square = e @ e
    away = square > _TOGETHER
    size = jnp.sqrt(jnp.where(away, square, 1.0))
    return jnp.where(away, size, 0.0), jnp.where(away, e / size, jnp.array([1.0, 0.0]))


def pushed(
    motions: tuple[Motion, ...], f: Float[Array, "2"], torque: Array, other: Array
) -> tuple[Vec6, ...]:
    """`f` (N) on the first station and against it on the second, if there is one, with a torque about z on
    each (N·m)."""
    zero = jnp.zeros_like(f[0])
    ends = (
        jnp.stack([f[0], f[1], zero, zero, zero, torque]),
        jnp.stack([-f[0], -f[1], zero, zero, zero, other]),
    )
    return ends[: len(motions)]
