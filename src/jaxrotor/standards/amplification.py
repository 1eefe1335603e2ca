"""Amplification factors of a rotor's resonances, from its response to unbalance."""

import functools
from collections.abc import Iterator, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, whole
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import is_concrete, known, numbers
from ..core.quick import lightly_compiled, traced
from ..core.result_text import shows
from ..machine.machine import Machine
from .curve import Near, Peaks, searched, searched_in_program, with_slopes, without_slopes
from .finding import Assessment, Finding
from .placed import Excited, Seen, excited, words_of

HALF_POWER = 0.5**0.5
SOURCE = "API RP 684 SP6.8.2.1, as read in ross-report (analysis.py)"


@shows(
    without=("excitation",), speeds="rad/s", amplitudes="m", low="rad/s", high="rad/s", factors=""
)
class Resonances(eqx.Module):
    """Peaks of the response that one probe reads, by rising speed.

    - `speeds` (m,), rad/s; `amplitudes` (m,), of the probe's unit, from the mean position (half of peak to
      peak). - `low`, `high`: (m,), rad/s, where the response has fallen to `drop` of the peak; NaN where it
      rises to a neighbouring peak before, or the range ends.
    - `factors` (m,): see `factors`. - `probe`: in words. - `span`: the range that was looked at, rad/s.

    Under `jit`, and where `count` was given, there are so many, NaN behind the last one.
    """

    speeds: Float[Array, " m"]
    amplitudes: Float[Array, " m"]
    low: Float[Array, " m"]
    high: Float[Array, " m"]
    drop: Float[Array, ""]
    probe: str = eqx.field(static=True)
    span: tuple[float, float] = eqx.field(static=True)
    excitation: tuple[Excited, Seen]

    plot = plot_door()

    @property
    def factors(self) -> Float[Array, " m"]:
        """Amplification factors `Nc/(N2 - N1)`. Where the response falls far enough on one side alone, that
        half width is doubled (ours: what we read of the standard says nothing of it); NaN where it does on
        neither."""
        lower, upper = self.speeds - self.low, self.high - self.speeds
        lacks_low, lacks_high = jnp.isnan(self.low), jnp.isnan(self.high)
        # NaN must not meet derivatives
        lower, upper = jnp.where(lacks_low, 1.0, lower), jnp.where(lacks_high, 1.0, upper)
        width = jnp.where(lacks_low, 2 * upper, jnp.where(lacks_high, 2 * lower, lower + upper))
        return jnp.where(lacks_low & lacks_high, jnp.nan, self.speeds / width)

    def response(self, speeds: Any) -> np.ndarray:
        """What the probe reads at other speeds (n,), rad/s, as numbers."""
        return readings(*self.excitation, np.atleast_1d(np.asarray(speeds, float)))

    def sides(self, k: int) -> str:
        """Of peak k, in words, on which sides the response does not fall far enough; empty where it does on
        both, or is traced."""
        low, high = known(self.low), known(self.high)
        if low is None or high is None:
            return ""
        gone = [side for side, x in (("below", low[k]), ("above", high[k])) if np.isnan(x)]
        if len(gone) == 2:
            return "no flank falls to the width's level: no factor"
        return f"no flank {gone[0]}: the other one doubled" if gone else ""


def readings(run: Excited, seen: Seen, speeds: np.ndarray) -> np.ndarray:
    """What a probe reads at these speeds (n,), rad/s, as numbers."""
    motion, (one, other) = run.numbers(speeds), (numbers(x) for x in seen)
    found = [motion(float(w)) for w in speeds]
    return np.array([abs(one @ q) + abs(other @ q) for q in found])


@takes(
    start=number("rad/s", above=0.0),
    stop=number("rad/s", above=0.0),
    unbalance=None,
    probe=None,
    count=whole(1),
    points=whole(5),
    drop=number(above=0.0, below=1.0),
)
def resonances(
    machine: Machine,
    probe: Any,
    start: float,
    stop: float,
    unbalance: Any = None,
    *,
    drop: Any = HALF_POWER,
    count: int | None = None,
    points: int = 201,
    at: Any = "equilibrium",
) -> Resonances:
    """All peaks between the speeds `start` and `stop` (rad/s) of the response to unbalance that a probe
    reads.

    - `probe`: `"main.x"`, `"main.y"`; `("main", 0.785)` along the direction at that angle (rad) from x
      towards y; `"main"`, the orbit's long half axis.
    - `unbalance`: a `PlacedUnbalance` or a mapping station -> kg·m, or (kg·m, rad), in place of the machine's
      own.
    - `drop`: of the peak, at which the widths for `factors` are taken. - `count`: the highest so many; under
      `jit` it must be given. - `points`: speeds of the scan, evenly spread.

    A scan finds the peaks by their slope; where the response has risen to `drop` of a peak and fallen to it
    again is searched for up to the next valley, where a neighbouring peak begins. Exact derivatives in both
    modes: of amplitudes, speeds and flanks (implicit function theorem). A machine of one degree of freedom,
    lightly damped, has 1/(2 zeta). Raises `InputError` for names that are none, and for a range that does not
    rise.
    """
    if not start < stop:
        raise InputError(f"start and stop must be rising, but are {start:g} and {stop:g} rad/s")
    run, seen = excited(machine, unbalance, (probe,), stop, at)
    return resonances_of(run, seen, (words_of(probe),), (start, stop), drop, count, points)[0]


