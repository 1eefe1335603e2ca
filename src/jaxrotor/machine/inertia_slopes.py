"""The forces of inertia of shafts with mass (`CoupledMass`), and their slopes."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.kinematics import with_last
from .between import Between
from .coupled import spin_by_tilts
from .mass import CoupledMass


def inertia_slopes(
    known: CoupledMass,
    M: Between,
    q: Float[Array, "6 n"],
    v: Float[Array, "6 n"],
    a: Float[Array, "6 n"],
) -> tuple[Float[Array, "6 m"], Between, Between, Between]:
    """What resists the accelerations `a` of all nodes, `T' M (T a + ...)` and the gyroscopic moments, on the
    nodes of `M`; its slopes by their coordinates, rates and accelerations."""
    m, n = M.shape[-1], q.shape[1]

    def turning(x):
        """Spin's acceleration and speed; what carries moments over to the tilts; of a unit of spin's
        momentum, the gyroscopic moments."""
        q, v, a = x
        b, d, convective = spin_by_tilts(q, v, known.invariant)
        speed = v[5] + b * v[3] + d * v[4]
        cos = jnp.cos(q[4])
        acceleration = a[5] + b * a[3] + d * a[4] + convective
        return jnp.stack([acceleration, speed, b, d, cos * v[4], -cos * v[3]])

    x = jnp.stack([q, v, a])
    hat, spin, b, d, *gyro = turning(x)
    slopes = jax.vmap(jax.jacfwd(turning), in_axes=-1, out_axes=-1)(x[..., :m])
    F = (known.mass @ with_last(a, hat).ravel()).reshape(6, n)[:, :m]
    momentum = (known.spin_rows @ with_last(v, spin).ravel())[:m]
    b, d, *gyro = (x[:m] for x in (b, d, *gyro))
    felt = [F[3] + b * F[5] + gyro[0] * momentum, F[4] + d * F[5] + gyro[1] * momentum]

    turns = np.arange(6) == 5  # the spin's entry is `hat` or `spin`, whose slopes have it
    others = M * ~turns[:, None, None]

    def of(which: int) -> Between:
        own = slopes[:, which]  # (6 of turning, 6 coordinates, m)
        dF = M[:, 5, None] * own[0, :, None, :]
        dp = M[5, 5] * own[1, :, None, :]
        if which == 2:
            dF = dF + others
        if which == 1:
            dp = dp + others[5]
        local = [own[2] * F[5] + own[4] * momentum, own[3] * F[5] + own[5] * momentum]
        tilts = [
            dF[3 + i] + share[:, None] * dF[5] + g[:, None] * dp + own[..., None] * np.eye(m)
            for i, (share, g, own) in enumerate(zip((b, d), gyro, local))
        ]
        return jnp.stack([dF[0], dF[1], dF[2], *tilts, dF[5]])

    return jnp.stack([F[0], F[1], F[2], *felt, F[5]]), of(0), of(1), of(2)
