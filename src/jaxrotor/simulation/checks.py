"""Is the request sound, before a run; was the run one, after it."""

import os
import warnings
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import positive
from ..core.errors import ConvergenceError, InputError, SimulationFailed
from ..core.parameter import is_concrete, known, numbers
from ..core.protocol import AbstractPrescribed
from ..machine.layout import lay_out
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from ..machine.system import assemble
from ..machine.wiring import FIXED
from .attitude import poles_passed
from .blame import not_finite
from .equilibrium import refuse_unbalanced
from .response import Response, RunInfo
from .state import State

# How often the states of a run are held at once, at least.
_COPIES = 2
# A periodic whirl found by shooting must come back to this part of its size.
_STEADY_GAP = 1e-7
# A run by a step of the user's own is warned of from this error on, as part of a coordinate's peak.
_COARSE = 1e-2


def check_machine(machine: Any) -> None:
    if not isinstance(machine, Machine):
        raise InputError(f"machine must be a Machine, but is {machine!r}")
    machine.check()


def sample_count(t_end: Any, sample_rate: Any, stations: int = 1) -> int:
    """Of a run; raises `InputError` where there are too few, or more than the memory of this computer holds
    for a machine of so many `stations`."""
    for name, value, unit in (("t_end", t_end, "s"), ("sample_rate", sample_rate, "Hz")):
        if not is_concrete(value):
            raise InputError(f"{name} sets the number of samples, so it must be a plain number")
        positive(unit)(value, name)
    count = int(float(t_end) * float(sample_rate) + 1e-9) + 1
    if count < 3:
        raise InputError(
            f"t_end = {t_end:g} s at sample_rate = {sample_rate:g} Hz gives {count} samples: "
            "raise one of them"
        )
    size = _COPIES * 8.0 * 12 * stations * count
    if size > _memory():
        raise InputError(
            f"t_end = {t_end:g} s at sample_rate = {sample_rate:g} Hz gives {count:.3g} samples, "
            f"{size / 1e9:.3g} GB, more than the memory of this computer: lower one of them"
        )
    return count


