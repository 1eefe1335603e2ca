"""Which stations of a large machine a run solves for, where its user has not said."""

import jax

from ..core.errors import InputError
from ..core.parameter import is_concrete
from ..machine.condensation import FULL, Condensation, condensed_by
from ..machine.layout import count_of_free
from ..machine.machine import Machine
from ..machine.reduction import choose
from .remembered import Remembered

# Free coordinates from which on inner stations of shafts follow others: forty stations.
_LARGE = 240
# By what part natural frequencies may be too high that samples can show, and of a finer tolerance the share.
_ERROR, _SHARE = 1e-6, 0.1
_chosen: Remembered[Condensation] = Remembered(16)


def condensed_for(machine: Machine, sample_rate: float, tolerance: float | None) -> Machine:
    """`condensed_up_to` for all that samples can show, frequencies up to half the sample rate (Hz)."""
    error = _ERROR if tolerance is None else min(_ERROR, _SHARE * tolerance)
    return condensed_up_to(machine, 0.5 * sample_rate, error)


def may_condense(machine: Machine) -> bool:
    """Whether it is large, and its user has left the choice: not where it was reduced or is to be `full`,
    nor under a trace."""
    concrete = all(map(is_concrete, jax.tree.leaves(machine)))
    if machine.wiring.condensation is not None or not concrete:
        return False
    return count_of_free(machine) > _LARGE


def condensed_up_to(
    machine: Machine, frequency: float, error: float, keep: tuple[int, ...] = ()
) -> Machine:
    """A machine that `may_condense` reduced for frequencies up to this one (Hz), with stations to `keep` by
    number; others as they are."""
    if not may_condense(machine):
        return machine
    asked = frequency, error, keep
    found = _chosen.get(machine, asked)
    if found is None:
        try:
            found = _chosen.put(machine, asked, choose(machine, *asked) or FULL)
        except InputError:  # the run itself says what is wrong with a law
            return machine
    return condensed_by(machine, found)
