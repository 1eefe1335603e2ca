from .energy import EnergyAudit as EnergyAudit, energy_audit as energy_audit
from .equilibrium import static_equilibrium as static_equilibrium
from .plan import Plan as Plan, plan as plan
from .response import Response as Response
from .simulate import simulate as simulate
from .state import State as State
