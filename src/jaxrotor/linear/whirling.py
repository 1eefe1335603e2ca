"""Supports whose coefficients depend on the frequency of the whirl, in analyses of one frequency."""

import dataclasses
from typing import Any

import jax.numpy as jnp

from ..core.errors import InputError
from ..elements.bearings.tilting_pads import TiltingPadBearing
from ..elements.bearings.whirl_dependent import WhirlDependentSupport
from ..machine.machine import Machine

_WHIRLED = (WhirlDependentSupport, TiltingPadBearing)


def at_whirl(part: Any, frequency: Any) -> Any:
    """A part, at this whirl frequency (rad/s) if it depends on one and none is given for it."""
    if not isinstance(part, _WHIRLED) or part.whirl is not None:
        return part
    return dataclasses.replace(part, whirl=jnp.abs(jnp.asarray(frequency, float)))


def whirl_dependent(machine: Machine) -> tuple[str, ...]:
    """Names of the supports whose coefficients depend on the frequency of the whirl."""
    return tuple(
        name
        for name, part in machine.elements().items()
        if isinstance(part, _WHIRLED) and part.whirl is None
    )


def with_whirl(machine: Machine, frequency: Any) -> Machine:
    """The machine with the coefficients of these supports at one whirl frequency, rad/s."""
    names = whirl_dependent(machine)
    if not names:
        return machine
    return machine.set({name: at_whirl(machine[name], frequency) for name in names})


def refuse_whirl_dependent(machine: Machine, what: str) -> None:
    """Raises `InputError` where eigenvalues are asked for at coefficients of one frequency for all."""
    if names := whirl_dependent(machine):
        raise InputError(
            f"`{names[0]}`: {what} takes no coefficients over whirl frequency, since each mode has its own: "
            'see jr.linear.matched_modes, or put its `fitted()` in its place, or `set({"'
            f'{names[0]}.whirl": ...}})` to the frequency that counts'
        )
