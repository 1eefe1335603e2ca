"""Large machines in linear analysis: inner stations of shafts follow others where the user has not said."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from ..machine.condensation import FULL
from ..machine.machine import Machine
from ..simulation.condensing import condensed_up_to, in_steps, may_condense
from ..simulation.state import State

# By what part natural frequencies below the bound may be too high.
_ERROR = 1e-8
# The bound over the highest frequency that counts: what is left out answers as in statics, the better the
# farther away it is.
_BEYOND = 2.0
# Where frequencies are not known beforehand, rad/s.
_LEAST = 100.0

T = TypeVar("T")


def condensed_below(
    machine: Machine, frequency: float, at: Any, keep: tuple[int, ...] = ()
) -> Machine:
    """For motions of frequencies up to this one, rad/s, of either sign, with stations to `keep` by number;
    where `at` is a State, of which machine it is has been settled."""
    if isinstance(at, State):
        return machine
    highest = max(abs(float(frequency)), _LEAST) * _BEYOND / (2 * np.pi)
    return condensed_up_to(machine, in_steps(highest), _ERROR, None, keep)


def until_within(
    machine: Machine, start: float, at: Any, found: Callable[[Machine], tuple[T, float]]
) -> T:
    """What `found` gives of the machine condensed so far that the highest frequency that it tells (rad/s,
    inf where it has not got all that is asked for) is within the bound, first for `start`."""
    reach = max(start, _LEAST)
    while True:
        reduced = condensed_below(machine, reach, at)
        result, highest = found(reduced)
        settled = not may_condense(machine) or reduced.wiring.condensation in (None, FULL)
        if settled or highest <= reach:
            return result
        reach = highest if np.isfinite(highest) else 4.0 * reach
