"""Twist and internal damping of a section between two stations, the same for every kind of shaft."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..protocol import Motion, Vec6

# W×q of a rigid turn about z at unit speed: x' = -y, y' = x, psi' = -theta, theta' = psi.
TURN = np.zeros((12, 12))
for _i in (0, 6):
    TURN[_i + 0, _i + 1] = TURN[_i + 3, _i + 4] = -1.0
    TURN[_i + 1, _i + 0] = TURN[_i + 4, _i + 3] = 1.0


def twist_forces(k: Array, c: Array, motions: tuple[Motion, ...]) -> tuple[Vec6, Vec6]:
    """The invariant law of twist, by `chi = phi + psi theta/2`, less the linear one in phi alone.

    `k` (N·m/rad) and `c` (N·m·s/rad) in torsion. From the potential `k (chi_b - chi_a)²/2`, so it also
    returns small moments on psi and theta.
    """
    (qa, va), (qb, vb) = motions
    tilt = 0.5 * (qb[3] * qb[4] - qa[3] * qa[4])
    tilt_t = 0.5 * (vb[3] * qb[4] + qb[3] * vb[4] - va[3] * qa[4] - qa[3] * va[4])
    extra = k * tilt + c * tilt_t
    torque = k * (qb[5] - qa[5]) + c * (vb[5] - va[5]) + extra
    zero = jnp.zeros_like(extra)
    on_a = jnp.stack([zero, zero, zero, torque * qa[4] / 2, torque * qa[3] / 2, extra])
    on_b = jnp.stack([zero, zero, zero, torque * qb[4] / 2, torque * qb[3] / 2, extra])
    return on_a, -on_b


def twist_torque(k: Array, c: Array, motions: tuple[Motion, ...], invariant: bool) -> Array:
    """N·m, positive when the right end leads; it pulls the left end along."""

    def angle(q):
        return q[5] + (0.5 * q[3] * q[4] if invariant else 0.0)

    (a, a_t), (b, b_t) = (jax.jvp(angle, (q,), (v,)) for q, v in motions)
    return k * (b - a) + c * (b_t - a_t)


def spin(q: Vec6, v: Vec6, invariant: bool) -> tuple[Array, Vec6]:
    """The rate of the angle that measures twist, and that angle's derivatives by q."""
    along = jnp.zeros(6).at[5].set(1.0)
    if invariant:
        along = along.at[3].set(q[4] / 2).at[4].set(q[3] / 2)
    return along @ v, along


def circulatory_forces(
    B: Float[Array, "12 12"], motions: tuple[Motion, ...], invariant: bool
) -> tuple[Vec6, Vec6]:
    """What rotating damping `-B (v - W×q)` has beyond `-B v`, and its reaction on the spin."""
    q = jnp.concatenate([m[0] for m in motions])
    v = jnp.concatenate([m[1] for m in motions])
    turn = TURN @ q
    spins = [spin(*m, invariant) for m in motions]
    carried = jnp.concatenate([w * turn[6 * i : 6 * i + 6] for i, (w, _) in enumerate(spins)])
    circulatory = B @ carried
    damping = (circulatory - B @ v) * turn
    reaction = [-jnp.sum(damping[:6]), -jnp.sum(damping[6:])]
    return (
        circulatory[:6] + spins[0][1] * reaction[0],
        circulatory[6:] + spins[1][1] * reaction[1],
    )
