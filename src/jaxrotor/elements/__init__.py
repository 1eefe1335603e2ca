"""Everything that a machine can be made of."""

from .bearings.journal import AbstractFilm, JournalBearing, SqueezeFilmDamper, WorkingPoint
from .bearings.law_support import LawSupport
from .bearings.radial import RadialBearing
from .bearings.rolling import (
    AbstractRaceDefect,
    BallDefect,
    InnerRaceDefect,
    OuterRaceDefect,
    RollingBearing,
)
from .bearings.rub import Rub
from .bearings.self_aligning import SelfAligningBearing
from .bearings.support import LinearSupport, SpeedDependentSupport
from .control.actuator import Actuator
from .control.controller import (
    PD,
    PI,
    AbstractController,
    Compensator,
    PositivePositionFeedback,
    ResonantController,
    StateFeedback,
)
from .control.feedback import AbstractFeedback, RelativeStates, SpeedError, TwistOf
from .control.loop import ActiveTorque
from .control.neural import NeuralController
from .control.sampled import SampledTorque
from .control.switched import SwitchedDamper
from .couplings.clutch import CoulombClutch, StickSlipClutch
from .couplings.coupling import AbstractCoupling, Coupling, Misalignment
from .couplings.gear import GearMesh
from .couplings.joint import UniversalJoint
from .couplings.matrix import ElasticMatrix
from .couplings.torsional_damper import TorsionalDamper
from .drives.engine import EngineTorque
from .drives.governor import SpeedGovernor
from .drives.induction import InductionMotor
from .drives.load import Brake, FanLoad, Force, SpeedTorque, Torque
from .drives.motor import DCMotor, KlossMotor
from .drives.prescribed import PrescribedSpin
from .laws.bilinear import Bilinear
from .laws.hysteresis import BoucWen, Maxwell
from .laws.law import AbstractLaw, Backlash, KelvinVoigt, Parallel, Progressive
from .laws.tabulated import TabulatedLaw
from .rotors.added_inertia import AddedInertia
from .rotors.body import RigidBody
from .rotors.node import Node
from .rotors.rotor import Imperfection, Rotor
from .rotors.unbalance import Unbalance
from .shafts.asymmetry import Asymmetry, keyway
from .shafts.bow import Bow, Kink
from .shafts.crack import AbstractCrack, Crack, SwitchingCrack
from .shafts.defect import AbstractShaftDefect, ShaftDefects
from .shafts.finite import FiniteElementShaft
from .shafts.material import STEEL, Material
from .shafts.rigid_pieces import RigidElementShaft
from .shafts.section import Shaft

__all__ = [
    "AbstractController",
    "AbstractCoupling",
    "AbstractCrack",
    "AbstractFilm",
    "AbstractShaftDefect",
    "AbstractLaw",
    "AbstractFeedback",
    "AbstractRaceDefect",
    "ActiveTorque",
    "Actuator",
    "AddedInertia",
    "Asymmetry",
    "Backlash",
    "BallDefect",
    "Bilinear",
    "BoucWen",
    "Bow",
    "Brake",
    "Compensator",
    "CoulombClutch",
    "Coupling",
    "Crack",
    "DCMotor",
    "ElasticMatrix",
    "EngineTorque",
    "FanLoad",
    "FiniteElementShaft",
    "ShaftDefects",
    "Force",
    "GearMesh",
    "Imperfection",
    "InductionMotor",
    "InnerRaceDefect",
    "JournalBearing",
    "KelvinVoigt",
    "Kink",
    "KlossMotor",
    "LawSupport",
    "LinearSupport",
    "Material",
    "Maxwell",
    "Misalignment",
    "NeuralController",
    "Node",
    "OuterRaceDefect",
    "PD",
    "PI",
    "Parallel",
    "PositivePositionFeedback",
    "PrescribedSpin",
    "Progressive",
    "RadialBearing",
    "RelativeStates",
    "ResonantController",
    "RigidBody",
    "RigidElementShaft",
    "RollingBearing",
    "Rotor",
    "Rub",
    "STEEL",
    "SampledTorque",
    "SelfAligningBearing",
    "Shaft",
    "SpeedDependentSupport",
    "SpeedError",
    "SpeedGovernor",
    "SpeedTorque",
    "SqueezeFilmDamper",
    "StateFeedback",
    "StickSlipClutch",
    "SwitchedDamper",
    "SwitchingCrack",
    "TabulatedLaw",
    "Torque",
    "TorsionalDamper",
    "TwistOf",
    "Unbalance",
    "UniversalJoint",
    "WorkingPoint",
    "keyway",
]


def __dir__() -> list[str]:
    return __all__
