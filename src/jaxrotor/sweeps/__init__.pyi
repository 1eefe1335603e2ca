from .cases import Cases as Cases
from .outputs import OverSpeed as OverSpeed, TimeSeries as TimeSeries
from .sensitivity import (
    local_slopes as local_slopes,
    rank_regression as rank_regression,
    sobol_indices as sobol_indices,
)
from .sweep import sweep as sweep
