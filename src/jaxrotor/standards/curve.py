"""Peaks of a curve, and where it has fallen from them on either side: searched for by numbers, or in a
program where they are traced, and ended by Newton's steps, which carry the derivatives."""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.optimize
from jaxtyping import Array, Float

T = TypeVar("T")
Curve = Callable[[Any], Any]

_NARROW = 1e-8  # of the place: as near as levels can tell a peak
# Of the gap to the nearer flank, for slopes and curvatures by differences: of levels, and of exact slopes.
_STEP, _FINE = 2e-3, 1e-4


class Near(NamedTuple):
    """Of m peaks by rising place: where they are, and where the curve has fallen from them below and above,
    as near as a search tells; NaN where it rises again, or ends, before it has; where there is no peak all
    three are. `found`: how many there are in all."""

    place: Any
    low: Any
    high: Any
    found: Any


class Peaks(NamedTuple):
    """The same to the last digit, with derivatives; and `height` (m,), no logarithm any more."""

    place: Float[Array, " m"]
    height: Float[Array, " m"]
    low: Float[Array, " m"]
    high: Float[Array, " m"]


def without_slopes(tree: T) -> T:
    """The same numbers, which no derivative is taken by."""
    return jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, tree)


def peaks_among(levels: Any, xp: Any) -> tuple[Any, Any, Any]:
    """Of levels on a grid (n,): which points are peaks; and of each point, from which grid point on the curve
    climbs to it, and down to which it falls from it."""
    n = levels.shape[0]
    at = xp.arange(n)
    inner = (levels[1:-1] > levels[:-2]) & (levels[1:-1] >= levels[2:])
    tops = xp.concatenate([xp.zeros(1, bool), inner, xp.zeros(1, bool)])
    climbs = xp.concatenate([xp.ones(1, bool), levels[1:] > levels[:-1]])  # up to this point
    i, k = at[:, None], at[None, :]
    first = xp.max(xp.where(~climbs[None] & (k <= i), k, 0), axis=1)
    last = xp.min(xp.where(climbs[None] & (k > i), k - 1, n - 1), axis=1)
    return tops, first, last


def _beside(levels: Any, top: Any, first: Any, last: Any, target: Any, xp: Any) -> tuple[Any, Any]:
    """The nearest grid points beside the peak at point `top` that lie below `target`; -1 and n for none."""
    at, below = xp.arange(levels.shape[0]), levels < target
    a = xp.max(xp.where(below & (at >= first) & (at <= top), at, -1))
    b = xp.min(xp.where(below & (at <= last) & (at >= top), at, at.size))
    return a, b


def searched(level: Curve, grid: np.ndarray, drop: float) -> tuple[Near, np.ndarray]:
    """All peaks of numbers within a rising `grid`, and what their heights are, without derivatives."""
    levels = np.array([level(x) for x in grid])
    tops, first, last = peaks_among(levels, np)
    found = []
    for k in np.flatnonzero(tops):
        top = k, first[k], last[k]
        place, height = _top(level, grid[k - 1], grid[k + 1])
        low, high = _flanks(level, grid, levels, top, place, height + np.log(drop))
        place, height = _refined(level, place, height, low, high)
        low, high = _flanks(level, grid, levels, top, place, height + np.log(drop))
        found.append((place, low, high, height))
    place, low, high, height = np.array(found).reshape(-1, 4).T
    return Near(place, low, high, len(place)), np.exp(height)


def _flanks(level, grid, levels, top, place: float, target: float) -> tuple[float, float]:
    k, first, last = top
    a, b = _beside(levels, k, first, last, target, np)

    def crossing(end: float) -> float:
        options: Any = dict(rtol=1e-14)
        found: Any = scipy.optimize.brentq(lambda x: level(x) - target, end, place, **options)
        return found

    low = crossing(grid[a]) if a >= 0 and grid[a] < place else np.nan
    return low, crossing(grid[b]) if b < grid.size and grid[b] > place else np.nan


def _top(level: Curve, low: float, high: float) -> tuple[float, float]:
    options = {"xatol": _NARROW * high}
    found: Any = scipy.optimize.minimize_scalar(
        lambda x: -level(x), bounds=(low, high), method="bounded", options=options
    )
    return float(found.x), float(-found.fun)


def _refined(level: Curve, place: float, height: float, low: float, high: float):
    """One Newton step, slopes by differences within the peak's width."""
    gaps = [abs(place - x) for x in (low, high) if np.isfinite(x)]
    h = _STEP * min(gaps, default=1e-2 * place)
    a, b, c, d = (level(place + k * h) for k in (-2, -1, 1, 2))
    slope = (a - 8 * b + 8 * c - d) / (12 * h)
    curvature = (b - 2 * height + c) / h**2
    step = -slope / curvature if curvature < 0 else 0.0
    step = float(np.clip(step, -h, h))
    return place + step, height + slope * step + 0.5 * curvature * step**2


