"""Touching and letting go: how deep, and how surely, two faces that may overlap are in contact.

`u` is how far they overlap (negative: apart). With a `width` w > 0 contact begins gradually: its share rises
from 0 at u = -w to 1 at u = w, and `depth` and `area` are its first and second integrals, so that a force
`k depth` has the potential `k area` exactly. With w = 0 contact begins at once, with a kink in `depth`.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

Scalar = Float[Array, ""]


def _divisor(width: Scalar) -> Array:
    return jnp.where(width > 0, width, 1.0)


def contact(u: Scalar, width: Scalar) -> Array:
    """0 apart, 1 in contact."""
    smooth = jnp.clip(0.5 * (1 + u / _divisor(width)), 0.0, 1.0)
    return jnp.where(width > 0, smooth, jnp.where(u > 0, 1.0, 0.0))


def depth(u: Scalar, width: Scalar) -> Array:
    """The integral of `contact`."""
    rising = (u + width) ** 2 / (4 * _divisor(width))
    return jnp.where(u >= width, u, jnp.where(u > -width, rising, 0.0))


def area(u: Scalar, width: Scalar) -> Array:
    """The integral of `depth`."""
    rising = (u + width) ** 3 / (12 * _divisor(width))
    return jnp.where(u >= width, 0.5 * u**2 + width**2 / 6, jnp.where(u > -width, rising, 0.0))
