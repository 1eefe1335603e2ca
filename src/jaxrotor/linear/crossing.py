"""Where curves over speed meet the line of the speed itself, all of them."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

_POINTS = 33  # of the first look, over the whole range
_NARROW = 2e-3  # of its speed: a cell in which no further meeting is looked for
_NEAR = 1e-9  # of its speed, how near a meeting is found


def crossings(
    curves: Callable[[float], np.ndarray], low: float, high: float
) -> list[tuple[int, float]]:
    """(which curve, speed) of every meeting between `low` and `high` (positive), by rising speed.

    `curves(speed)`: (n,), each a continuous function of the speed. A cell is halved as long as some curve
    moves in it by more than it is away from the line, or half as fast as the line itself: there it may
    meet the line more than once.
    """
    known: dict[float, np.ndarray] = {}

    def at(speed: float) -> np.ndarray:
        if speed not in known:
            known[speed] = np.nan_to_num(curves(speed), nan=0.0, posinf=1e300)
        return known[speed]

    points = np.geomspace(low, high, _POINTS) if low < high else np.array([low, high])
    cells = list(zip(map(float, points[:-1]), map(float, points[1:])))
    found: list[tuple[int, float]] = []
    while cells:
        a, b = cells.pop()
        gap_a, gap_b = at(a) - a, at(b) - b
        met = (gap_a > 0) != (gap_b > 0)
        moved = np.abs(at(b) - at(a))
        doubtful = np.where(met, moved > 0.5 * (b - a), np.minimum(abs(gap_a), abs(gap_b)) < moved)
        if np.any(doubtful) and b - a > _NARROW * b:
            middle = float(np.sqrt(a * b))
            cells += [(a, middle), (middle, b)]
            continue
        for k in np.flatnonzero(met):
            where = brentq(
                lambda w, k=k: at(w)[k] - w, a, b, xtol=_NEAR * a, rtol=np.float64(_NEAR)
            )
            found.append((int(k), float(where)))  # pyright: ignore[reportArgumentType]
    return sorted(found, key=lambda f: f[1])
