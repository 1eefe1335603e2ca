"""The system of a machine whose numbers are known, assembled by a program of its own: programs that take it
compile without."""

from ..core.quick import quickly_compiled, traced
from ..machine.machine import Machine
from ..machine.system import System, assemble, assemble_both
from .remembered import Remembered

# Of a machine that runs, and of a few that run in turn.
_systems: Remembered[tuple[System, System]] = Remembered(4)


def system_of(machine: Machine, nominal: bool = False) -> System:
    """As `assemble`; within another program it is a part of that one."""
    return assemble(machine, nominal) if traced(machine) else systems_of(machine)[nominal]


def systems_of(machine: Machine) -> tuple[System, System]:
    """As `assemble_both`; within another program they are a part of that one."""
    if traced(machine):
        return assemble_both(machine)
    return _systems.get(machine, None) or _systems.put(machine, None, _assembled(machine))


def nominal_of(machine: Machine) -> System:
    """Of a machine that is looked at once."""
    return _assembled(machine)[True]


@quickly_compiled
def _assembled(machine: Machine) -> tuple[System, System]:
    return assemble_both(machine)
