"""One machine many times over, in batches."""

from . import accessor as _accessor  # datasets know it from here on
from .cases import Cases
from .outputs import OverSpeed, TimeSeries
from .sensitivity import local_slopes, rank_regression, sobol_indices
from .sweep import sweep

__all__ = [
    "Cases",
    "OverSpeed",
    "TimeSeries",
    "local_slopes",
    "rank_regression",
    "sobol_indices",
    "sweep",
]


def __dir__() -> list[str]:
    return __all__
