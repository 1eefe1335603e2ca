"""Steps along a branch: by an arc's length, round its corners, or at a speed."""

from typing import Any, NamedTuple

import numpy as np

from ..machine.system import System
from .harmonic_balance import found_near
from .root import kinds_of
from .waves import Waves

# Past a corner, in shortest arcs; and the cosine from which on two tangents are one.
_PAST, _ALIKE = 4.0, 0.995
# By what part of the way round a corner the ways from both its ends may miss each other.
_ASIDE = 0.02
# Steps of Newton's method along a branch.
_STEPS = 8


class Point(NamedTuple):
    """`x`: (size + 1,); `tangent`: the same, of length 1 in the metric of the branch."""

    x: np.ndarray
    tangent: np.ndarray
    steps: int


class Way:
    """Arcs, measured in parts of the range of speeds and of the motion's size so far, kind by kind."""

    def __init__(self, system: System, waves: Waves, first: float, last: float, longest: float):
        self.system, self.waves, self.first, self.last = system, waves, first, last
        self.longest, self.range = longest, abs(last - first)
        self.kinds: np.ndarray = np.zeros(0)
        self.sizes = np.zeros(4)

    def grow(self, x: np.ndarray) -> None:
        if not self.kinds.size:
            self.kinds = kinds_of(self.system, (x.size - 1) // self.waves.count, self.waves)
        own = [np.sqrt(np.sum(x[:-1][self.kinds[:-1] == k] ** 2)) for k in range(3)]
        self.sizes = np.maximum(self.sizes, [*own, self.range])

    @property
    def weights(self) -> np.ndarray:
        """Of the squares of an arc."""
        sizes = np.where(self.sizes > 0, self.sizes, 1.0)
        return (1.0 / sizes**2)[self.kinds]

    def point(self, found: Any) -> Point:
        tangent = np.asarray(found.tangent)
        return Point(np.asarray(found.x), self.unit(tangent), int(found.steps))

    def unit(self, tangent: np.ndarray) -> np.ndarray:
        return tangent / np.sqrt(np.sum(self.weights * tangent**2))

    def near(self, x: np.ndarray, plane: np.ndarray, steps: int) -> Any:
        return found_near(self.system, x, plane, self.waves, steps)

    def onward(self, point: Point, arc: float) -> Point | None:
        """The point of the branch in the plane across its tangent at this distance."""
        plane = self.weights * point.tangent
        found = self.near(point.x + arc * point.tangent, plane, _STEPS)
        return self.point(found) if bool(found.settled) else None

    def round_one_corner(self, here: Point, there: Point) -> bool:
        """Whether the way from one point along its tangent, and back from the other along its own, meet: so
        they do in a bend, and at a corner, where one sample of a contact more begins to touch, but not where
        the point lies on another part of the branch."""
        root = np.sqrt(self.weights)
        between, ways = root * (there.x - here.x), root * np.stack([here.tangent, there.tangent])
        shares = np.linalg.lstsq(ways.T, between)[0]
        aside = np.linalg.norm(between - shares @ ways) / np.linalg.norm(between)
        return bool(np.all(shares > 0) and aside < _ASIDE and ways[0] @ ways[1] > 0)

    def round_corner(self, here: Point, arc: float) -> Point | None:
        """The next point where the branch has a corner just ahead (all of an orbit meets or leaves a sharp
        contact at once): along the tangent that it would have beyond, in the sense in which it does so."""
        beyond = here.x + _PAST * arc * here.tangent
        found = self.near(beyond, self.weights * here.tangent, 1)
        tangent = self.unit(np.asarray(found.tangent))
        if not np.all(np.isfinite(tangent)):
            return None
        for far in (2 * _PAST, 8 * _PAST, 32 * _PAST):
            for sense in (1.0, -1.0):
                there = self.onward(Point(here.x, sense * tangent, 0), far * arc)
                if there is None:
                    continue
                along = np.sum(self.weights * there.tangent * tangent) * sense
                back = np.sum(self.weights * there.tangent * here.tangent)
                if along > _ALIKE and back > -_ALIKE:
                    return there
        return None

    def at(self, speed: float, guess: np.ndarray) -> Point | None:
        guess = np.append(guess[:-1], speed)
        plane = np.append(np.zeros(guess.size - 1), 1.0)
        found = self.near(guess, plane, _STEPS)
        return self.point(found) if bool(found.settled) else None

    def beyond(self, x: np.ndarray) -> float | None:
        """The end of the range that has been passed."""
        low, high = sorted((self.first, self.last))
        return low if x[-1] < low else high if x[-1] > high else None
