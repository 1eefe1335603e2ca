"""The 1-2-3 angles: `R = Rx(psi) Ry(theta) Rz(phi)`, from the disc's frame to the global one.

`phi` is the spin. Frame B, `Rx(psi) Ry(theta)`, tilts with the disc but does not spin. Vectors are
tuples of three scalars here: under `vmap` over stations they become fused elementwise work, where
3-vectors and 3x3 products would become many small operations.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

COORDINATES = ("x", "y", "z", "psi", "theta", "phi")
# rad
TURN = 2 * np.pi

Vector = tuple[Array, Array, Array]
# Coordinates one by one, in place of an array of them.
Rows = Float[Array, "6 *n"] | tuple[Array, ...]


def rows(x: Rows) -> tuple[Array, ...]:
    """The coordinates one by one. All are read by one operation: each `x[i]` would be three in a program, six
    in its reverse, and these made half of the field's."""
    return x if isinstance(x, tuple) else tuple(jnp.unstack(x))


def about_axis(x: Float[Array, "*n"]) -> Float[Array, "6 *n"]:
    """What acts about the shaft's axis, or turns about it, alone: nothing in the other five."""
    return jax.lax.pad(x[None], jnp.zeros((), x.dtype), [(5, 0, 0), *[(0, 0, 0)] * x.ndim])


class Tilt(NamedTuple):
    """Sines and cosines of psi and theta."""

    sp: Array
    cp: Array
    st: Array
    ct: Array

    @classmethod
    def of(cls, psi: Array, theta: Array) -> "Tilt":
        return cls(jnp.sin(psi), jnp.cos(psi), jnp.sin(theta), jnp.cos(theta))


def cross(a: Vector, b: Vector) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def dot(a: Vector, b: Vector) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def to_tilted(tilt: Tilt, a: Vector) -> Vector:
    """Global components to components in B."""
    sp, cp, st, ct = tilt
    y, z = cp * a[1] + sp * a[2], cp * a[2] - sp * a[1]
    return ct * a[0] - st * z, y, st * a[0] + ct * z


def from_tilted(tilt: Tilt, a: Vector) -> Vector:
    """Components in B to global components."""
    sp, cp, st, ct = tilt
    z = ct * a[2] - st * a[0]
    return ct * a[0] + st * a[2], cp * a[1] - sp * z, sp * a[1] + cp * z


def rotation(q: Float[Array, "6"]) -> Float[Array, "3 3"]:
    """`R` as a matrix."""
    (sp, st, sf), (cp, ct, cf) = jnp.sin(q[3:]), jnp.cos(q[3:])
    rx = jnp.array([[1.0, 0, 0], [0, cp, -sp], [0, sp, cp]])
    ry = jnp.array([[ct, 0, st], [0, 1.0, 0], [-st, 0, ct]])
    rz = jnp.array([[cf, -sf, 0], [sf, cf, 0], [0, 0, 1.0]])
    return rx @ ry @ rz


def rotation_axes(q: Float[Array, "6"]) -> Float[Array, "3 3"]:
    """Columns: the global axes about which psi', theta' and phi' turn.

    The angular velocity is `rotation_axes(q) @ v[3:]`, and the generalized moments of a torque T
    are `rotation_axes(q).T @ T`.
    """
    (sp, st), (cp, ct) = jnp.sin(q[3:5]), jnp.cos(q[3:5])
    zero = jnp.zeros_like(sp)
    return jnp.array([[1.0 + zero, zero, st], [zero, cp, -sp * ct], [zero, sp, cp * ct]])


def spin_speed(q: Float[Array, "6 *n"], v: Float[Array, "6 *n"]) -> Float[Array, "*n"]:
    """Angular speed about the shaft's own axis, rad/s: `phi' + psi' sin theta`."""
    return v[5] + v[3] * jnp.sin(q[4])


# The turning that does not know the frame. phi alone is no invariant: turned about z, the same motion has
# another phi. `chi = phi + psi theta/2` has not, to second order in the tilts. What acts about the axis is
# written in chi, with psi and theta as they are; a torque T on chi is `T (theta/2, psi/2, 1)` on the angles.


def turning_lead(q: Rows) -> Float[Array, "*n"]:
    """chi less phi, rad."""
    return 0.5 * q[3] * q[4]


def turning_lead_rate(q: Rows, v: Rows) -> Float[Array, "*n"]:
    """Its time derivative, rad/s."""
    return 0.5 * (v[3] * q[4] + q[3] * v[4])


def turning_lead_acceleration(q: Rows, v: Rows, a: Rows) -> Float[Array, "*n"]:
    """Its second time derivative, rad/s²."""
    return 0.5 * (a[3] * q[4] + q[3] * a[4]) + v[3] * v[4]


def to_turning(q: Rows, v: Rows) -> tuple[Array, Array]:
    """Coordinates and rates with chi in the place of phi."""
    q, v = rows(q), rows(v)
    return (
        with_last(q, q[5] + turning_lead(q)),
        with_last(v, v[5] + turning_lead_rate(q, v)),
    )


def from_turning(q: Rows, v: Rows) -> tuple[Array, Array]:
    """Coordinates and rates with phi in the place of chi."""
    q, v = rows(q), rows(v)
    return angles_of(q), with_last(v, v[5] - turning_lead_rate(q, v))


def angles_of(q: Rows) -> Float[Array, "6 *n"]:
    """Coordinates with phi in the place of chi."""
    q = rows(q)
    return with_last(q, q[5] - turning_lead(q))


def with_last(x: Rows, last: Float[Array, "*n"]) -> Float[Array, "6 *n"]:
    """Another sixth coordinate. (In two pieces: from a stack of six XLA makes a kernel that runs a half
    longer.)"""
    head = jnp.stack(x[:5]) if isinstance(x, tuple) else x[:5]
    return jnp.concatenate([head, last[None]])
