"""What a run or a machine is judged by."""

from .criterion import Constraint, Criterion
from .fatigue import FatigueDamage
from .integral import Integral
from .level import Percentile, RootMeanSquare
from .machine_measures import (
    AbstractMachineMeasure,
    DecayRate,
    H2Norm,
    PoleMean,
    PoleSpread,
    ResponsePeaks,
    TotalMass,
    UnbalancePeak,
)
from .mass import polar_inertia, total_mass
from .measure import AbstractMeasure
from .peak import PassageAmplitude, PeakValue
from .settling import SettlingTime

__all__ = [
    "AbstractMachineMeasure",
    "AbstractMeasure",
    "Constraint",
    "Criterion",
    "DecayRate",
    "FatigueDamage",
    "H2Norm",
    "Integral",
    "PassageAmplitude",
    "PeakValue",
    "Percentile",
    "PoleMean",
    "PoleSpread",
    "ResponsePeaks",
    "RootMeanSquare",
    "SettlingTime",
    "TotalMass",
    "UnbalancePeak",
    "polar_inertia",
    "total_mass",
]


def __dir__() -> list[str]:
    return __all__
