"""The system of a machine whose numbers are known, assembled by a program of its own: programs that take it
compile without."""

from ..core.quick import quickly_compiled, traced
from ..machine.machine import Machine
from ..machine.system import System, assemble
from .remembered import Remembered

# Of a machine that runs, both kinds; of a few that run in turn.
_systems: Remembered[System] = Remembered(8)


def system_of(machine: Machine, nominal: bool = False) -> System:
    """As `assemble`; within another program it is a part of that one."""
    if traced(machine):
        return assemble(machine, nominal)
    found = _systems.get(machine, nominal)
    return found or _systems.put(machine, nominal, _assembled(machine, nominal))


@quickly_compiled
def _assembled(machine: Machine, nominal: bool) -> System:
    return assemble(machine, nominal)
