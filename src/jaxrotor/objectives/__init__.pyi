from .criterion import Constraint as Constraint, Criterion as Criterion
from .fatigue import FatigueDamage as FatigueDamage
from .integral import Integral as Integral
from .level import Percentile as Percentile, RootMeanSquare as RootMeanSquare
from .machine_measures import (
    AbstractMachineMeasure as AbstractMachineMeasure,
    DecayRate as DecayRate,
    H2Norm as H2Norm,
    PoleMean as PoleMean,
    PoleSpread as PoleSpread,
    ResponsePeaks as ResponsePeaks,
    TotalMass as TotalMass,
    UnbalancePeak as UnbalancePeak,
)
from .mass import polar_inertia as polar_inertia, total_mass as total_mass
from .measure import AbstractMeasure as AbstractMeasure
from .peak import PassageAmplitude as PassageAmplitude, PeakValue as PeakValue
from .settling import SettlingTime as SettlingTime
