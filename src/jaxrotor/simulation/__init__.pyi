from .energy import EnergyAudit as EnergyAudit, energy_audit as energy_audit
from .equilibrium import static_equilibrium as static_equilibrium
from .step_choice import plan as plan
from .planned import Plan as Plan
from .response import Response as Response
from .simulate import simulate as simulate
from .simulation import Simulation as Simulation
from .state import State as State
