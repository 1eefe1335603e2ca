"""Twist and internal damping of a section between two stations, the same for every kind of shaft."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.protocol import Motion, Vec6
from ...core.turning import circulatory_forces, turned


def twist_torque(k: Array, c: Array, motions: tuple[Motion, ...]) -> Array:
    """N·m, positive when the right end leads; it pulls the left end along. `k` (N·m/rad) and `c`
    (N·m·s/rad) in torsion."""
    (qa, va), (qb, vb) = motions
    return k * (qb[5] - qa[5]) + c * (vb[5] - va[5])


def circulation(B: Float[Array, "12 12"], motions: tuple[Motion, ...]) -> tuple[Vec6, Vec6]:
    """`circulatory_forces` on both ends."""
    q, v = (jnp.stack([m[i] for m in motions], axis=1) for i in (0, 1))
    on = circulatory_forces(B, q, v)
    return on[:, 0], on[:, 1]


def damped_rates(motions: tuple[Motion, ...], damping: str) -> list[Vec6]:
    """The rates that internal damping resists: where it is "rotating", those seen from the turning shaft."""
    if damping != "rotating":
        return [v for _, v in motions]
    return [v - v[5] * turned(q) for q, v in motions]
