"""Touching and letting go: how deep, and how surely, two faces that may overlap are in contact.

`u` is how far they overlap (negative: apart). With a `width` w > 0 contact begins gradually: its share rises
from 0 at u = -w to 1 at u = w, and `depth` and `area` are its first and second integrals, so that a force
`k depth` has the potential `k area` exactly. With w = 0 contact begins at once, with a kink in `depth`.

A face that touches pushes or does nothing: `pressed` is the spring and what damps it, never below zero.
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


# Where contact begins gradually a face also lets go so: the push is rounded off once damping has taken this
# part of the spring's away.
_ROUNDED = 0.5


def _damped(
    u: Scalar,
    u_t: Scalar,
    spring: Scalar,
    damping: Scalar | float,
    hysteresis: Scalar | float,
    width: Scalar,
) -> Array:
    """What the damping adds to the spring's push: at most it takes all of that away."""
    added = (damping * contact(u, width) + hysteresis * spring) * u_t
    return depth(spring + added, jnp.where(width > 0, _ROUNDED * spring, 0.0)) - spring


def pressed(
    u: Scalar,
    u_t: Scalar,
    stiffness: Scalar,
    damping: Scalar | float = 0.0,
    hysteresis: Scalar | float = 0.0,
    width: Scalar | float = 0.0,
) -> Scalar:
    """Push of a face that is overlapped by `u` (m) at the rate `u_t`, N: `k u + c u' + k u h u'`, zero where
    that would pull. c is a damper cut off where it would hold on; h (`hysteresis`, s/m) is Hunt & Crossley's
    (J. Appl. Mech. 42 (1975) 440), which starts from nothing at the touch. With `width` > 0 (m) the force has
    a continuous slope."""
    spring = stiffness * depth(u, jnp.asarray(width))
    return spring + _damped(u, u_t, spring, damping, hysteresis, jnp.asarray(width))


def pressed_lost(
    u: Scalar,
    u_t: Scalar,
    stiffness: Scalar,
    damping: Scalar | float = 0.0,
    hysteresis: Scalar | float = 0.0,
    width: Scalar | float = 0.0,
) -> Scalar:
    """What `pressed` turns into heat, W; stored is `stiffness area(u, width)`."""
    spring = stiffness * depth(u, jnp.asarray(width))
    # while it lifts off faster than it can follow, all that the spring gives back is lost
    return _damped(u, u_t, spring, damping, hysteresis, jnp.asarray(width)) * u_t
