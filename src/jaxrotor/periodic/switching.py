"""From a point where another branch begins onto that branch."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..core.arguments import number, whole
from ..core.errors import ConvergenceError, InputError
from ..core.gate import takes
from ..core.quick import quickly_compiled, traced
from ..linear.condensing import condensed_below
from ..machine.machine import Machine
from ..simulation.assembling import system_of
from .balance import balance
from .branch import SpecialPoint
from .described import unknowns
from .harmonic_balance import found_near, motion_of, waves_of
from .motion import PeriodicMotion
from .waves import Waves

_STEPS = 20


@takes(size=number(above=0.0), samples=whole(8, 100_000))
def switch_branch(
    machine: Machine,
    point: SpecialPoint,
    *,
    size: float = 0.02,
    samples: int | None = None,
) -> PeriodicMotion:
    """A motion on the branch that leaves another one at `point`: after a `"period doubling"` one that
    repeats after twice as many turns, at a `"branch point"` one of less symmetry. Follow it by
    `continuation(machine, (motion.speed, ...), turns=motion.turns, start=motion)` towards the side of the
    point on which it lies.

    The balance at the point does not resist one direction; the motion is looked for so far along it, and its
    speed with it. `size`: how far, as a part of the vibration. `samples`: as for `harmonic_balance`, in the
    new period. `machine`: of which the branch is. Raises `InputError` for points at which no branch begins
    that could be followed, and `ConvergenceError` where none is found: try another `size`.
    """
    if point.kind not in ("period doubling", "branch point"):
        raise InputError(
            f"`point`: at a {point.kind} no periodic branch begins that could be followed: give a period "
            "doubling or a branch point"
        )
    if traced(machine):
        raise InputError(
            "`machine`: no derivative goes through a change of branch: derive `harmonic_balance` with `start`"
        )
    machine.check()
    motion = point.motion
    turns = motion.turns * (2 if point.kind == "period doubling" else 1)
    harmonics = round(motion.orders[-1])
    waves = waves_of(harmonics, turns, samples)
    machine = condensed_below(machine, point.speed * harmonics, "equilibrium")
    system = system_of(machine)
    x = np.append(np.asarray(unknowns(system, motion, waves)), point.speed)
    slope = np.asarray(_slope(system, jnp.asarray(x), waves))
    rows = np.abs(slope).max(1)
    direction = np.append(np.linalg.svd(slope / rows[:, None])[2][-1], 0.0)
    mean = (x.size - 1) // waves.count
    reach = size * np.linalg.norm(x[mean:-1]) / np.linalg.norm(direction)
    found = found_near(system, x + reach * direction, direction, waves, _STEPS)
    if not bool(found.settled):
        raise ConvergenceError(
            f"no motion was found beside the branch at {point.speed:.6g} rad/s: try another `size`"
        )
    return motion_of(system, found.x, waves, machine.wiring.stations)


@quickly_compiled
def _slope(system: Any, x: jax.Array, waves: Waves) -> jax.Array:
    return balance(system, x[:-1].reshape(waves.count, -1), x[-1], waves).slope
