"""Newton-Euler equations of a rigid body in 1-2-3 angles, solved in closed form."""

from collections.abc import Callable

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.kinematics import Vector, cross, from_tilted, rotation, rotation_axes, to_tilted
from ...core.protocol import Vec6


def rigid_acceleration(
    q: Vec6,
    v: Vec6,
    Q: Vec6,
    mass: Array,
    offset: Vector,
    inertia: Callable[[Vector], Vector],
    inverse_inertia: Callable[[Vector], Vector],
) -> Vec6:
    """Accelerations of a rigid body about its geometric centre C, without a linear solve.

    The frame B = Rx(psi) Ry(theta) tilts but does not spin. With the absolute angular velocity w
    and the frame's own W, `al = I⁻¹ (T - r×F - w×(I w))`, `a_C = F/m - al×r - w×(w×r)`, and the
    angles' accelerations follow from `al - W×w`.

    **Arguments:**

    - `q`, `v`, `Q`: coordinates, rates, generalized force ON the body at C.
    - `mass`: kg.
    - `offset`: the mass centre less C, in B, m.
    - `inertia`, `inverse_inertia`: the inertia tensor about the mass centre in B, kg·m², applied to
      a vector, and its inverse.

    Source: Matyja & Łazarz 2014, their decoupled equations; the decoupling done exactly.
    """
    psi, theta = q[3], q[4]
    st, ct = jnp.sin(theta), jnp.cos(theta)
    psi_t, theta_t, phi_t = v[3], v[4], v[5]
    w = (psi_t * ct, theta_t, phi_t + psi_t * st)
    frame = (psi_t * ct, theta_t, psi_t * st)
    force = to_tilted(psi, theta, (Q[0], Q[1], Q[2]))
    torque = ((Q[3] - st * Q[5]) / ct, Q[4], Q[5])

    r = offset
    moment = cross(r, force)
    gyro = cross(w, inertia(w))
    al = inverse_inertia(
        (
            torque[0] - moment[0] - gyro[0],
            torque[1] - moment[1] - gyro[1],
            torque[2] - moment[2] - gyro[2],
        )
    )
    tangential, centripetal = cross(al, r), cross(w, cross(w, r))
    a = from_tilted(
        psi,
        theta,
        (
            force[0] / mass - tangential[0] - centripetal[0],
            force[1] / mass - tangential[1] - centripetal[1],
            force[2] / mass - tangential[2] - centripetal[2],
        ),
    )
    transport = cross(frame, w)
    b = (al[0] - transport[0], al[1] - transport[1], al[2] - transport[2])
    psi_tt = (b[0] + psi_t * theta_t * st) / ct
    phi_tt = b[2] - psi_tt * st - psi_t * theta_t * ct
    return jnp.stack([a[0], a[1], a[2], psi_tt, b[1], phi_tt])


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


def rigid_weight(q: Vec6, mass: Array, offset: Vector, gravity: Float[Array, "3"]) -> Vec6:
    """Weight at the mass centre as a generalized force at C: `∂(m g·r_P)/∂q`; `offset` in B, m."""
    force = (mass * gravity[0], mass * gravity[1], mass * gravity[2])
    moment = cross(offset, to_tilted(q[3], q[4], force))
    about_psi = jnp.cos(q[4]) * moment[0] + jnp.sin(q[4]) * moment[2]
    return jnp.stack([*force, about_psi, moment[1], moment[2]])


def rigid_height_energy(
    q: Vec6, mass: Array, offset: Float[Array, "3"], gravity: Float[Array, "3"]
) -> Float[Array, ""]:
    """`-m g·r_P`, J."""
    return -mass * gravity @ (q[:3] + rotation(q) @ offset)
