"""Is the request sound, before a run; was the run one, after it."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import InputError, SimulationFailed
from ..machine.machine import Machine
from ..machine.system import assemble
from ..parameter import is_concrete
from .equilibrium import refuse_unbalanced
from .response import Response
from .state import State

# A periodic whirl found by shooting must come back to this part of its size.
_STEADY_GAP = 1e-7


def sample_count(t_end: Any, sample_rate: Any) -> int:
    for name, value, unit in (("t_end", t_end, "s"), ("sample_rate", sample_rate, "Hz")):
        if not is_concrete(value):
            raise InputError(f"{name} sets the number of samples, so it must be a plain number")
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise InputError(f"{name} must be a number in {unit}, but is {value!r}") from None
        if not (0 < number < float("inf")):
            raise InputError(f"{name} must be positive and finite, but is {number:g} {unit}")
    count = int(float(t_end) * float(sample_rate) + 1e-9) + 1
    if count < 3:
        raise InputError(
            f"t_end = {t_end:g} s at sample_rate = {sample_rate:g} Hz gives {count} samples: "
            "raise one of them"
        )
    return count


def initial_speed(machine: Machine, initial: Any, speed: Any) -> Float[Array, ""]:
    if not isinstance(initial, State) and initial not in ("static", "steady", "undeformed"):
        raise InputError(
            'initial must be "static", "steady", "undeformed" or a State, but is ' + repr(initial)
        )
    if isinstance(initial, State):
        if speed is not None:
            raise InputError("a State brings its own speeds: leave `speed` out")
        shape = (len(machine.stations), 6)
        for name in ("position", "velocity"):
            if jnp.shape(getattr(initial, name)) != shape:
                raise InputError(
                    f"initial.{name} must have shape {shape} (stations, coordinates), but has "
                    f"{jnp.shape(getattr(initial, name))}"
                )
        return jnp.zeros(())
    if speed is not None:
        try:
            speed = jnp.asarray(speed, float)
        except (TypeError, ValueError):
            raise InputError(f"speed must be a number in rad/s, but is {speed!r}") from None
        if speed.shape != () or (is_concrete(speed) and not bool(jnp.isfinite(speed))):
            raise InputError(f"speed must be one finite number in rad/s, but is {speed}")
    driven, w0 = _drive_speed(machine)
    if driven and speed is not None and is_concrete(speed - w0):
        if abs(float(speed) - float(w0)) > 1e-9 * max(1.0, abs(float(w0))):
            raise InputError(
                f"speed is {float(speed):g} rad/s, but the drive starts at {float(w0):g} rad/s: "
                "leave speed out, or change the drive's profile"
            )
    if driven:
        speed = w0
    speed = jnp.zeros(()) if speed is None else speed
    if (
        isinstance(initial, str)
        and initial == "steady"
        and is_concrete(speed)
        and float(speed) == 0
    ):
        raise InputError('initial="steady" needs a speed other than 0 rad/s: give `speed`')
    return speed


def _drive_speed(machine: Machine) -> tuple[bool, Array]:
    system = assemble(machine)
    driven = bool(system.ground) or any(
        c == 5 and motion >= 0
        for group in system.layout.stations
        for row in group.motions
        for c, motion in zip(group.held, row)
    )
    return driven, system.reference(jnp.zeros(()))[1] if driven else jnp.zeros(())


def judge(response: Response, initial, checks) -> None:
    """After a concrete run: is it one?"""
    if isinstance(initial, str) and initial == "static":
        refuse_unbalanced(response.machine, checks)
    if isinstance(initial, str) and initial == "steady" and not float(checks) < _STEADY_GAP:
        raise InputError(
            f"no periodic whirl was found: after a turn the state differs by {float(checks):.1e} of "
            "its size; the torques on the line do not balance at this speed, or it is unstable there"
        )
    sample = response.failed_at()
    if sample is not None:
        kept = response.until(sample)
        raise SimulationFailed(
            f"the run left the finite numbers between t = {float(response.t[max(0, sample - 1)]):.6g} s "
            f"and {float(response.t[sample]):.6g} s ({response.info.solver}, "
            f"{response.info.substeps or 'adaptive'} steps a sample): take a smaller step "
            "(step=...), or look for an instability of the machine there; "
            f"the {sample} samples before are in the exception's `response`",
            kept,
        )
