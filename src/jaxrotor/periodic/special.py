"""Folds and changes of stability, located between two points of a branch."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import brentq

from .branch import SpecialPoint
from .motion import PeriodicMotion

# To what part of the arc a point is located, and as of when a multiplier counts as outside the unit circle.
_PART, _OUTSIDE = 1e-9, 1e-9
# A multiplier this far from the circle where stability changes has jumped there.
_JUMPED = 1e-3
# An angle this small (rad) is that of a real multiplier.
_REAL = 1e-3


def special_between(
    way: Any,
    points: tuple[Any, Any],
    motions: tuple[PeriodicMotion, PeriodicMotion],
    told: Callable[[np.ndarray], PeriodicMotion],
    number: int,
) -> list[SpecialPoint]:
    """`number`: of the first of the two points."""
    here, there = points
    found = []
    between = there.x - here.x
    arc = float(np.sum(way.weights * here.tangent * between))
    whole = float(np.sqrt(np.sum(way.weights * between**2)))
    if arc < 0.5 * whole:  # around a corner
        arc = whole

    def located(gap: Callable[[np.ndarray, np.ndarray], float]) -> np.ndarray:
        """Where along the arc `gap` of a point and its tangent changes its sign."""
        latest = {0.0: here, arc: there}

        def along(s: float) -> float:
            point = latest[s] if s in latest else way.onward(here, s)
            if point is None:  # beyond a corner
                return gap(there.x, there.tangent)
            latest[s] = point
            return gap(point.x, point.tangent)

        s: Any = brentq(along, 0.0, arc, xtol=_PART * arc)
        return latest[min(latest, key=lambda a: abs(a - s))].x

    turned = here.tangent[-1] * there.tangent[-1] < 0
    if turned:
        x = located(lambda x, tangent: tangent[-1])
        found.append(SpecialPoint("fold", float(x[-1]), number, told(x)))
    sizes = [np.sort(np.abs(m.multipliers))[::-1] for m in motions]
    outside = [int(np.sum(size > 1 + _OUTSIDE)) for size in sizes]
    changed = abs(outside[1] - outside[0])
    if changed > int(turned):
        which = max(outside) - 1

        def gap(x: np.ndarray, _) -> float:
            return float(np.sort(np.abs(told(x).multipliers))[::-1][which]) - 1 - _OUTSIDE

        if gap(here.x, None) * gap(there.x, None) < 0:
            x = located(gap)
            motion = told(x)
            kind = _kind(motion, which)
            if not (turned and kind == "grazing"):  # a corner of the branch, told already
                found.append(SpecialPoint(kind, float(x[-1]), number, motion))
    return found


def _kind(motion: PeriodicMotion, which: int) -> str:
    value = np.asarray(motion.multipliers)[which]
    if abs(abs(value) - 1) > _JUMPED:
        return "grazing"
    angle = abs(np.angle(value))
    if angle < _REAL:
        return "branch point"
    return "period doubling" if angle > np.pi - _REAL else "Neimark-Sacker"
