"""The error of a finished run, from the defects of its steps (`defect`).

The error δ follows `δ' = J δ + r`, J the Jacobian of the machine at its present speed: A is that at one
speed alone, and with a gyroscopic term left out errors in phase with a mode would cancel. One product a
sample, behind the run; no look at the field.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..integrators.step_times import Knots
from ..machine.field import n_free
from ..machine.system import System

# Times at which J is made anew for the present speed, on a small machine.
_LEVELS = 8
# m, rad: what moves less is not moved at all, and rounding (1e-17) is most of its error.
_ROUNDING = 1e-9


def share_of_peaks(
    error: Float[Array, " n"], peak: Float[Array, " n"], system: System
) -> Float[Array, ""]:
    """The largest error as part of its coordinate's peak. A coordinate that hardly moves is judged by its
    kind, metres with metres, radians with radians; an angle counts up to one radian."""
    kind = np.array(system.layout.free, int) // system.layout.n_mass
    if not kind.size:
        return jnp.zeros(())
    peak = jnp.where(kind > 2, jnp.minimum(peak, 1.0), peak)
    transverse = [np.isin(kind, k) for k in ((0, 1, 2), (3, 4, 5))]
    floor = sum(jnp.where(k, 1e-3 * jnp.max(jnp.where(k, peak, 0.0)), 0.0) for k in transverse)
    return jnp.max(error / (jnp.maximum(peak, floor) + _ROUNDING))


def by_samples(knots: Knots, defects: Float[Array, "n-1 m"]) -> Float[Array, "nt-1 m"]:
    """Mean defect of each interval between samples."""
    count = knots.samples.size
    if defects.shape[0] == count - 1:
        return defects
    whole = jnp.diff(knots.times)[:, None] * defects
    isample = jnp.cumsum(jnp.zeros(knots.times.size, int).at[knots.samples].set(1))[:-1] - 1
    added = jnp.zeros((count - 1, defects.shape[1])).at[isample].add(whole, mode="drop")
    return added / jnp.diff(knots.times[knots.samples])[:, None]


def run_error(
    flow: tuple[Float[Array, "d d"], Float[Array, "d m"]],
    step: Float[Array, ""],
    substeps: int,
    by_speed: Float[Array, "d d"],
    linearised_at: Float[Array, ""],
    times: Float[Array, " nt"],
    y: Float[Array, "nt d"],
    defects: Float[Array, "nt-1 m"],
    system: System,
) -> Float[Array, ""]:
    """As part of each coordinate's peak. `flow`: `e^(hA)` and `h φ_1(hA)` of a step; `by_speed`: dA/dw."""
    # an error has no derivative
    flow, by_speed, y, defects = jax.lax.stop_gradient((flow, by_speed, y, defects))
    system = jax.tree.map(jax.lax.stop_gradient, system)
    through, push = flow
    d, count = through.shape[0], defects.shape[0]
    if not d:  # all is held
        return jnp.zeros(())
    levels = max(1, min(_LEVELS, 512 // d, count))
    edges = np.linspace(0, count, levels + 1).astype(int)
    speed = jax.vmap(lambda i: _speed(times[i], y[i], system))((edges[1:] + edges[:-1]) // 2)

    def level(w):
        half = 0.5 * step * (w - linearised_at) * by_speed
        turn = jnp.eye(d)
        for k in (4, 3, 2, 1):
            turn = jnp.eye(d) + half @ turn / k
        return jnp.linalg.matrix_power(turn @ through @ turn, substeps)

    which = np.repeat(np.arange(levels), np.diff(edges))
    kicks = substeps * defects @ push.T

    flows = jax.lax.map(level, speed)

    def sample(carry, x):
        error, worst = carry
        i, kick = x
        error = flows[i] @ error + kick
        return (error, jnp.maximum(worst, jnp.abs(error))), None

    (_, worst), _ = jax.lax.scan(sample, (jnp.zeros(d), jnp.zeros(d)), (which, kicks))
    n = n_free(system)
    return share_of_peaks(worst[:n], jnp.max(jnp.abs(y[:, :n]), axis=0), system)


def _speed(t, y: Float[Array, " d"], system: System) -> Float[Array, ""]:
    """The line's: the reference's, and the mean of what free spins add."""
    free = np.array(system.layout.free, int)
    spins = np.flatnonzero(free // system.layout.n_mass == 5)
    w = system.reference(t)[1]
    if not spins.size:
        return w
    own = y[free.size + spins]
    if system.turn is not None:
        own = own / system.turn[free[spins] % system.layout.n_mass]
    return w + jnp.mean(own)
