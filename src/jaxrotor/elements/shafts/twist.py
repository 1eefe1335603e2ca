"""Twist and internal damping of a section between two stations, the same for every kind of shaft."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.protocol import Motion, Vec6

# W×q of a rigid turn about z at unit speed: x' = -y, y' = x, psi' = -theta, theta' = psi.
TURN = np.zeros((12, 12))
for _i in (0, 6):
    TURN[_i + 0, _i + 1] = TURN[_i + 3, _i + 4] = -1.0
    TURN[_i + 1, _i + 0] = TURN[_i + 4, _i + 3] = 1.0


def twist_torque(k: Array, c: Array, motions: tuple[Motion, ...]) -> Array:
    """N·m, positive when the right end leads; it pulls the left end along. `k` (N·m/rad) and `c`
    (N·m·s/rad) in torsion."""
    (qa, va), (qb, vb) = motions
    return k * (qb[5] - qa[5]) + c * (vb[5] - va[5])


def circulatory_forces(B: Float[Array, "12 12"], motions: tuple[Motion, ...]) -> tuple[Vec6, Vec6]:
    """What rotating damping `-B (v - W×q)` has beyond `-B v`, and its reaction on the spin."""
    q = jnp.concatenate([m[0] for m in motions])
    v = jnp.concatenate([m[1] for m in motions])
    turn = TURN @ q
    circulatory = B @ jnp.concatenate([v[5] * turn[:6], v[11] * turn[6:]])
    damping = (circulatory - B @ v) * turn
    about = jnp.zeros(12).at[5].set(-jnp.sum(damping[:6])).at[11].set(-jnp.sum(damping[6:]))
    total = circulatory + about
    return total[:6], total[6:]


def damped_rates(motions: tuple[Motion, ...], damping: str) -> list[Vec6]:
    """The rates that internal damping resists: where it is "rotating", those seen from the turning shaft."""
    if damping != "rotating":
        return [v for _, v in motions]
    return [v - v[5] * (TURN[:6, :6] @ q) for q, v in motions]
