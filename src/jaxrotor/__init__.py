"""jaxrotor: differentiable transient dynamics of rotating machines."""

from .attach import Force as Force, LinearSupport as LinearSupport, Torque as Torque
from .drive import (
    AbstractMotion as AbstractMotion,
    AbstractSchedule as AbstractSchedule,
    ConstantSpeed as ConstantSpeed,
    CosineRamp as CosineRamp,
    LinearRamp as LinearRamp,
    SpeedTable as SpeedTable,
    Steady as Steady,
    Step as Step,
)
from .elastic import (
    STEEL as STEEL,
    ElasticMatrix as ElasticMatrix,
    Material as Material,
    Shaft as Shaft,
)
from .errors import InputError as InputError, SimulationFailed as SimulationFailed
from .inertia import (
    Imperfection as Imperfection,
    PrescribedSpin as PrescribedSpin,
    RigidBody as RigidBody,
    Rotor as Rotor,
    SelfAligningBearing as SelfAligningBearing,
    Unbalance as Unbalance,
)
from .machine import Machine as Machine
from .measure.energy import EnergyAudit as EnergyAudit, energy_audit as energy_audit
from .parameter import parameter as parameter
from .protocol import (
    AbstractAttachment as AbstractAttachment,
    AbstractElastic as AbstractElastic,
    AbstractInertia as AbstractInertia,
    AbstractPrescribed as AbstractPrescribed,
    Energetic as Energetic,
    Linear as Linear,
    Signalling as Signalling,
    Stateful as Stateful,
    Timed as Timed,
)
from .solve.equilibrium import static_equilibrium as static_equilibrium
from .solve.exponential import ETD4RK as ETD4RK, ExponentialAdams as ExponentialAdams
from .solve.plan import Plan as Plan, plan as plan
from .solve.response import Response as Response
from .solve.simulate import simulate as simulate
from .solve.state import State as State
from .study import Study as Study, load as load
