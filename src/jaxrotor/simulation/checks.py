"""Is what was asked for sound? Before a run."""

import os
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import positive
from ..core.errors import InputError
from ..core.parameter import is_concrete, known, numbers
from ..core.protocol import AbstractPrescribed
from ..core.quick import quickly_compiled
from ..machine.layout import layout_of
from ..machine.machine import Machine
from ..machine.system import assemble
from ..machine.wiring import FIXED
from ..profiles.motion import AbstractMotion
from .state import State

# How often the states of a run are held at once, at least.
_COPIES = 2


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
    import diffrax  # takes as long to load as the rest of a check, of studies that mostly name no solver

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
        if initial.internal is not None:
            count = assemble(machine).n_states()
            if jnp.shape(initial.internal) != (count,):
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
    """At the start, rad/s; by a program of the drive alone, where one end or one coordinate is driven."""
    driven = [s for s in machine.stations if isinstance(s, AbstractPrescribed)]
    if driven:
        return _speed_of_end(driven[0])
    held = {h.motion for h in machine.wiring.held if h.coordinate == 5 and h.motion != FIXED}
    if len(held) == 1:
        return _speed_of_motion(machine.motions[held.pop()])
    return _reference_speed(machine)


@quickly_compiled
def _speed_of_end(end: AbstractPrescribed) -> Float[Array, ""]:
    return jax.jvp(end.motion, (jnp.zeros(()),), (jnp.ones(()),))[1][5]


@quickly_compiled
def _speed_of_motion(motion: AbstractMotion) -> Float[Array, ""]:
    return jax.jvp(motion.position, (jnp.zeros(()),), (jnp.ones(()),))[1]


@quickly_compiled
def _reference_speed(machine: Machine) -> Float[Array, ""]:
    return assemble(machine).reference(jnp.zeros(()))[1]


def turns_freely(machine: Machine) -> bool:
    """Whether some station's spin is its own."""
    layout = layout_of(machine)
    return any(place // layout.n_mass == 5 for place in layout.free)
