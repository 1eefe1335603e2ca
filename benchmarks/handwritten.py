"""The two-rotor machine's equations written by hand, straight from physics.md: the peer in both
benchmarks.

Nothing of jaxrotor is used here, and everything that is known of this one machine is: beta_e =
beta_g = 0, and the paper's twist law, so that all springs are linear. The state is flat, y = [u, v],
each (6, 4) (see figures.py). `field` is for JAX, `compiled` makes the same for numba; the rotors'
equations are one text for both.
"""

import math

import numpy as np
from figures import (
    BASE_C,
    BASE_K,
    BEARING_INERTIA,
    BEARING_WEIGHT,
    DRAG,
    ECCENTRICITY,
    FRICTION_ARM,
    FRICTION_SPEED,
    GRAVITY,
    INCLINATION,
    LOAD_SMOOTHING,
    MASS,
    POLAR,
    PULL,
    RAMP,
    TOP_SPEED,
    TRANSVERSE,
    jacobian,
)

# what the equations are written in, so that it may be handed over as an argument too
FIGURES = dict(
    pull=PULL, drag=DRAG, m=MASS, Jt=TRANSVERSE, Jp=POLAR, e=ECCENTRICITY,
    sin_g=np.sin(INCLINATION), cos_g=np.cos(INCLINATION), inertia=BEARING_INERTIA,
    weight=BEARING_WEIGHT, k=BASE_K, c=BASE_C, arm=FRICTION_ARM,
)  # fmt: skip


def _rotor_equations(sin, cos):
    """The closed form of physics.md for scalars or for arrays over the rotors."""

    def accelerate(psi, theta, at, ahead, psi_t, theta_t, phi_t, Q, m, Jt, Jp, e, sin_g, cos_g):
        """`at`: angle of the mass centre; `ahead`: that of the inclination."""
        sp, cp, st, ct = sin(psi), cos(psi), sin(theta), cos(theta)
        rx, ry = e * cos(at), e * sin(at)
        nx, ny, nz = sin(ahead) * sin_g, -cos(ahead) * sin_g, cos_g
        # force at C with the weight at the mass centre
        w = -m * GRAVITY
        fx, fy, fz = Q[0], Q[1] + w, Q[2]
        q_psi = Q[3] + w * (cp * st * rx - sp * ry)
        q_theta = Q[4] + w * sp * ct * rx
        q_phi = Q[5] + w * (cp * rx - sp * st * ry)
        # force and torque in B
        across = cp * fz - sp * fy
        Fx, Fy, Fz = ct * fx - st * across, cp * fy + sp * fz, st * fx + ct * across
        Wx, Wy, Wz = psi_t * ct, theta_t, psi_t * st
        wz = phi_t + Wz
        # angular momentum and the right-hand side of Euler's equations
        nw = (Jp - Jt) * (nx * Wx + ny * Wy + nz * wz)
        Hx, Hy, Hz = Jt * Wx + nw * nx, Jt * Wy + nw * ny, Jt * wz + nw * nz
        Tx = (q_psi - st * q_phi) / ct - ry * Fz - (Wy * Hz - wz * Hy)
        Ty = q_theta + rx * Fz - (wz * Hx - Wx * Hz)
        Tz = q_phi - (rx * Fy - ry * Fx) - (Wx * Hy - Wy * Hx)
        nT = (1 / Jp - 1 / Jt) * (nx * Tx + ny * Ty + nz * Tz)
        ax, ay, az = Tx / Jt + nT * nx, Ty / Jt + nT * ny, Tz / Jt + nT * nz
        # a_C = F/m - al×r - w×(w×r), w×(w×r) = w (w·r) - r w²
        wr, ww = Wx * rx + Wy * ry, Wx * Wx + Wy * Wy + wz * wz
        bx = Fx / m + az * ry - Wx * wr + rx * ww
        by = Fy / m - az * rx - Wy * wr + ry * ww
        bz = Fz / m - (ax * ry - ay * rx) - wz * wr
        across = ct * bz - st * bx
        # b = al - W×w, and the angles' accelerations
        b1, b2 = ax - (Wy * wz - Wz * Wy), ay - (Wz * Wx - Wx * wz)
        psi_tt = (b1 + psi_t * theta_t * st) / ct
        return (
            ct * bx + st * bz, cp * by - sp * across, sp * by + cp * across,
            psi_tt, b2, az - psi_tt * st - psi_t * theta_t * ct,
        )  # fmt: skip

    return accelerate


