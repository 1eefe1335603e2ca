from .bearings.annular_seal import AnnularSeal as AnnularSeal, SealPoint as SealPoint
from .bearings.base_motion import BaseMotion as BaseMotion
from .bearings.fixed_pads import FixedPadBearing as FixedPadBearing
from .bearings.foundation import AbstractFoundation as AbstractFoundation
from .bearings.foundation_block import FoundationBlock as FoundationBlock
from .bearings.journal import (
    AbstractFilm as AbstractFilm,
    JournalBearing as JournalBearing,
    SqueezeFilmDamper as SqueezeFilmDamper,
    WorkingPoint as WorkingPoint,
)
from .bearings.labyrinth_seal import (
    LabyrinthPoint as LabyrinthPoint,
    LabyrinthSeal as LabyrinthSeal,
)
from .bearings.law_support import LawSupport as LawSupport
from .bearings.measured_foundation import MeasuredFoundation as MeasuredFoundation
from .bearings.modal_foundation import ModalFoundation as ModalFoundation
from .bearings.moving_base import MovingBase as MovingBase
from .bearings.pad_point import PadPoint as PadPoint
from .bearings.radial import RadialBearing as RadialBearing
from .bearings.rolling import (
    AbstractRaceDefect as AbstractRaceDefect,
    BallDefect as BallDefect,
    InnerRaceDefect as InnerRaceDefect,
    OuterRaceDefect as OuterRaceDefect,
    RollingBearing as RollingBearing,
)
from .bearings.rub import Rub as Rub
from .bearings.self_aligning import SelfAligningBearing as SelfAligningBearing
from .bearings.support import (
    LinearSupport as LinearSupport,
    SpeedDependentSupport as SpeedDependentSupport,
)
from .bearings.tilting_pads import TiltingPadBearing as TiltingPadBearing
from .bearings.whirl_dependent import WhirlDependentSupport as WhirlDependentSupport
from .control.actuator import Actuator as Actuator
from .control.amplifier import CurrentAmplifier as CurrentAmplifier
from .control.controller import (
    PD as PD,
    PI as PI,
    AbstractController as AbstractController,
    Compensator as Compensator,
    PositivePositionFeedback as PositivePositionFeedback,
    ResonantController as ResonantController,
    StateFeedback as StateFeedback,
)
from .control.feedback import (
    AbstractFeedback as AbstractFeedback,
    RelativeStates as RelativeStates,
    SpeedError as SpeedError,
    TwistOf as TwistOf,
)
from .control.inverter import InverterDrive as InverterDrive
from .control.loop import ActiveTorque as ActiveTorque
from .control.magnet import (
    AbstractMagnet as AbstractMagnet,
    Electromagnets as Electromagnets,
    LinearMagnet as LinearMagnet,
)
from .control.magnetic import MagneticBearing as MagneticBearing
from .control.neural import NeuralController as NeuralController
from .control.position import (
    PID as PID,
    AbstractPositionController as AbstractPositionController,
    InSeries as InSeries,
    StateSpace as StateSpace,
    TransferFunction as TransferFunction,
)
from .control.sampled import SampledTorque as SampledTorque
from .control.switched import SwitchedDamper as SwitchedDamper
from .couplings.clutch import CoulombClutch as CoulombClutch, StickSlipClutch as StickSlipClutch
from .couplings.coupling import (
    AbstractCoupling as AbstractCoupling,
    Coupling as Coupling,
    Misalignment as Misalignment,
)
from .couplings.engagement import LoadedMesh as LoadedMesh, MeshStiffness as MeshStiffness
from .couplings.gear import GearMesh as GearMesh
from .couplings.gear_pair import GearPair as GearPair
from .couplings.involute_mesh import InvoluteMesh as InvoluteMesh
from .couplings.iso_stiffness import IsoStiffness as IsoStiffness
from .couplings.joint import UniversalJoint as UniversalJoint
from .couplings.matrix import ElasticMatrix as ElasticMatrix, DampingMatrix as DampingMatrix
from .couplings.planetary import PlanetaryGear as PlanetaryGear
from .couplings.rigid_gears import RigidGears as RigidGears
from .couplings.tooth_mesh import ToothMesh as ToothMesh
from .couplings.torsional_damper import TorsionalDamper as TorsionalDamper
from .drives.engine import EngineTorque as EngineTorque
from .drives.governor import SpeedGovernor as SpeedGovernor
from .drives.induction import InductionMotor as InductionMotor
from .drives.load import (
    Brake as Brake,
    FanLoad as FanLoad,
    Force as Force,
    Moment as Moment,
    SpeedTorque as SpeedTorque,
    Torque as Torque,
)
from .drives.motor import DCMotor as DCMotor, KlossMotor as KlossMotor
from .drives.prescribed import PrescribedSpin as PrescribedSpin
from .drives.ripple import TorqueRipple as TorqueRipple
from .drives.synchronous import SynchronousStart as SynchronousStart
from .drives.synchronous_machine import SynchronousMachine as SynchronousMachine
from .laws.bilinear import Bilinear as Bilinear
from .laws.hysteresis import BoucWen as BoucWen, Maxwell as Maxwell
from .laws.law import (
    AbstractLaw as AbstractLaw,
    Backlash as Backlash,
    KelvinVoigt as KelvinVoigt,
    Parallel as Parallel,
    Progressive as Progressive,
)
from .laws.tabulated import TabulatedLaw as TabulatedLaw
from .rotors.added_inertia import AddedInertia as AddedInertia
from .rotors.point_unbalance import PointUnbalance as PointUnbalance
from .rotors.body import RigidBody as RigidBody
from .rotors.node import Node as Node
from .rotors.rotor import Imperfection as Imperfection, Rotor as Rotor
from .rotors.unbalance import Unbalance as Unbalance
from .shafts.asymmetry import Asymmetry as Asymmetry, keyway as keyway
from .shafts.bow import Bow as Bow, Kink as Kink
from .shafts.crack import (
    AbstractCrack as AbstractCrack,
    Crack as Crack,
    SwitchingCrack as SwitchingCrack,
)
from .shafts.defect import AbstractShaftDefect as AbstractShaftDefect, ShaftDefects as ShaftDefects
from .shafts.finite import FiniteElementShaft as FiniteElementShaft
from .shafts.material import STEEL as STEEL, Material as Material
from .shafts.profile import read_profile as read_profile
from .shafts.profile_line import line_from_profile as line_from_profile
from .shafts.named_material import NamedMaterial as NamedMaterial
from .shafts.rigid_pieces import RigidElementShaft as RigidElementShaft
from .shafts.section import Shaft as Shaft
