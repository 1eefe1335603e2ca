"""What a machine is given in time: known before anything runs."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.parameter import numbers
from ..core.quick import quickly_compiled
from ..machine.machine import Machine
from ..machine.system import System, jump_times
from ..profiles.motion import AbstractMotion
from ..profiles.schedule import AbstractSchedule
from .assembling import system_of
from .remembered import Remembered
from .shaken import shaking

# Instants at which the drive's speed is looked up.
_LOOKS = 512


class Prescribed(NamedTuple):
    """`speeds`: of the drive at the times asked for, rad/s. `frequency`: the highest of all that is given in
    time, rad/s; `excitation`: of what swings at one. `jumps`: instants at which some force jumps, s.
    `shaking`: how strongly the ground accelerates at the times asked for."""

    speeds: Float[Array, " nt"]
    frequency: Float[Array, ""]
    excitation: Float[Array, ""]
    jumps: Float[Array, " j"]
    shaking: Float[Array, " nt"]


def prescribed(machine: Machine, times: Float[Array, " nt"]) -> Prescribed:
    return _prescribed(machine, system_of(machine), times)


@quickly_compiled
def _prescribed(machine: Machine, system: System, times: Array) -> Prescribed:
    kinds = (AbstractSchedule, AbstractMotion)
    given = jax.tree.leaves(machine, is_leaf=lambda x: isinstance(x, kinds))
    given = [one for one in given if isinstance(one, kinds)]

    def highest(found: list[Array]) -> Array:
        return jnp.max(jnp.stack([jnp.zeros(()), *found]))

    return Prescribed(
        jax.vmap(lambda t: system.reference(t)[1])(times),
        highest([one.top_frequency() for one in given]),
        highest([one.excitation_frequency() for one in given]),
        jump_times(system),
        shaking(system, times),
    )


def looks(t_end: float) -> np.ndarray:
    """Instants at which to look for the highest speed, s."""
    return np.linspace(0.0, t_end, _LOOKS)


# Of a machine that runs, and of a few that run in turn.
_known: Remembered[Prescribed] = Remembered(4)


def prescribed_until(machine: Machine, t_end: float) -> Prescribed:
    """In numbers, at `looks(t_end)`; `machine` may be wrapped by `grad`."""
    found = _known.get(machine, t_end)
    if found is None:
        given = prescribed(in_numbers(machine), jax.device_put(looks(t_end)))
        found = _known.put(machine, t_end, jax.tree.map(np.asarray, given))
    return found


def in_numbers(machine: Machine) -> Machine:
    """Free of what `grad` wraps around them: the choice of a step has no derivative."""
    return jax.tree.map(lambda x: jax.device_put(np.asarray(numbers(x))), machine)


def top_speed(machine: Machine, t_end: float, speed: Any = None) -> tuple[float, float]:
    """When the drive turns fastest (s), and how fast (rad/s), or `speed` if that is higher."""
    return fastest(prescribed_until(machine, t_end), t_end, speed)


def fastest(given: Prescribed, t_end: float, speed: Any = None) -> tuple[float, float]:
    """`top_speed` of what is known already."""
    speeds = np.abs(np.asarray(given.speeds))
    i = int(np.argmax(speeds))
    own = 0.0 if speed is None else abs(float(numbers(speed)))
    return float(looks(t_end)[i]), max(float(speeds[i]), own)
