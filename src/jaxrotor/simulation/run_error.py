"""The error of a finished run, from the defects of its steps (`defect`).

The error δ follows `δ' = J δ + r`, J the Jacobian of the machine at its present speed: A is that at one
speed alone, and with a gyroscopic term left out errors in phase with a mode would cancel. One product a
sample, behind the run; no look at the field.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..integrators.fitted import Course
from ..integrators.ladder import Ladder
from ..machine.field import n_free
from ..machine.line_speed import line_speed
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


def run_error(
    ladder: Ladder,
    course: Course,
    interval: Float[Array, ""],
    intervals: int | Array,
    system: System,
) -> Float[Array, ""]:
    """As part of each coordinate's peak, of so many sample intervals (s)."""
    # an error has no derivative
    ladder, course, system, interval = jax.tree.map(
        jax.lax.stop_gradient, (ladder, course, system, interval)
    )
    y, defects = course.kept, _defects(ladder.order, course)
    d, most = y.shape[1], y.shape[0]
    rows = d - defects.shape[1]
    if not d:  # all is held
        return jnp.zeros(())
    levels = max(1, min(_LEVELS, 512 // d, most - 1))
    middle = ((np.arange(levels) + 0.5) / levels * intervals).astype(int)
    speed = jax.vmap(lambda i: line_speed(i * interval, y[i], system))(middle)
    steps = interval / ladder.h

    def level(w):
        i = ladder.nearest(w)
        half = 0.5 * ladder.h * (w - ladder.speeds[i]) * ladder.slopes[i]
        half = jnp.pad(half, ((rows, 0), (0, 0)))
        turn = jnp.eye(d)
        for k in (4, 3, 2, 1):
            turn = jnp.eye(d) + half @ turn / k
        own = turn @ ladder.moments.flow[i] @ turn
        return _power(own, steps), steps * ladder.moments.mean[i, 0]

    flows, pushes = jax.lax.map(level, speed)
    at = np.arange(1, most)
    which = jnp.minimum(at * levels // intervals, levels - 1)

    def sample(carry, x):
        error, worst = carry
        i, within, defect = x
        error = flows[i] @ error + pushes[i] @ defect
        return (error, jnp.maximum(worst, jnp.where(within, jnp.abs(error), 0.0))), None

    zero = jnp.zeros(d)
    (_, worst), _ = jax.lax.scan(sample, (zero, zero), (which, at <= intervals, defects[1:]))
    n = n_free(system)
    return share_of_peaks(worst[:n], jnp.max(jnp.abs(y[:, :n]), axis=0), system)


def _power(matrix: Float[Array, "d d"], n: Array) -> Float[Array, "d d"]:
    """To a whole power, whatever that is."""

    def bit(carry, i):
        found, square = carry
        found = jnp.where((jnp.round(n).astype(int) >> i) & 1, square @ found, found)
        return (found, square @ square), None

    return jax.lax.scan(bit, (jnp.eye(matrix.shape[0]), matrix), np.arange(10))[0][0]


def _defects(order: int, course: Course) -> Float[Array, "nt m"]:
    """r at the samples: `c + γ* ∇ gap`. c, N at the corrected state less what is remembered of it, is told by the
    gap and its growth (which is what the gap is a quarter turn later): in the parts of both that the probes
    found, row by row."""
    assert course.gaps is not None and course.probes is not None
    gap, growth = course.gaps[:, 0], course.gaps[:, 1]
    found, *beside = jnp.moveaxis(course.probes, 1, 0)
    size = [jnp.sqrt(jnp.mean(x**2, axis=0)) + 1e-300 for x in beside]
    a, b = (x / s for x, s in zip(beside, size))
    dot = jnp.mean(a * b, axis=0)
    right = [jnp.mean(x * found, axis=0) for x in (a, b)]
    both = 1.0 - dot**2 + 1e-3
    parts = (right[0] - dot * right[1]) / both, (right[1] - dot * right[0]) / both
    return parts[0] / size[0] * gap + (parts[1] / size[1] + left_out(order)) * growth


def left_out(k: int) -> float:
    """Mean over 0..1 of the polynomial that vanishes at k past steps and at s = 1, for each unit of its
    difference: the first term that the corrector leaves out."""
    more = np.poly(np.append(-np.arange(k, dtype=float), 1.0))
    factorial = float(np.prod(np.arange(1.0, k + 1)))
    return float(np.polyval(np.polyint(more), 1.0)) / factorial / (k + 1)
