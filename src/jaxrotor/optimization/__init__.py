"""The best design under constraints."""

from .experiment import AsBuilt, Transient
from .optimize import optimize
from .optimum import Optimum
from .variations import Variations

__all__ = ["AsBuilt", "Optimum", "Transient", "Variations", "optimize"]


def __dir__() -> list[str]:
    return __all__
