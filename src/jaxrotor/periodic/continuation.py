"""The branch of periodic motions over speed, through its folds, by arc length."""

import warnings
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..core.arguments import number, numbers, whole
from ..core.errors import ConvergenceError, InputError
from ..core.gate import takes
from ..core.parameter import require_x64
from ..core.quick import traced
from ..linear.condensing import condensed_below
from ..machine.machine import Machine
from ..simulation.assembling import systems_of
from .branch import Branch
from .harmonic_balance import (
    first_found,
    first_guess,
    motion_of,
    refuse_lost,
    waves_of,
)
from .motion import PeriodicMotion
from .repeats import refuse_not_driven, refuse_other_periods
from .special import special_between
from .way import Point, Way

# Of an arc: the shortest that is tried, over the longest; the angle (rad) between tangents that is aimed
# at, and beyond which a shorter one is tried down to so many times the shortest.
_SHORTEST, _AIM, _MOST_TURN, _KINK = 5e-5, 0.2, 0.5, 60.0
# Round a corner that one sample of a contact more makes: the longest arc, over the longest of all.
_CORNER = 0.2
# Steps of Newton's method that are few.
_FEW = 4


@takes(
    speeds=None,
    harmonics=whole(1, 1000),
    turns=whole(1, 1000),
    samples=whole(8, 100_000),
    step=number(above=0.0),
    points=whole(2, 1_000_000),
)
def continuation(
    machine: Machine,
    speeds: Any,
    *,
    harmonics: int = 7,
    turns: int = 1,
    samples: int | None = None,
    start: PeriodicMotion | None = None,
    step: float = 0.04,
    points: int = 2000,
) -> Branch:
    """The branch of periodic motions from `speeds[0]` to `speeds[1]` (rad/s, rising or falling), stable or
    not.

    It is followed by its arc length (Keller 1977), so that it may turn back in speed: it ends where it leaves
    the range at either side, or after so many `points` (with a warning). Folds and the places where stability
    is lost or won are located between points. Motions of the machine that are not joined to this branch are
    found from a `start` on theirs.

    - `harmonics`, `turns`, `samples`, `start`: as for `harmonic_balance`; `start` is a motion near
      `speeds[0]`.
    - `step`: the longest, as a part of the range of speeds and of the motion's own size; it shortens where
      the branch bends.

    Raises `InputError` for machines that `harmonic_balance` refuses and speeds that are not two positive
    numbers apart from each other, and `ConvergenceError` where no motion is found at the first.
    """
    require_x64()
    speeds = numbers("rad/s", size=2, above=0.0)(speeds, "speeds")
    if traced(machine, speeds, start):
        raise InputError(
            "`machine`: no derivative goes through a branch: derive `harmonic_balance` at a speed, with "
            "`start` from the branch"
        )
    first, last = map(float, speeds)
    if first == last:
        raise InputError(f"speeds must be apart from each other, but both are {first:g} rad/s")
    machine.check()
    waves = waves_of(harmonics, turns, samples)
    refuse_not_driven(machine)
    machine = condensed_below(machine, max(first, last) * harmonics, "equilibrium")
    actual, nominal = systems_of(machine)
    refuse_other_periods(actual, first, waves)
    begin = first_guess(actual, nominal, jnp.asarray(first), waves, start)
    found = first_found(actual, begin, waves)
    refuse_lost(found, first)
    stations = machine.wiring.stations

    def told(x: np.ndarray) -> PeriodicMotion:
        return jax.tree.map(np.asarray, motion_of(actual, x, waves, stations))

    return _followed(Way(actual, waves, first, last, step), np.asarray(found.x), told, points)


def _followed(
    way: Way, x: np.ndarray, told: Callable[[np.ndarray], PeriodicMotion], most: int
) -> Branch:
    way.grow(x)
    here = way.at(way.first, x)
    if here is None:
        raise ConvergenceError(f"the branch was lost at its start, {way.first:.6g} rad/s")
    # towards the other end
    here = here._replace(
        tangent=here.tangent * np.sign(way.last - way.first) * np.sign(here.tangent[-1])
    )
    path, motions, special = [here], [told(here.x)], []
    arc, shortest = 0.1 * way.longest, _SHORTEST * way.longest
    while len(path) < most:
        there, arc, aim = _next(way, here, arc, shortest)
        if there is None:
            warnings.warn(
                f"the branch was lost after {len(path)} points, at {here.x[-1]:.6g} rad/s: take more "
                "samples, or smooth the contact",
                stacklevel=4,
            )
            break
        end = way.beyond(there.x)
        if end is not None:
            share = (end - here.x[-1]) / (there.x[-1] - here.x[-1])
            last = way.at(end, here.x + share * (there.x - here.x))
            if last is not None:
                there = last._replace(
                    tangent=last.tangent * np.sign(last.tangent @ (way.weights * here.tangent))
                )
        motion = told(there.x)
        special += special_between(way, (here, there), (motions[-1], motion), told, len(path) - 1)
        path.append(there)
        motions.append(motion)
        way.grow(there.x)
        here, arc = there._replace(tangent=way.unit(there.tangent)), aim
        if end is not None:
            break
    else:
        warnings.warn(
            f"the branch was followed for {most} points, to {here.x[-1]:.6g} rad/s, and not to its end: "
            "raise `points`",
            stacklevel=4,
        )
    every = jax.tree.map(lambda *rows: np.stack(rows), *motions)
    return Branch(np.array([p.x[-1] for p in path]), every, tuple(special))


def _next(way: Way, here: Point, arc: float, shortest: float) -> tuple[Point | None, float, float]:
    """The next point, the arc to it, and the arc that is tried from there."""
    while True:
        there = way.onward(here, arc)
        if there is not None:
            cosine = float(np.sum(way.weights * here.tangent * there.tangent))
            turn = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
            gentle = turn <= _MOST_TURN or arc <= _KINK * shortest
            corner = not gentle and arc <= _CORNER * way.longest
            if gentle or (corner and way.round_one_corner(here, there)):
                more = 1.0 if corner else np.clip(_AIM / max(turn, 1e-9), 0.5, 1.6)
                more = more if there.steps <= _FEW else min(more, 0.7)
                return there, arc, float(np.clip(more * arc, shortest, way.longest))
        if arc <= shortest:
            return way.round_corner(here, shortest), arc, shortest
        arc = max(0.4 * arc, shortest)
