"""From a machine to its motion: starts, plans, runs, results, energies."""

from .energy import EnergyAudit, energy_audit
from .equilibrium import static_equilibrium
from .pilot import plan
from .plan import Plan
from .response import Response
from .simulate import simulate
from .simulation import Simulation
from .state import State

__all__ = [
    "EnergyAudit",
    "Plan",
    "Response",
    "Simulation",
    "State",
    "energy_audit",
    "plan",
    "simulate",
    "static_equilibrium",
]


def __dir__() -> list[str]:
    return __all__
