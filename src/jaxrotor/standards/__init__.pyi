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
