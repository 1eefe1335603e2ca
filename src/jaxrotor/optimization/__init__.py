"""The best design under constraints."""

from .experiment import NoRun, SimulatedRun
from .optimize import optimize
from .optimum import Optimum
from .variations import Variations

__all__ = ["NoRun", "Optimum", "SimulatedRun", "Variations", "optimize"]


def __dir__() -> list[str]:
    return __all__
