"""The same machine, linear: modes, critical speeds, frequency response."""

from .campbell import Campbell, campbell
from .cluster import Cluster, decay_rate, pole_cluster
from .critical import critical_modes, critical_speeds
from .eigen import split_derivatives
from .linearise import LinearModel, linearize
from .matrix_equations import lyapunov, riccati
from .modes import Mode, modes
from .norms import h2_norm, h_infinity_norm, response_peaks
from .orders import OrderResponse, order_response, unbalance_response
from .peak import Peak, unbalance_peak
from .regulator import LQG, Regulator, closed_loop_cost, lqg, lqr
from .response import FrequencyResponse, frequency_response
from .supports import CriticalSpeedMap, critical_speed_map
from .threshold import stability_threshold
from .torsion import (
    Interference,
    TorsionalMode,
    holzer_table,
    interferences,
    torsional,
    torsional_modes,
)
from .transfer import Peaks

__all__ = [
    "LQG",
    "Campbell",
    "Cluster",
    "CriticalSpeedMap",
    "FrequencyResponse",
    "Interference",
    "LinearModel",
    "Mode",
    "OrderResponse",
    "Peak",
    "Peaks",
    "Regulator",
    "TorsionalMode",
    "campbell",
    "closed_loop_cost",
    "critical_modes",
    "critical_speed_map",
    "critical_speeds",
    "decay_rate",
    "frequency_response",
    "h2_norm",
    "h_infinity_norm",
    "holzer_table",
    "interferences",
    "linearize",
    "lqg",
    "lqr",
    "lyapunov",
    "modes",
    "order_response",
    "pole_cluster",
    "response_peaks",
    "riccati",
    "split_derivatives",
    "stability_threshold",
    "torsional",
    "torsional_modes",
    "unbalance_peak",
    "unbalance_response",
]


def __dir__() -> list[str]:
    return __all__
