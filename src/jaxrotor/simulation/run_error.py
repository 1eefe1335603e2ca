"""The error of a finished run, from the defects of its steps (`defect`).

The error δ follows `δ' = J δ + r`, J the Jacobian of the machine at its present speed: A is that at one
speed alone, and with a gyroscopic term left out errors in phase with a mode would cancel. One product a
sample, behind the run; no look at the field.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..integrators.fitted import Course
from ..integrators.ladder import Ladder
from ..integrators.step_times import Knots
from ..machine.field import n_free
from ..machine.line_speed import line_speed
from ..machine.system import System
from .shaken import carried

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


class Flow(NamedTuple):
    """At one speed (rad/s): A, `e^(hA)` and `h φ_1(hA)` of a step of `h` (s), and dA/dw in the last rows."""

    speed: Any
    through: Float[Array, "d d"]
    push: Float[Array, "d m"]
    by_speed: Float[Array, "m d"]


def error_by_blocks(
    ladder: Ladder, course: Course, interval, intervals: int | Array, system: System
) -> Float[Array, ""]:
    """Of a run by `run_through`, of so many sample intervals (s), as part of each coordinate's peak; where
    steps span several, of what stands at their ends."""
    span = ladder.span
    y = course.kept[::span]

    def nearest(w):
        i = ladder.nearest(w)
        return Flow(ladder.speeds[i], *ladder.flow(i), ladder.slopes[i])

    defects = _defects(ladder.order, course)[1 : len(y)]
    return run_error(nearest, ladder.h, y, defects, interval * span, intervals // span, system)


def run_error(
    flow_at: Callable[[Array], Flow],
    h: Float[Array, ""],
    y: Float[Array, "nt d"],
    defects: Float[Array, "nt-1 m"],
    interval: Float[Array, ""],
    intervals: int | Array,
    system: System,
) -> Float[Array, ""]:
    """As part of each coordinate's peak. `flow_at`: the flow of a step of h that is nearest to a speed."""
    # an error has no derivative
    y, defects, interval, h = jax.lax.stop_gradient((y, defects, interval, h))
    system = jax.tree.map(jax.lax.stop_gradient, system)
    most, d = y.shape
    rows = d - defects.shape[1]
    if not d:  # all is held
        return jnp.zeros(())
    levels = max(1, min(_LEVELS, 512 // d, most - 1))
    middle = ((np.arange(levels) + 0.5) / levels * intervals).astype(int)
    speed = jax.vmap(lambda i: line_speed(i * interval, y[i], system))(middle)
    steps = interval / h

    def level(w):
        own = jax.lax.stop_gradient(flow_at(w))
        half = jnp.pad(0.5 * h * (w - own.speed) * own.by_speed, ((rows, 0), (0, 0)))
        turn = jnp.eye(d)
        for k in (4, 3, 2, 1):
            turn = jnp.eye(d) + half @ turn / k
        return _power(turn @ own.through @ turn, steps), steps * own.push

    flows, pushes = jax.lax.map(level, speed)
    at = np.arange(1, most)
    which = jnp.minimum(at * levels // intervals, levels - 1)

    def sample(carry, x):
        error, worst = carry
        i, within, defect = x
        error = flows[i] @ error + pushes[i] @ defect
        return (error, jnp.maximum(worst, jnp.where(within, jnp.abs(error), 0.0))), None

    zero = jnp.zeros(d)
    (_, worst), _ = jax.lax.scan(sample, (zero, zero), (which, at <= intervals, defects))
    n = n_free(system)
    # behind the run's end nothing moves
    ground = carried(system, interval * jnp.minimum(np.arange(most), intervals))
    last = y[:, :n] if ground is None else y[jnp.minimum(np.arange(most), intervals), :n]
    return share_of_peaks(worst[:n], peaks(last, ground, system), system)


def peaks(
    q: Float[Array, "nt n"], ground: Float[Array, "nt 6"] | None, system: System
) -> Float[Array, " n"]:
    """Of each coordinate; against the ground where that moves."""
    if ground is not None:
        q = q - ground[:, np.array(system.layout.free, int) // system.layout.n_mass]
    return jnp.max(jnp.abs(q), axis=0)


def _power(matrix: Float[Array, "d d"], n: Array) -> Float[Array, "d d"]:
    """To a whole power, whatever that is."""

    def bit(carry, i):
        found, square = carry
        found = jnp.where((jnp.round(n).astype(int) >> i) & 1, square @ found, found)
        return (found, square @ square), None

    return jax.lax.scan(bit, (jnp.eye(matrix.shape[0]), matrix), np.arange(10))[0][0]


def _defects(order: int, course: Course) -> Float[Array, "nt m"]:
    """r at the samples: `c + γ* ∇ gap`. c, N at the corrected state less what is remembered of it, is
    told by the gap and its growth (which is what the gap is a quarter turn later): in the parts of both
    that the probes found, row by row."""
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
