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
    """The machine itself where it is small, was reduced or is to be `full`, and under a trace; else reduced
    for all that samples can show, frequencies up to half the sample rate (Hz)."""
    concrete = all(map(is_concrete, jax.tree.leaves(machine)))
    if machine.wiring.condensation is not None or not concrete:
        return machine
    if count_of_free(machine) <= _LARGE:
        return machine
    error = _ERROR if tolerance is None else min(_ERROR, _SHARE * tolerance)
    asked = 0.5 * sample_rate, error
    found = _chosen.get(machine, asked)
    if found is None:
        try:
            found = _chosen.put(machine, asked, choose(machine, *asked) or FULL)
        except InputError:  # the run itself says what is wrong with a law
            return machine
    return condensed_by(machine, found)