def _drive(sin, cos, minimum, maximum):
    def drive(t):
        """Angle, speed and acceleration of the driven end."""
        s = minimum(t, RAMP)
        a = math.pi / RAMP
        angle = 0.5 * TOP_SPEED * (s - sin(a * s) / a) + TOP_SPEED * maximum(t - RAMP, 0.0)
        return angle, 0.5 * TOP_SPEED * (1 - cos(a * s)), 0.5 * TOP_SPEED * a * sin(a * s)

    return drive


def field():
    """The vector field `f(t, y)` for JAX. The figures are constants, unless given as an argument."""
    import jax.numpy as jnp

    accelerate = _rotor_equations(jnp.sin, jnp.cos)
    drive = _drive(jnp.sin, jnp.cos, jnp.minimum, jnp.maximum)

    def f(t, y, p=FIGURES):
        angle, speed, acceleration = drive(t)
        u, v = y.reshape(2, 6, 4)
        Q = (p["pull"] @ y + p["drag"] * speed).reshape(6, 4)
        phi = u[5, :2] + angle
        rotors = jnp.stack(accelerate(
            u[3, :2], u[4, :2], phi, phi, v[3, :2], v[4, :2], v[5, :2] + speed,
            Q[:, :2], p["m"], p["Jt"], p["Jp"], p["e"], p["sin_g"], p["cos_g"],
        ))  # fmt: skip
        fx, fy = (p["k"] * u[i, 2:] + p["c"] * v[i, 2:] for i in (0, 1))
        load = jnp.sqrt(fx**2 + fy**2 + LOAD_SMOOTHING**2)
        friction = p["arm"] * load * jnp.tanh((v[5, 2:] + speed) / FRICTION_SPEED)
        bearings = Q[:, 2:] + p["weight"] - np.eye(6)[:, 5:] * friction
        a = jnp.concatenate([rotors, bearings / p["inertia"]], axis=1)
        return jnp.concatenate([y[24:], (a - np.eye(6)[:, 5:] * acceleration).ravel()])

    return f


def compiled():
    """`rhs(t, y, out)` and `jac(t, y, before, J)` for CVODE, compiled by numba; and
    `unbalanced(t, y, out, p)`, which is told eccentricity and its angle, inclination and its angle of each
    rotor, (4, 2)."""
    import numba

    accelerate = numba.njit(_rotor_equations(math.sin, math.cos))
    drive = numba.njit(_drive(math.sin, math.cos, min, max))
    J0 = jacobian(0.0)
    pull, drag, inertia, weight = PULL, DRAG, BEARING_INERTIA, BEARING_WEIGHT
    mass, jt, jp = MASS, TRANSVERSE, POLAR
    own = np.array([ECCENTRICITY, np.zeros(2), INCLINATION, np.zeros(2)])
    ratio = POLAR / TRANSVERSE

    @numba.njit(fastmath={"reassoc", "contract"})
    def unbalanced(t, y, out, p):
        angle, speed, acceleration = drive(t)
        Q = np.empty((6, 4))
        for c in range(6):
            for s in range(4):
                total = drag[4 * c + s] * speed
                for k in range(48):
                    total += pull[4 * c + s, k] * y[k]
                Q[c, s] = total
                out[4 * c + s] = y[24 + 4 * c + s]
        for s in range(2):
            phi = y[20 + s] + angle
            a = accelerate(
                y[12 + s], y[16 + s], phi + p[1, s], phi + p[3, s], y[36 + s], y[40 + s], y[44 + s] + speed,
                Q[:, s], mass[s], jt[s], jp[s], p[0, s], math.sin(p[2, s]), math.cos(p[2, s]),
            )  # fmt: skip
            for c in range(6):
                out[24 + 4 * c + s] = a[c]
        for s in range(2, 4):
            fx, fy = BASE_K * y[s] + BASE_C * y[24 + s], BASE_K * y[4 + s] + BASE_C * y[28 + s]
            load = math.sqrt(fx**2 + fy**2 + LOAD_SMOOTHING**2)
            Q[5, s] -= FRICTION_ARM * load * math.tanh((y[44 + s] + speed) / FRICTION_SPEED)
            for c in range(6):
                out[24 + 4 * c + s] = (Q[c, s] + weight[c, s - 2]) / inertia[c, s - 2]
        for s in range(4):
            out[44 + s] -= acceleration

    @numba.njit
    def rhs(t, y, out):
        unbalanced(t, y, out, own)

    @numba.njit
    def jac(t, y, before, J):
        _, speed, _ = drive(t)
        J[:, :] = J0
        for s in range(2):
            J[36 + s, 40 + s] -= ratio[s] * (y[44 + s] + speed)
            J[40 + s, 36 + s] += ratio[s] * (y[44 + s] + speed)

    return rhs, jac, unbalanced
