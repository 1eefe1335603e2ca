"""Steps in time: exponential and stiff methods. They know no machine."""

from .exponential import ETD4RK, ExponentialAdams
from .rosenbrock import Rosenbrock

__all__ = ["ETD4RK", "ExponentialAdams", "Rosenbrock"]


def __dir__() -> list[str]:
    return __all__
