from . import (
    diagnostics as diagnostics,
    elements as elements,
    identification as identification,
    integrators as integrators,
    interop as interop,
    linear as linear,
    objectives as objectives,
    optimization as optimization,
    plot as plot,
    profiles as profiles,
    protocols as protocols,
    sensors as sensors,
    simulation as simulation,
    sweeps as sweeps,
)

# errors
from .core.errors import (
    ConvergenceError as ConvergenceError,
    InputError as InputError,
    JaxrotorError as JaxrotorError,
    MissingExtraError as MissingExtraError,
    SimulationFailed as SimulationFailed,
    SimulationInterrupted as SimulationInterrupted,
    StoreError as StoreError,
)

# elements of your own
from .core.parameter import parameter as parameter
from .core.protocol import (
    AbstractAttachment as AbstractAttachment,
    AbstractConnector as AbstractConnector,
    AbstractElastic as AbstractElastic,
    AbstractInertia as AbstractInertia,
)
from .elements.bearings.journal import (
    JournalBearing as JournalBearing,
    SqueezeFilmDamper as SqueezeFilmDamper,
)
from .elements.bearings.law_support import LawSupport as LawSupport
from .elements.bearings.radial import RadialBearing as RadialBearing
from .elements.bearings.rolling import RollingBearing as RollingBearing
from .elements.bearings.rub import Rub as Rub

# bearings and supports
from .elements.bearings.self_aligning import SelfAligningBearing as SelfAligningBearing
from .elements.bearings.support import (
    LinearSupport as LinearSupport,
    SpeedDependentSupport as SpeedDependentSupport,
)
from .elements.couplings.clutch import (
    CoulombClutch as CoulombClutch,
    StickSlipClutch as StickSlipClutch,
)

# couplings, gears, dampers
from .elements.couplings.coupling import Coupling as Coupling, Misalignment as Misalignment
from .elements.couplings.gear import GearMesh as GearMesh
from .elements.couplings.joint import UniversalJoint as UniversalJoint
from .elements.couplings.matrix import ElasticMatrix as ElasticMatrix
from .elements.couplings.torsional_damper import TorsionalDamper as TorsionalDamper
from .elements.drives.engine import EngineTorque as EngineTorque
from .elements.drives.governor import SpeedGovernor as SpeedGovernor
from .elements.drives.induction import InductionMotor as InductionMotor
from .elements.drives.load import (
    Brake as Brake,
    FanLoad as FanLoad,
    Force as Force,
    SpeedTorque as SpeedTorque,
    Torque as Torque,
)
from .elements.drives.motor import DCMotor as DCMotor, KlossMotor as KlossMotor

# drives and loads
from .elements.drives.prescribed import PrescribedSpin as PrescribedSpin
from .elements.rotors.added_inertia import AddedInertia as AddedInertia
from .elements.rotors.body import RigidBody as RigidBody

# rotors
from .elements.rotors.rotor import Imperfection as Imperfection, Rotor as Rotor
from .elements.rotors.unbalance import Unbalance as Unbalance
from .elements.shafts.finite import FiniteElementShaft as FiniteElementShaft
from .elements.shafts.material import STEEL as STEEL, Material as Material
from .elements.shafts.rigid_pieces import RigidElementShaft as RigidElementShaft

# shafts
from .elements.shafts.section import Shaft as Shaft
from .identification.balance import balance as balance

# to meet measured runs
from .identification.identify import Stage as Stage, identify as identify
from .identification.measured_run import MeasuredRun as MeasuredRun
from .integrators.exponential import ETD4RK as ETD4RK, ExponentialAdams as ExponentialAdams
from .integrators.rosenbrock import Rosenbrock as Rosenbrock
from .linear.campbell import campbell as campbell
from .linear.critical import critical_modes as critical_modes, critical_speeds as critical_speeds

# to linearise it
from .linear.linearise import linearize as linearize
from .linear.modes import modes as modes
from .linear.orders import (
    order_response as order_response,
    unbalance_response as unbalance_response,
)
from .linear.response import frequency_response as frequency_response
from .linear.threshold import stability_threshold as stability_threshold
from .linear.torsion import torsional_modes as torsional_modes

# a machine
from .machine.machine import Machine as Machine
from .objectives.criterion import Constraint as Constraint, Criterion as Criterion

# to design
from .optimization.optimize import optimize as optimize
from .optimization.variations import Variations as Variations

# speeds and loads over time
from .profiles.motion import (
    ConstantSpeed as ConstantSpeed,
    CosineRamp as CosineRamp,
    LinearRamp as LinearRamp,
    SpeedTable as SpeedTable,
)
from .profiles.schedule import (
    Harmonic as Harmonic,
    Impulse as Impulse,
    PulseTrain as PulseTrain,
    Ramp as Ramp,
    Steady as Steady,
    Step as Step,
    Table as Table,
)
from .profiles.spline import SpeedSpline as SpeedSpline
from .search.unknown import Unknown as Unknown
from .sensors.channel import Channel as Channel
from .sensors.read import read_record as read_record
from .sensors.record import Record as Record
from .simulation.energy import energy_audit as energy_audit
from .simulation.equilibrium import static_equilibrium as static_equilibrium
from .simulation.plan import Plan as Plan, plan as plan
from .simulation.response import Response as Response

# to run it
from .simulation.simulate import simulate as simulate
from .simulation.state import State as State

# studies
from .study.study import Study as Study, load as load
from .sweeps.cases import Cases as Cases

# to run it many times
from .sweeps.sweep import sweep as sweep

__version__: str
