"""Is every machine of the table one, and can the runs start?"""

from typing import Any

import jax.numpy as jnp
import numpy as np

from ..core.errors import InputError
from ..core.quick import lightly_compiled
from ..machine.machine import Machine
from ..machine.system import assemble
from ..search.instrumented import Instrumented
from ..simulation.checks import initial_speed
from ..simulation.equilibrium import refuse_unbalanced
from ..simulation.simulation import Simulation
from ..simulation.start import start
from .cases import Cases

# Rows that are checked one by one, at most: each takes milliseconds.
_ROWS = 256


def check_cases(machine: Machine, cases: Cases) -> None:
    """Every path is a number of the machine, and every row is a machine: of a long table those with each
    parameter's extremes, and some between."""
    bench = Instrumented(machine, {})
    for path in cases.values:
        bench.get(path)
    rows = {int(end(x)) for x in cases.values.values() for end in (np.argmin, np.argmax)}
    rows |= set(np.linspace(0, len(cases) - 1, min(_ROWS, len(cases))).astype(int).tolist())
    for row in sorted(rows):
        try:
            bench.set({path: jnp.asarray(x[row]) for path, x in cases.values.items()})
        except InputError as error:
            told = [f"case {row + 1}: {sentence}" for sentence in error.problems]
            raise InputError(*told) from None


def check_start(first: Machine, simulation: Simulation) -> None:
    """As `simulate` does, with the first machine, which `simulation` has been checked for."""
    if simulation.start == "static":
        speed = initial_speed(first, simulation.initial, simulation.speed)
        refuse_unbalanced(first, _unbalanced(first, speed))


@lightly_compiled
def _unbalanced(machine: Machine, speed: Any):
    return start(assemble(machine), None, "static", speed)[1]