def searched_in_program(level: Curve, grid: Array, drop: Array, count: int) -> Near:
    """The `count` highest peaks, under a trace. Each round looks at as many points as the grid has: first at
    the grid, then at some around each peak, at last at some on each flank."""
    size = max(grid.size, 10 * count)
    grid = jnp.linspace(grid[0], grid[-1], size)
    about, along = size // count, size // (2 * count)
    tops_rounds, flank_rounds = _rounds(2 / (about - 1)), _rounds(1 / (along - 1))
    log_drop = jnp.log(drop)

    def spread(starts, ends, each):
        share = jnp.linspace(0.0, 1.0, each)
        points = (starts[:, None] + share * (ends - starts)[:, None]).ravel()
        return jnp.pad(points, (0, size - points.size), mode="edge")

    def pick(rows, columns):
        return jnp.take_along_axis(rows, columns[:, None], axis=1)[:, 0]

    def once(state, round_):
        levels_of_grid, (starts, ends), (feet, tips), before, existed, *_ = state
        on_tops = round_ <= tops_rounds
        asked = jnp.where(on_tops, spread(starts, ends, about), spread(feet, tips, along))
        asked = jnp.where(round_ == 0, grid, asked)
        # one after the other: batched LAPACK calls side by side can deadlock (docs/solving.md)
        levels = jax.lax.map(level, asked)
        levels_of_grid = jnp.where(round_ == 0, levels, levels_of_grid)
        tops, first, last = peaks_among(levels_of_grid, jnp)
        best = jnp.argsort(jnp.where(tops, levels_of_grid, -jnp.inf), descending=True)[:count]
        there = tops[best]
        # where there are fewer, at the first one again: elsewhere derivatives may not be numbers
        best = jnp.clip(jnp.where(there, best, best[0]), 1, size - 2)
        # of the peaks
        points, found = (x[: about * count].reshape(count, about) for x in (asked, levels))
        k = jnp.clip(jnp.argmax(found, axis=1), 1, about - 2)
        narrow = pick(points, k - 1), pick(points, k + 1)
        new = [jnp.where(round_ == 0, grid[best + d], x) for d, x in zip((-1, 1), narrow)]
        starts, ends = (jnp.where(on_tops, x, y) for x, y in zip(new, (starts, ends)))
        height = jnp.where(round_ == 0, levels_of_grid[best], jnp.max(found, axis=1))
        # of the flanks, first between a grid point and the peak
        a, b = jax.vmap(
            lambda i, h: _beside(levels_of_grid, i, first[i], last[i], h + log_drop, jnp)
        )(best, height)
        place = 0.5 * (starts + ends)
        begun = jnp.concatenate([grid[jnp.maximum(a, 0)], grid[jnp.minimum(b, size - 1)]])
        points, found = (x[: 2 * along * count].reshape(-1, along) for x in (asked, levels))
        over = found >= before[:, None] + log_drop
        k = jnp.clip(jnp.argmax(over, axis=1), 1, along - 1)  # from the foot to the peak
        feet = jnp.where(on_tops, begun, pick(points, k - 1))
        tips = jnp.where(on_tops, jnp.concatenate([place, place]), pick(points, k))
        height = jnp.where(on_tops, jnp.concatenate([height, height]), before)
        exist = jnp.concatenate([a >= 0, b < size])
        kept = jnp.where(on_tops, exist, existed), there, jnp.sum(tops)
        return (levels_of_grid, (starts, ends), (feet, tips), height, *kept), None

    blank = jnp.full(count, grid[0]), jnp.full(count, grid[-1])
    both = jnp.full(2 * count, grid[0]), jnp.full(2 * count, grid[-1])
    none = jnp.zeros(2 * count), jnp.zeros(2 * count, bool), jnp.zeros(count, bool), jnp.asarray(0)
    state, _ = jax.lax.scan(
        once, (jnp.zeros(size), blank, both, *none), jnp.arange(1 + tops_rounds + flank_rounds)
    )
    _, tops, flanks, _, exist, there, found = state
    place, beside = (
        0.5 * (tops[0] + tops[1]),
        jnp.where(exist, 0.5 * (flanks[0] + flanks[1]), jnp.nan),
    )
    place, low, high = (
        jnp.where(there, x, jnp.nan) for x in (place, beside[:count], beside[count:])
    )
    order = jnp.argsort(place)  # NaN, no peak, comes last
    return Near(place[order], low[order], high[order], found)


def _rounds(ratio: float) -> int:
    return int(np.ceil(np.log(_NARROW) / np.log(ratio)))


def with_slopes(level: Curve, near: Near, drop: Array) -> Peaks:
    """`near`, with derivatives by all that `level` closes over: a peak's place by the implicit function
    theorem, its height as it is at the peak, flanks where the level is `drop` of that height."""
    place, low, high = (jax.lax.stop_gradient(x) for x in near[:3])
    there, lower, upper = (~jnp.isnan(x) for x in (place, low, high))
    # where there is none, at the first one again: elsewhere derivatives may not be numbers
    safe = jnp.where(there, place, place[0])
    gaps = jnp.fmin(jnp.abs(safe - low), jnp.abs(safe - high))
    h = _FINE * jnp.where(jnp.isnan(gaps), 1e-2 * safe, gaps)
    points = jnp.stack(
        [safe, safe - h, safe + h, jnp.where(lower, low, safe), jnp.where(upper, high, safe)]
    )

    def both(x):
        return jnp.stack(jax.jvp(level, (x,), (jnp.ones_like(x),)))

    found = jax.lax.map(both, points.ravel()).reshape(*points.shape, 2)
    levels, slopes = found[..., 0], found[..., 1]
    curvature = jax.lax.stop_gradient((slopes[2] - slopes[1]) / (2 * h))
    step = -slopes[0] / curvature
    # a parabola through what is known beside the peak
    d = jax.lax.stop_gradient(step)
    top = levels[0] + slopes[0] * d + 0.5 * curvature * d**2
    target = top + jnp.log(drop)

    def flank(k, exists):
        slope = jax.lax.stop_gradient(jnp.where(exists, slopes[k], 1.0))
        return jnp.where(exists, points[k] - (levels[k] - target) / slope, jnp.nan)

    peak = jnp.where(there, safe + step, jnp.nan)
    height = jnp.where(there, jnp.exp(top), jnp.nan)
    return Peaks(peak, height, flank(3, lower), flank(4, upper))
