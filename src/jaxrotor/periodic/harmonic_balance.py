"""One periodic motion at a given speed, with derivatives by everything."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, whole
from ..core.errors import ConvergenceError, InputError
from ..core.gate import takes
from ..core.parameter import known, require_x64
from ..core.quick import lightly_compiled, quickly_compiled, traced
from ..core.threads import one_thread
from ..linear.condensing import condensed_below
from ..machine.field import initial_states, n_free
from ..machine.machine import Machine
from ..machine.system import System
from ..simulation.assembling import system_of, systems_of
from ..simulation.equilibrium import running
from .described import described, unknowns
from .motion import PeriodicMotion
from .repeats import refuse_not_driven, refuse_other_periods
from .root import Found, find
from .waves import Waves

# Steps of Newton's method from a rough start, and once more from one that is held.
_MANY = 40
# Free coordinates of a machine for which compiling takes longer than all else.
_SMALL = 12
# Samples for each order: a cubic law's products are resolved exactly by four, faces of contacts need more.
_SAMPLES = 8


@takes(
    speed=number("rad/s", above=0.0),
    harmonics=whole(1, 1000),
    turns=whole(1, 1000),
    samples=whole(8, 100_000),
)
def harmonic_balance(
    machine: Machine,
    speed: Float[Array, ""] | float,
    *,
    harmonics: int = 7,
    turns: int = 1,
    samples: int | None = None,
    start: PeriodicMotion | None = None,
) -> PeriodicMotion:
    """The steady motion of `machine` turning at `speed` (rad/s), stable or not, that repeats after `turns`
    turns.

    Every law is taken as it is; the motion is balanced up to `harmonics` orders per turn (alternating
    frequency/time; Krack & Gross, Harmonic Balance for Nonlinear Vibration Problems, 2019), by Newton's
    method from where the balanced machine stays, or from `start`, another motion, which chooses among
    several. The speed replaces that of the drive. Exact derivatives by every parameter and the speed in
    both modes (implicit differentiation), of the multipliers too.

    - `samples`: instants in the period at which forces are evaluated; by default the power of two from 8
      for each order on.

    For machines whose spin is given (`PrescribedSpin`, or phi prescribed) and whose forces depend on time by
    the angle of the shaft alone. Raises `InputError` for others, and `ConvergenceError` where no motion is
    found: start from one nearby, or follow the branch (`continuation`).
    """
    require_x64()
    machine.check()
    waves = waves_of(harmonics, turns, samples)
    refuse_not_driven(machine)
    top = known(speed)
    if top is not None:
        machine = condensed_below(machine, float(top) * harmonics, "equilibrium")
    alone = not traced(machine, speed, start)
    if alone:
        refuse_other_periods(system_of(machine), float(speed), waves)
    run = motion_at if alone else _derivable
    motion, found = run(machine, jnp.asarray(speed, float), waves, start)
    if alone:
        refuse_lost(found, float(speed))
    return motion


def motion_at(
    machine: Machine, speed: Array, waves: Waves, start: PeriodicMotion | None
) -> tuple[PeriodicMotion, Found]:
    """By programs that a branch uses too."""
    actual, nominal = systems_of(machine)
    begin = first_guess(actual, nominal, speed, waves, start)
    found = first_found(actual, begin, waves)
    return motion_of(actual, found.x, waves, machine.wiring.stations), found


@eqx.filter_jit
def _derivable(machine, speed, waves: Waves, start) -> tuple[PeriodicMotion, Found]:
    return motion_at(machine, speed, waves, start)


def first_guess(actual: System, nominal: System, speed, waves: Waves, start) -> Array:
    if start is None:
        return _resting(nominal, speed, waves)
    x = unknowns(actual, start, waves)
    m = n_free(actual) + actual.n_states()
    if x.shape[1] != m:
        raise InputError("`start`: must be a motion of this machine, but has other coordinates")
    return jnp.append(x.ravel(), speed)


def at_speed(size: int) -> Array:
    """The plane of all motions at one speed."""
    return jnp.zeros(size).at[-1].set(1.0)


def waves_of(harmonics: int, turns: int, samples: int | None) -> Waves:
    least = 4 * harmonics * turns + 1
    if samples is None:
        many = 2 ** int(np.ceil(np.log2(_SAMPLES * harmonics * turns)))
        return Waves(harmonics, turns, many)
    if samples < least:
        raise InputError(
            f"`samples`: {harmonics} harmonics over {turns} turns need {least} at least, but are {samples}"
        )
    return Waves(harmonics, turns, samples)


def refuse_lost(found: Found, speed: float) -> None:
    if not bool(found.settled):
        raise ConvergenceError(
            f"no periodic motion was found at {speed:.6g} rad/s in {int(found.steps)} steps: start from a "
            "motion nearby, follow the branch by `continuation`, or take more `samples` where contacts open "
            "and close"
        )


@quickly_compiled
def _resting(nominal: System, speed: Array, waves: Waves) -> Array:
    """The balanced machine staying where it does at this speed."""
    zero, n = jnp.zeros(()), n_free(nominal)
    y, _ = running(nominal, (zero, speed, zero))
    y = jnp.where(
        jnp.all(jnp.isfinite(y)), y, jnp.append(jnp.zeros(2 * n), initial_states(nominal))
    )
    rows = jnp.zeros((waves.count, y.size - n)).at[0].set(jnp.append(y[:n], y[2 * n :]))
    return jnp.append(rows.ravel(), speed)


def first_found(system: System, begin: Array, waves: Waves) -> Found:
    """From a rough start at its speed."""
    most = jnp.array(2 * _MANY), jnp.array(_MANY)
    return _program("find", system)(system, begin, at_speed(begin.size), waves, *most)


def found_near(system: System, start: Any, plane: Any, waves: Waves, most: int) -> Found:
    """From a near one."""
    return _program("find", system)(system, start, plane, waves, jnp.array(most), jnp.array(most))


def motion_of(system: System, x: Any, waves: Waves, stations: tuple[str, ...]) -> PeriodicMotion:
    return _program("described", system)(system, jnp.asarray(x), waves, stations)


_PROGRAMS = {
    (name, compiled): compiled(function)
    for name, function in (("find", find), ("described", described))
    for compiled in (quickly_compiled, lightly_compiled)
}


def _program(name: str, system: System) -> Any:
    """One that is compiled soon for a small machine, one that runs fast for a large one. In one thread: those
    of LAPACK wait for each other ten times as long as they work."""
    small = n_free(system) <= _SMALL
    run = _PROGRAMS[name, quickly_compiled if small else lightly_compiled]
    return one_thread(lambda *given: _ended(run(*given)))


def _ended(found: Any) -> Any:
    return found if traced(found) else jax.block_until_ready(found)
