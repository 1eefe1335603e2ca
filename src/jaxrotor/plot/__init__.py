"""Pictures of machines and of runs."""

from .chart import Curve, chart
from .design import before_after, peaks_before_after, search_history
from .diagnose import cascade, full_spectrum, order_tracks, waterfall_map
from .forces import bearing_forces
from .identification import channel_fits, correlations, costs, posteriors, profile_curves
from .linear import campbell_diagram, stability_map
from .machine import draw_machine
from .maps import interference_diagram, support_map
from .motion import inclinations, spin, vibration
from .orbits import bifurcation, centreline, orbits, poincare
from .paths import distances, trajectories
from .quantities import over_time, spectrum
from .response import bode, polar
from .sensitivity import scatter_matrix, sensitivity_bars
from .shapes import mode_shapes
from .sweep import distributions, grid_lines, grid_map, grid_over, percentile_bands
from .torsion import speed_differences, speed_spectrum, torques

__all__ = [
    "Curve",
    "bearing_forces",
    "before_after",
    "bifurcation",
    "bode",
    "campbell_diagram",
    "cascade",
    "centreline",
    "channel_fits",
    "chart",
    "correlations",
    "costs",
    "distances",
    "distributions",
    "draw_machine",
    "full_spectrum",
    "grid_lines",
    "grid_map",
    "grid_over",
    "inclinations",
    "interference_diagram",
    "mode_shapes",
    "orbits",
    "order_tracks",
    "over_time",
    "peaks_before_after",
    "percentile_bands",
    "poincare",
    "polar",
    "posteriors",
    "profile_curves",
    "scatter_matrix",
    "search_history",
    "sensitivity_bars",
    "spectrum",
    "speed_differences",
    "speed_spectrum",
    "spin",
    "stability_map",
    "support_map",
    "torques",
    "trajectories",
    "vibration",
    "waterfall_map",
]


def __dir__() -> list[str]:
    return __all__
