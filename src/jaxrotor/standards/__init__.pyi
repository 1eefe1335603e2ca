from .amplification import (
    Resonances as Resonances,
    amplification_factors as amplification_factors,
    resonances as resonances,
)
from .balance_grade import (
    HoleCorrection as HoleCorrection,
    fill_holes as fill_holes,
    in_two_planes as in_two_planes,
    permissible_unbalance as permissible_unbalance,
    residual_unbalance as residual_unbalance,
    split_correction as split_correction,
)
from .finding import Assessment as Assessment, Finding as Finding
from .sn_curve import SNCurve as SNCurve
from .starts import (
    cycle_damage as cycle_damage,
    shaft_torque as shaft_torque,
    shear_stress as shear_stress,
    start_resonance as start_resonance,
    starts_allowed as starts_allowed,
)
from .torsional import (
    TorsionalExcitation as TorsionalExcitation,
    torsional_excitations as torsional_excitations,
    torsional_margin as torsional_margin,
    torsional_separation as torsional_separation,
)
from .torsional_life import (
    Met as Met,
    torque_at_meeting as torque_at_meeting,
    torsional_life as torsional_life,
)
from .placed import PlacedUnbalance as PlacedUnbalance, placed_response as placed_response
from .sensitivity_zones import (
    PeakSensitivity as PeakSensitivity,
    loop_sensitivity as loop_sensitivity,
    peak_sensitivity as peak_sensitivity,
)
from .separation import (
    SeparationCheck as SeparationCheck,
    actual_margin as actual_margin,
    required_margins as required_margins,
    separation_margins as separation_margins,
)
from .shortfall import Shortfall as Shortfall
from .stability import (
    StabilityChart as StabilityChart,
    anticipated_cross_coupling as anticipated_cross_coupling,
    level_two as level_two,
    rigid_critical_speed as rigid_critical_speed,
    stability_chart as stability_chart,
)
from .unbalance_cases import (
    UnbalanceCase as UnbalanceCase,
    at_clearances as at_clearances,
    probe_limit as probe_limit,
    residual_unbalance_of_api as residual_unbalance_of_api,
    scale_factor as scale_factor,
    unbalance_cases as unbalance_cases,
)
from .unbalance_check import unbalance_response_check as unbalance_response_check
from .vibration_zones import (
    housing_vibration as housing_vibration,
    housing_zone_limits as housing_zone_limits,
    shaft_vibration as shaft_vibration,
    shaft_zone_limits as shaft_zone_limits,
)
