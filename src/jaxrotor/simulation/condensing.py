"""Which stations of a large machine a run solves for, where its user has not said."""

from typing import Any

import jax
import numpy as np

from ..core.errors import InputError
from ..core.parameter import is_concrete, numbers
from ..machine.condensation import Condensation, condensed_by
from ..machine.layout import count_of_free
from ..machine.machine import Machine
from ..machine.reduction import choose

# Free coordinates from which on inner stations of shafts follow others: forty stations.
_LARGE = 240
# By what part natural frequencies may be too high that samples can show, and of a finer tolerance the share.
_ERROR, _SHARE = 1e-6, 0.1
# What was chosen, the latest last.
_found: dict[Any, Condensation | None] = {}
_KEPT = 16


def condensed_for(machine: Machine, sample_rate: float, tolerance: float | None) -> Machine:
    """The machine itself where it is small, was reduced or is to be `full`, and under a trace; else reduced
    for all that samples can show, frequencies up to half the sample rate (Hz)."""
    leaves, tree = jax.tree.flatten(machine)
    if machine.wiring.condensation is not None or not all(map(is_concrete, leaves)):
        return machine
    if count_of_free(machine) <= _LARGE:
        return machine
    error = _ERROR if tolerance is None else min(_ERROR, _SHARE * tolerance)
    values = [np.asarray(numbers(x)) for x in leaves]
    key = tree, tuple((x.shape, x.tobytes()) for x in values), sample_rate, error
    if key not in _found:
        try:
            _found[key] = choose(machine, 0.5 * sample_rate, error)
        except InputError:  # the run itself says what is wrong with a law
            return machine
        while len(_found) > _KEPT:
            _found.pop(next(iter(_found)))
    return condensed_by(machine, _found[key])
