from .curves import Curve as Curve, chart as chart
from .design import (
    before_after as before_after,
    peaks_before_after as peaks_before_after,
    search_history as search_history,
)
from .diagnose import (
    cascade as cascade,
    full_spectrum as full_spectrum,
    order_tracks as order_tracks,
    waterfall_map as waterfall_map,
)
from .experiment import expected_stds as expected_stds
from .forces import bearing_forces as bearing_forces
from .identification import (
    channel_fits as channel_fits,
    correlations as correlations,
    costs as costs,
    posteriors as posteriors,
    profile_curves as profile_curves,
)
from .linear import campbell_diagram as campbell_diagram, stability_map as stability_map
from .loops import (
    loop_bode as loop_bode,
    nyquist as nyquist,
    sensitivity_curves as sensitivity_curves,
)
from .machine import draw_machine as draw_machine
from .maps import interference_diagram as interference_diagram, support_map as support_map
from .motion import inclinations as inclinations, spin as spin, vibration as vibration
from .orbits import (
    bifurcation as bifurcation,
    centreline as centreline,
    orbits as orbits,
    poincare as poincare,
)
from .paths import distances as distances, trajectories as trajectories
from .periodic import branch_amplitudes as branch_amplitudes
from .quantities import over_time as over_time, spectrum as spectrum
from .response import bode as bode, polar as polar
from .sensitivity import scatter_matrix as scatter_matrix, sensitivity_bars as sensitivity_bars
from .shapes import mode_shapes as mode_shapes
from .standards import (
    amplification_widths as amplification_widths,
    placed_shape as placed_shape,
    response_margins as response_margins,
    screening_chart as screening_chart,
    stability_curve as stability_curve,
)
from .sweep import (
    distributions as distributions,
    grid_lines as grid_lines,
    grid_map as grid_map,
    grid_over as grid_over,
    percentile_bands as percentile_bands,
)
from .torsion import (
    speed_differences as speed_differences,
    speed_spectrum as speed_spectrum,
    torques as torques,
)
from .torsional import (
    start_transient as start_transient,
    torque_over_speed as torque_over_speed,
    torsional_interference as torsional_interference,
    torsional_shapes as torsional_shapes,
)
