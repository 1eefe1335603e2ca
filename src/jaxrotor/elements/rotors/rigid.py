"""Newton-Euler equations of a rigid body in 1-2-3 angles, solved in closed form."""

from collections.abc import Callable

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.kinematics import (
    Rows,
    Tilt,
    Vector,
    cross,
    from_tilted,
    rotation,
    rotation_axes,
    rows,
    to_tilted,
)
from ...core.protocol import Vec6


def rigid_acceleration(
    q: Rows,
    v: Rows,
    Q: Rows,
    mass: Array,
    offset: Vector | tuple[Array, Array],
    gyroscopic: Callable[[Vector], Vector],
    inverse_inertia: Callable[[Vector], Vector],
) -> Vec6:
    """Accelerations of a rigid body about its geometric centre C, without a linear solve.

    The frame B = Rx(psi) Ry(theta) tilts but does not spin. With the absolute angular velocity w
    and the frame's own W, `al = I⁻¹ (T - r×F - w×(I w))`, `a_C = F/m - al×r - w×(w×r)`, and the
    angles' accelerations follow from `al - W×w`.

    **Arguments:**

    - `q`, `v`, `Q`: coordinates, rates, generalized force ON the body at C.
    - `mass`: kg.
    - `offset`: the mass centre less C, in B, m; two components where it has none along the axis.
    - `gyroscopic`: `w×(I w)` of a vector w, with the inertia tensor I about the mass centre in B, kg·m².
      `inverse_inertia`: the inverse of I applied to a vector.

    Source: Matyja & Łazarz 2014, their decoupled equations; the decoupling done exactly.
    """
    _, _, _, psi, theta, _ = rows(q)
    _, _, _, psi_t, theta_t, phi_t = rows(v)
    Q = rows(Q)
    tilt = Tilt.of(psi, theta)
    st, ct = tilt.st, tilt.ct
    across, along = psi_t * ct, psi_t * st  # W = (across, theta', along)
    w = (across, theta_t, phi_t + along)
    force = to_tilted(tilt, (Q[0], Q[1], Q[2]))
    torque = ((Q[3] - st * Q[5]) / ct, Q[4], Q[5])

    r = offset
    moment = _from_arm(r, force)
    gyro = gyroscopic(w)
    al = inverse_inertia(
        (
            torque[0] - moment[0] - gyro[0],
            torque[1] - moment[1] - gyro[1],
            torque[2] - moment[2] - gyro[2],
        )
    )
    # r×al = -al×r, and w×(r×w) = -w×(w×r)
    tangential, centripetal = _from_arm(r, al), cross(w, _from_arm(r, w))
    a = from_tilted(
        tilt,
        (
            force[0] / mass + tangential[0] + centripetal[0],
            force[1] / mass + tangential[1] + centripetal[1],
            force[2] / mass + tangential[2] + centripetal[2],
        ),
    )
    # W×w = phi' (theta', -across, 0)
    psi_tt = (al[0] - phi_t * theta_t + theta_t * along) / ct
    phi_tt = al[2] - psi_tt * st - theta_t * across
    return jnp.stack([a[0], a[1], a[2], psi_tt, al[1] + phi_t * across, phi_tt])


def _from_arm(r: Vector | tuple[Array, Array], b: Vector) -> Vector:
    """r×b, without the products that are none where r has nothing along the axis."""
    if len(r) == 3:
        return cross(r, b)
    return r[1] * b[2], -r[0] * b[2], r[0] * b[1] - r[1] * b[0]


def rigid_kinetic_energy(
    q: Vec6,
    v: Vec6,
    mass: Array,
    offset: Float[Array, "3"],
    tensor: Float[Array, "3 3"],
) -> Float[Array, ""]:
    """J; `offset` (m) and `tensor` (kg·m², about the mass centre) in the body's own frame."""
    R = rotation(q)
    w = rotation_axes(q) @ v[3:]
    v_mass = v[:3] + jnp.cross(w, R @ offset)
    w_body = R.T @ w
    return 0.5 * mass * (v_mass @ v_mass) + 0.5 * w_body @ tensor @ w_body


def rigid_weight(
    q: Rows, mass: Array, offset: Vector | tuple[Array, Array], gravity: Float[Array, "3"]
) -> Vec6:
    """Weight at the mass centre as a generalized force at C: `∂(m g·r_P)/∂q`; `offset` as there."""
    gx, gy, gz = rows(gravity)
    force = (mass * gx, mass * gy, mass * gz)
    _, _, _, psi, theta, _ = rows(q)
    tilt = Tilt.of(psi, theta)
    moment = _from_arm(offset, to_tilted(tilt, force))
    about_psi = tilt.ct * moment[0] + tilt.st * moment[2]
    return jnp.stack([*force, about_psi, moment[1], moment[2]])


def rigid_height_energy(
    q: Vec6, mass: Array, offset: Float[Array, "3"], gravity: Float[Array, "3"]
) -> Float[Array, ""]:
    """`-m g·r_P`, J."""
    return -mass * gravity @ (q[:3] + rotation(q) @ offset)