def _memory() -> float:
    """Bytes that this computer has."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (ValueError, OSError, AttributeError):
        return 64e9


def a_start(value: Any, place: str) -> Any:
    """What `initial` may be."""
    words = ("static", "running", "steady", "undeformed")
    if isinstance(value, State) or (isinstance(value, str) and value in words):
        return value
    raise InputError(
        f'{place} must be "static", "running", "steady", "undeformed" or a State, but is '
        + " ".join(repr(value).split())
    )


def a_solver(value: Any, place: str) -> Any:
    """What `solver` may be."""
    if isinstance(value, diffrax.AbstractSolver):
        return value
    name = value.__name__ if isinstance(value, type) else "Tsit5"
    raise InputError(
        f"{place} must be a solver of diffrax, such as diffrax.{name}(), but is {value!r}"
    )


def initial_speed(machine: Machine, initial: Any, speed: Any) -> Float[Array, ""]:
    if isinstance(initial, State):
        if speed is not None:
            raise InputError("a State brings its own speeds: leave `speed` out")
        shape = (len(machine.wiring.stations), 6)
        for name in ("position", "velocity"):
            if jnp.shape(getattr(initial, name)) != shape:
                raise InputError(
                    f"initial.{name} must have shape {shape} (stations, coordinates), but has "
                    f"{jnp.shape(getattr(initial, name))}"
                )
        count = assemble(machine).n_states()
        if initial.internal is not None and jnp.shape(initial.internal) != (count,):
            raise InputError(
                f"initial.internal must hold {count} numbers, the elements' internal states, but "
                f"has shape {jnp.shape(initial.internal)}"
            )
        for name in ("position", "velocity", "internal"):
            value = getattr(initial, name)
            if value is not None and is_concrete(value) and not np.all(np.isfinite(numbers(value))):
                raise InputError(f"initial.{name} must be finite, but holds nan or inf")
        return jnp.max(jnp.abs(jnp.asarray(initial.velocity, float)[:, 5]))
    if speed is not None:
        try:
            speed = jnp.asarray(speed, float)
        except (TypeError, ValueError):
            raise InputError(f"speed must be a number in rad/s, but is {speed!r}") from None
        number = known(speed)
        if speed.shape != () or (number is not None and not np.isfinite(number)):
            raise InputError(f"speed must be one finite number in rad/s, but is {number}")
    if machine.is_driven:
        start = _drive_speed(machine)
        given, own = (None if x is None else known(x) for x in (speed, start))
        if given is not None and own is not None and abs(given - own) > 1e-9 * max(1.0, abs(own)):
            raise InputError(
                f"speed is {given:g} rad/s, but the drive starts at {own:g} rad/s: leave it out, "
                "or change the drive's profile"
            )
        speed = start
    speed = jnp.zeros(()) if speed is None else speed
    if (
        isinstance(initial, str)
        and initial == "steady"
        and is_concrete(speed)
        and abs(numbers(speed)) < 1e-6
    ):
        raise InputError('initial="steady" needs a speed other than 0 rad/s: give `speed`')
    return speed


def refuse_sampled_whirl(initial: Any, sampled: bool) -> None:
    """`sampled`: whether a controller of the machine samples."""
    if isinstance(initial, str) and initial == "steady" and sampled:
        raise InputError(
            'initial="steady" needs a motion that repeats with each turn, which a sampling controller has '
            'not: start "static" or from a State'
        )


def _drive_speed(machine: Machine) -> Float[Array, ""]:
    """At the start, rad/s; without compiling anything, where one end or one coordinate is driven."""
    zero = jnp.zeros(())
    driven = [s.motion for s in machine.stations if isinstance(s, AbstractPrescribed)]
    if driven:
        return jax.jvp(driven[0], (zero,), (jnp.ones(()),))[1][5]
    held = {h.motion for h in machine.wiring.held if h.coordinate == 5 and h.motion != FIXED}
    if len(held) == 1:
        return jax.jvp(machine.motions[held.pop()].position, (zero,), (jnp.ones(()),))[1]
    return _reference_speed(machine)


@eqx.filter_jit
def _reference_speed(machine: Machine) -> Float[Array, ""]:
    return assemble(machine).reference(jnp.zeros(()))[1]


def turns_freely(machine: Machine) -> bool:
    """Whether some station's spin is its own."""
    layout = lay_out(structure_of(machine))
    return any(place // layout.n_mass == 5 for place in layout.free)


def speed_beyond(response: Response, planned: float) -> float | None:
    """The speed (rad/s) that a line without a drive reached beyond what was planned for; `None` where
    it stayed below. A run that went astray counts with at most ten times the plan."""
    if response.machine.is_driven:
        return None
    layout = lay_out(structure_of(response.machine))
    free = np.array(layout.free, dtype=int)
    rates = numbers(response.y)[:, free.size : 2 * free.size][:, free // layout.n_mass == 5]
    rates = rates[np.isfinite(rates).all(axis=1)]
    seen = float(np.abs(rates).max(initial=0.0))
    if seen <= 1.1 * planned + 1.0:
        return None
    return min(seen, 10 * planned + 1000.0)


def judge(response: Response, initial, checks) -> None:
    """After a concrete run: is it one?"""
    sample = response.failed_at()
    blame = None if sample is None else not_finite(*_around(response, sample))
    if sample == 0 and blame:
        raise InputError(f"{blame} before anything moves: mend its law")
    if isinstance(initial, str) and initial in ("static", "running"):
        refuse_unbalanced(response.machine, checks)
    if isinstance(initial, str) and initial == "steady" and np.isinf(numbers(checks)):
        raise ConvergenceError(
            "no periodic whirl was found: without damping a mode is in resonance at this speed, and its "
            "motion grows with each turn: choose another speed, or give the machine damping"
        )
    if isinstance(initial, str) and initial == "steady" and not numbers(checks) < _STEADY_GAP:
        raise ConvergenceError(
            f"no periodic whirl was found: after a turn the state differs by {numbers(checks):.1e} of "
            "its size; the torques on the line do not balance at this speed, or it is unstable there"
        )
    if sample is not None:
        kept = response.until(sample)
        t = numbers(response.t)
        remedy = "take a smaller step (step=...), or look for an instability of the machine there"
        if blame:
            remedy = f"{blame} there, so mend its law"
        for name, at in list(poles_passed(kept))[:1]:
            remedy += f" (theta of `{name}` had come to 90 degrees at t = {at:.6g} s)"
        raise SimulationFailed(
            f"the run left the finite numbers between t = {t[max(0, sample - 1)]:.6g} s "
            f"and {t[sample]:.6g} s ({response.info.solver}, "
            f"{response.info.substeps or 'adaptive'} steps a sample): {remedy}; "
            f"the {sample} samples before are in the exception's `response`",
            kept,
        )


def error_words(info: RunInfo) -> str:
    """Of a run whose own error is above its tolerance; else empty."""
    if info.error is None or not all(map(is_concrete, (info.error, info.tolerance, info.step))):
        return ""
    error, asked, step = (float(numbers(x)) for x in (info.error, info.tolerance, info.step))
    own = not asked > 0  # a step of the user's own comes without a tolerance
    if error <= (_COARSE if own else asked) or np.isnan(error):
        return ""
    limit = "" if own else f", where {asked:.1g} was asked for"
    return (
        f"the run's own estimate of its error is {error:.1g} of a coordinate's peak{limit}: the step, "
        f"{step:.3g} s, is too long for what happens in it; give a shorter one (step=...)"
        + (", or none" if own else "")
    )


def tell_error(info: RunInfo) -> None:
    """Warns of a run whose own error is above its tolerance."""
    if words := error_words(info):
        warnings.warn(words, stacklevel=3)


def _around(response: Response, sample: int) -> tuple[Machine, Array, Array]:
    """The machine, and instants and states on the way out of the finite numbers before `sample`."""
    t, y, last = response.t, response.y, max(0, sample - 1)
    n = len(lay_out(structure_of(response.machine)).free)
    start = jnp.where(jnp.isfinite(y[last]), y[last], 0.0)
    ahead = jnp.concatenate([start[n : 2 * n] * (t[1] - t[0]), jnp.zeros(start.size - n)])
    if last > 0:
        ahead = y[last] - y[last - 1]
    parts = jnp.linspace(0.0, 1.0, 9)
    return response.machine, t[last] + parts * (t[1] - t[0]), start + parts[:, None] * ahead