def resonances_of(
    run: Excited,
    seen: Sequence[Seen],
    probes: Sequence[str],
    span: tuple[float, float],
    drop: Any,
    count: int | None,
    points: int,
) -> list[Resonances]:
    """Of several probes, which share what is found of the motion."""
    drop = jnp.asarray(drop, float)
    grid = np.linspace(*span, points)
    known_ = all(map(is_concrete, jax.tree.leaves((run, seen, drop))))
    if not known_ and count is None:
        raise InputError(
            "count: under jit and vmap a number of peaks must be given, such as count=3"
        )
    motion = functools.cache(run.numbers(grid)) if known_ else None
    found = []
    for one, words in zip(seen, probes):
        if motion is None:
            assert count is not None
            peaks = _in_program(run, one, jnp.asarray(grid), drop, count)
        else:
            peaks = _of_numbers(run, one, motion, grid, drop, count)
        ends = float(span[0]), float(span[1])
        found.append(Resonances(*peaks, drop, words, ends, (run, one)))
    return found


def _of_numbers(run: Excited, seen: Seen, motion: Any, grid, drop: Array, count) -> Peaks:
    one, other = (numbers(x) for x in seen)

    def level(w: float) -> float:
        q = motion(float(w))
        with np.errstate(divide="ignore"):  # what does not move at all
            return float(np.log(abs(one @ q) + abs(other @ q)))

    near, heights = searched(level, grid, float(numbers(drop)))
    if count is not None:
        near, heights = _so_many(near, heights, count)
    if not traced(run, seen, drop):
        return Peaks(*map(jnp.asarray, (near.place, heights, near.low, near.high)))
    if not np.isfinite(near.place).any():
        return Peaks(*[jnp.asarray(near.place)] * 4)
    return _derived(run, seen, jax.tree.map(jnp.asarray, near), drop)


def _so_many(near: Near, heights: np.ndarray, count: int) -> tuple[Near, np.ndarray]:
    """The highest ones, NaN behind the last."""
    best = np.sort(np.argsort(-heights, kind="stable")[:count])

    def kept(x):
        return np.append(x[best], np.full(count - len(best), np.nan))

    place, low, high = map(kept, near[:3])
    return Near(place, low, high, near.found), kept(heights)


@lightly_compiled
def _derived(run: Excited, seen: Seen, near: Near, drop: Array) -> Peaks:
    return with_slopes(lambda w: run.level(w, seen), near, drop)


@lightly_compiled
def _in_program(run: Excited, seen: Seen, grid: Array, drop: Array, count: int) -> Peaks:
    still, still_seen, still_drop = without_slopes((run, seen, drop))
    near = searched_in_program(lambda w: still.level(w, still_seen), grid, still_drop, count)
    return with_slopes(lambda w: run.level(w, seen), near, drop)


@takes()
def amplification_factors(found: Resonances) -> Assessment:
    """The amplification factor of each peak, for information. Raises `InputError` where `found` is no
    `Resonances`."""
    return Assessment(tuple(_findings(found)))


def _findings(found: Resonances) -> Iterator[Finding]:
    factors = found.factors
    for k in range(factors.shape[0]):
        words = place_of(found, k)
        if words:
            yield Finding(
                "amplification factor",
                words,
                factors[k],
                jnp.asarray(jnp.nan),
                "for information",
                "",
                SOURCE,
            )


def place_of(found: Resonances, k: int) -> str:
    """Peak k in words; empty where there is none."""
    speed = known(found.speeds[k])
    if speed is None:
        return f"{found.probe}, peak {k + 1}"
    if np.isnan(speed):
        return ""
    sides = found.sides(k)
    return f"{found.probe}, {float(speed) * 30 / np.pi:.5g} rpm" + (f" ({sides})" if sides else "")
