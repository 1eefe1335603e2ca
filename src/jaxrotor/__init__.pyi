"""The public names, by what they are for; src/jaxrotor/__init__.py loads each when it is asked for."""

from . import (
    diagnostics as diagnostics,
    elements as elements,
    identification as identification,
    integrators as integrators,
    interop as interop,
    linear as linear,
    objectives as objectives,
    optimization as optimization,
    periodic as periodic,
    plot as plot,
    profiles as profiles,
    protocols as protocols,
    sensors as sensors,
    simulation as simulation,
    standards as standards,
    sweeps as sweeps,
)

# a machine
from .machine.machine import Machine as Machine

# rotors
from .elements.rotors.rotor import Rotor as Rotor, Imperfection as Imperfection
from .elements.rotors.body import RigidBody as RigidBody
from .elements.rotors.node import Node as Node
from .elements.rotors.added_inertia import AddedInertia as AddedInertia
from .elements.rotors.unbalance import Unbalance as Unbalance

# shafts
from .elements.shafts.section import Shaft as Shaft
from .elements.shafts.finite import FiniteElementShaft as FiniteElementShaft
from .elements.shafts.rigid_pieces import RigidElementShaft as RigidElementShaft
from .elements.shafts.material import Material as Material, STEEL as STEEL

# bearings and supports
from .elements.bearings.self_aligning import SelfAligningBearing as SelfAligningBearing
from .elements.bearings.support import (
    LinearSupport as LinearSupport,
    SpeedDependentSupport as SpeedDependentSupport,
)
from .elements.bearings.law_support import LawSupport as LawSupport
from .elements.bearings.journal import (
    JournalBearing as JournalBearing,
    SqueezeFilmDamper as SqueezeFilmDamper,
)
from .elements.bearings.rolling import RollingBearing as RollingBearing
from .elements.bearings.radial import RadialBearing as RadialBearing
from .elements.bearings.rub import Rub as Rub

# couplings, gears, dampers
from .elements.couplings.coupling import Coupling as Coupling, Misalignment as Misalignment
from .elements.couplings.matrix import (
    ElasticMatrix as ElasticMatrix,
    DampingMatrix as DampingMatrix,
)
from .elements.couplings.joint import UniversalJoint as UniversalJoint
from .elements.couplings.gear import GearMesh as GearMesh
from .elements.couplings.clutch import (
    CoulombClutch as CoulombClutch,
    StickSlipClutch as StickSlipClutch,
)
from .elements.couplings.torsional_damper import TorsionalDamper as TorsionalDamper

# drives and loads
from .elements.drives.prescribed import PrescribedSpin as PrescribedSpin
from .elements.drives.load import (
    Torque as Torque,
    Force as Force,
    SpeedTorque as SpeedTorque,
    FanLoad as FanLoad,
    Brake as Brake,
)
from .elements.drives.motor import KlossMotor as KlossMotor, DCMotor as DCMotor
from .elements.drives.induction import InductionMotor as InductionMotor
from .elements.drives.engine import EngineTorque as EngineTorque
from .elements.drives.governor import SpeedGovernor as SpeedGovernor

# speeds and loads over time
from .profiles.motion import (
    ConstantSpeed as ConstantSpeed,
    CosineRamp as CosineRamp,
    LinearRamp as LinearRamp,
    SpeedTable as SpeedTable,
)
from .profiles.spline import SpeedSpline as SpeedSpline
from .profiles.schedule import (
    Steady as Steady,
    Step as Step,
    Ramp as Ramp,
    Table as Table,
    Harmonic as Harmonic,
    PulseTrain as PulseTrain,
    Impulse as Impulse,
)

# to run it
from .simulation.simulate import simulate as simulate
from .simulation.simulation import Simulation as Simulation
from .simulation.response import Response as Response
from .simulation.state import State as State
from .simulation.equilibrium import static_equilibrium as static_equilibrium
from .simulation.energy import energy_audit as energy_audit
from .simulation.step_choice import plan as plan
from .simulation.planned import Plan as Plan
from .integrators.exponential import ExponentialAdams as ExponentialAdams, ETD4RK as ETD4RK
from .integrators.rosenbrock import Rosenbrock as Rosenbrock

# to linearise it
from .linear.linearise import linearize as linearize
from .linear.modes import modes as modes
from .linear.campbell import campbell as campbell
from .linear.critical import critical_speeds as critical_speeds, critical_modes as critical_modes
from .linear.response import frequency_response as frequency_response
from .linear.orders import (
    unbalance_response as unbalance_response,
    order_response as order_response,
)
from .linear.torsion import torsional_modes as torsional_modes
from .linear.threshold import stability_threshold as stability_threshold

# to meet measured runs
from .identification.identify import identify as identify, Stage as Stage
from .identification.design import experiment_design as experiment_design
from .search.unknown import Unknown as Unknown
from .identification.measured_run import MeasuredRun as MeasuredRun
from .identification.measured_response import MeasuredResponse as MeasuredResponse
from .sensors.channel import Channel as Channel
from .sensors.record import Record as Record
from .sensors.read import read_record as read_record
from .identification.balance import balance as balance

# to design
from .optimization.optimize import optimize as optimize
from .objectives.criterion import Criterion as Criterion, Constraint as Constraint
from .optimization.variations import Variations as Variations

# to run it many times
from .sweeps.sweep import sweep as sweep
from .sweeps.cases import Cases as Cases

# studies
from .study.study import load as load, Study as Study

# elements of your own
from .core.parameter import parameter as parameter
from .core.protocol import (
    AbstractInertia as AbstractInertia,
    AbstractConnector as AbstractConnector,
    AbstractElastic as AbstractElastic,
    AbstractAttachment as AbstractAttachment,
)

# what it runs on
from .core.cache import enable_cache as enable_cache
from .core.quick import jit as jit
from .core.config import show_config as show_config

# errors
from .core.errors import (
    JaxrotorError as JaxrotorError,
    InputError as InputError,
    MissingExtraError as MissingExtraError,
    StoreError as StoreError,
    ConvergenceError as ConvergenceError,
    SimulationFailed as SimulationFailed,
    SimulationInterrupted as SimulationInterrupted,
)

__version__: str
