"""Which stations of a large machine a run solves for, where its user has not said."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..core.errors import InputError
from ..core.parameter import is_concrete
from ..core.protocol import AbstractPrescribed
from ..core.quick import quickly_compiled
from ..machine.condensation import FULL, Condensation, condensed_by
from ..machine.layout import count_of_free
from ..machine.machine import Machine
from ..machine.reduction import choose
from ..machine.speed_ratios import is_geared
from ..machine.wiring import FIXED
from .prescribed import looks
from .remembered import Remembered
from .simulation import Simulation

# Free coordinates from which on inner stations of shafts follow others: forty stations.
_LARGE = 240
# By what part natural frequencies may be too high that samples can show, and of a finer tolerance the share.
_ERROR, _SHARE = 1e-6, 0.1
_chosen: Remembered[Condensation] = Remembered(16)


def condensed_for(
    machine: Machine, simulation: Simulation, tolerance: float | None = None
) -> Machine:
    """`condensed_up_to` for all that samples can show, frequencies up to half the sample rate, at the speeds
    that the drive reaches."""
    if not may_condense(machine):
        return machine
    tolerance = simulation.tolerance if tolerance is None else tolerance
    error = _ERROR if tolerance is None else min(_ERROR, _SHARE * tolerance)
    speed = _fastest(machine, simulation)
    return condensed_up_to(machine, 0.5 * simulation.sample_rate, error, speed)


def _fastest(machine: Machine, simulation: Simulation) -> float | None:
    """Of a given spin, rad/s; `None` where it is not known, or where gears make others of it."""
    ends = [s for s in machine.stations if isinstance(s, AbstractPrescribed)]
    held = [h for h in machine.wiring.held if h.coordinate == 5 and h.motion != FIXED]
    turned = [machine.motions[h.motion] for h in held]
    if not (ends or turned) or is_geared(machine):
        return None
    speeds = np.abs(_speeds((ends, turned), jax.device_put(looks(simulation.t_end))))
    own = simulation.speed
    highest = max(speeds.max(), 0.0 if own is None or not is_concrete(own) else abs(float(own)))
    return in_steps(max(highest, 1.0))


def in_steps(bound: float) -> float:
    """The next power of the root of two: machines condensed for nearly the same share their compiled
    programs."""
    return float(2.0 ** (np.ceil(2 * np.log2(bound)) / 2))


@quickly_compiled
def _speeds(given: Any, times: Array) -> Array:
    ends, turned = given
    angles = [lambda t, e=e: e.motion(t)[5] for e in ends] + [m.position for m in turned]
    one = jnp.ones(())
    return jnp.stack([jax.vmap(lambda t, f=f: jax.jvp(f, (t,), (one,))[1])(times) for f in angles])


def may_condense(machine: Machine) -> bool:
    """Whether it is large, and its user has left the choice: not where it was reduced or is to be `full`,
    nor under a trace."""
    concrete = all(map(is_concrete, jax.tree.leaves(machine)))
    if machine.wiring.condensation is not None or not concrete:
        return False
    return count_of_free(machine) > _LARGE


def condensed_up_to(
    machine: Machine,
    frequency: float,
    error: float,
    speed: float | None = None,
    keep: tuple[int, ...] = (),
) -> Machine:
    """A machine that `may_condense` reduced for frequencies up to this one (Hz) and speeds up to `speed`
    (rad/s), with stations to `keep` by number; others as they are."""
    if not may_condense(machine):
        return machine
    asked = frequency, error, speed, keep
    found = _chosen.get(machine, asked)
    if found is None:
        try:
            found = _chosen.put(machine, asked, choose(machine, *asked) or FULL)
        except InputError:  # the run itself says what is wrong with a law
            return machine
    return condensed_by(machine, found)
