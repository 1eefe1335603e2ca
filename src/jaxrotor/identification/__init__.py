"""Parameters from measured runs, with intervals; balancing."""

from .balance import (
    Balance,
    Correction,
    balance,
    correction,
    influence_coefficients,
    modal_balance,
    phasor,
)
from .bootstrap import Replicas, bootstrap
from .domain import AbstractDomain, Frequencies, Orders, Time
from .identification import Identification
from .identify import Stage, identify
from .measured_run import MeasuredRun
from .posterior import Posterior, posterior
from .profile import LikelihoodProfile, likelihood_profiles

__all__ = [
    "AbstractDomain",
    "Balance",
    "Correction",
    "Frequencies",
    "Identification",
    "Orders",
    "Posterior",
    "LikelihoodProfile",
    "Replicas",
    "Stage",
    "Time",
    "MeasuredRun",
    "balance",
    "bootstrap",
    "correction",
    "identify",
    "influence_coefficients",
    "modal_balance",
    "phasor",
    "posterior",
    "likelihood_profiles",
]


def __dir__() -> list[str]:
    return __all__
