"""jaxrotor: differentiable transient dynamics of rotating machines."""

from . import interrupt as _interrupt

if _interrupt.is_command_line():
    _interrupt.leave_at_once()

from .attach import (
    AddedInertia as AddedInertia,
    Brake as Brake,
    DCMotor as DCMotor,
    EngineTorque as EngineTorque,
    FanLoad as FanLoad,
    Force as Force,
    InductionMotor as InductionMotor,
    KlossMotor as KlossMotor,
    LawSupport as LawSupport,
    LinearSupport as LinearSupport,
    Rub as Rub,
    SpeedDependentSupport as SpeedDependentSupport,
    SpeedGovernor as SpeedGovernor,
    SpeedTorque as SpeedTorque,
    Torque as Torque,
    TorsionalDamper as TorsionalDamper,
)
from .bearing.journal import (
    AbstractFilm as AbstractFilm,
    JournalBearing as JournalBearing,
    SqueezeFilmDamper as SqueezeFilmDamper,
    WorkingPoint as WorkingPoint,
)
from .bearing.rolling import (
    AbstractRaceDefect as AbstractRaceDefect,
    BallDefect as BallDefect,
    InnerRaceDefect as InnerRaceDefect,
    OuterRaceDefect as OuterRaceDefect,
    RollingBearing as RollingBearing,
)
from .bearing.table import RadialBearing as RadialBearing
from .control import (
    PD as PD,
    PI as PI,
    AbstractController as AbstractController,
    AbstractMeasured as AbstractMeasured,
    ActiveTorque as ActiveTorque,
    Actuator as Actuator,
    Compensator as Compensator,
    NeuralController as NeuralController,
    PositivePositionFeedback as PositivePositionFeedback,
    RelativeStates as RelativeStates,
    ResonantController as ResonantController,
    SampledTorque as SampledTorque,
    SpeedError as SpeedError,
    StateFeedback as StateFeedback,
    SwitchedDamper as SwitchedDamper,
    TwistOf as TwistOf,
)
from .design.criterion import Constraint as Constraint, Criterion as Criterion
from .design.experiment import AsBuilt as AsBuilt, Transient as Transient
from .design.fatigue import FatigueDamage as FatigueDamage
from .design.integral import Integral as Integral
from .design.level import Percentile as Percentile, RootMeanSquare as RootMeanSquare
from .design.machine_measures import (
    AbstractMachineMeasure as AbstractMachineMeasure,
    DecayRate as DecayRate,
    H2Norm as H2Norm,
    PoleMean as PoleMean,
    PoleSpread as PoleSpread,
    ResponsePeaks as ResponsePeaks,
    TotalMass as TotalMass,
    UnbalancePeak as UnbalancePeak,
)
from .design.mass import polar_inertia as polar_inertia, total_mass as total_mass
from .design.measure import AbstractMeasure as AbstractMeasure
from .design.optimize import optimize as optimize
from .design.optimum import Optimum as Optimum
from .design.peak import PassageAmplitude as PassageAmplitude, PeakValue as PeakValue
from .design.settling import SettlingTime as SettlingTime
from .design.variations import Variations as Variations
from .diagnose import (
    Bifurcation as Bifurcation,
    Centreline as Centreline,
    Ellipse as Ellipse,
    FullSpectrum as FullSpectrum,
    OnceATurn as OnceATurn,
    Orbit as Orbit,
    OrderTrack as OrderTrack,
    PoincareSection as PoincareSection,
    Waterfall as Waterfall,
    bifurcation as bifurcation,
    filtered_orbit as filtered_orbit,
    full_spectrum as full_spectrum,
    orbit as orbit,
    order_tracking as order_tracking,
    poincare as poincare,
    shaft_centreline as shaft_centreline,
    turn_instants as turn_instants,
    waterfall as waterfall,
)
from .drive import (
    AbstractMotion as AbstractMotion,
    AbstractSchedule as AbstractSchedule,
    ConstantSpeed as ConstantSpeed,
    CosineRamp as CosineRamp,
    Harmonic as Harmonic,
    Impulse as Impulse,
    LinearRamp as LinearRamp,
    PulseTrain as PulseTrain,
    Ramp as Ramp,
    SpeedSpline as SpeedSpline,
    SpeedTable as SpeedTable,
    Steady as Steady,
    Step as Step,
    Table as Table,
)
from .elastic import (
    STEEL as STEEL,
    AbstractCoupling as AbstractCoupling,
    AbstractCrack as AbstractCrack,
    AbstractFlaw as AbstractFlaw,
    AbstractLaw as AbstractLaw,
    Asymmetry as Asymmetry,
    Backlash as Backlash,
    Bilinear as Bilinear,
    BoucWen as BoucWen,
    Bow as Bow,
    CoulombClutch as CoulombClutch,
    Coupling as Coupling,
    Crack as Crack,
    ElasticMatrix as ElasticMatrix,
    FiniteElementShaft as FiniteElementShaft,
    Flaws as Flaws,
    GearMesh as GearMesh,
    KelvinVoigt as KelvinVoigt,
    Kink as Kink,
    Material as Material,
    Maxwell as Maxwell,
    Misalignment as Misalignment,
    Parallel as Parallel,
    Progressive as Progressive,
    RigidElementShaft as RigidElementShaft,
    Shaft as Shaft,
    StickSlipClutch as StickSlipClutch,
    SwitchingCrack as SwitchingCrack,
    TabulatedLaw as TabulatedLaw,
    UniversalJoint as UniversalJoint,
    keyway as keyway,
)
from .errors import (
    InputError as InputError,
    SimulationFailed as SimulationFailed,
    SimulationInterrupted as SimulationInterrupted,
)
from .inertia import (
    Imperfection as Imperfection,
    Node as Node,
    PrescribedSpin as PrescribedSpin,
    RigidBody as RigidBody,
    Rotor as Rotor,
    SelfAligningBearing as SelfAligningBearing,
    Unbalance as Unbalance,
)
from .inverse.balance import (
    Balance as Balance,
    Correction as Correction,
    balance as balance,
    correction as correction,
    influence_coefficients as influence_coefficients,
    modal_balance as modal_balance,
    phasor as phasor,
)
from .inverse.bootstrap import Replicas as Replicas, bootstrap as bootstrap
from .inverse.domain import (
    AbstractDomain as AbstractDomain,
    Frequencies as Frequencies,
    Orders as Orders,
    Time as Time,
)
from .inverse.identification import Identification as Identification
from .inverse.identify import Stage as Stage, identify as identify
from .inverse.posterior import Posterior as Posterior, posterior as posterior
from .inverse.profile import Profile as Profile, profiles as profiles
from .inverse.trial import Trial as Trial
from .inverse.unknown import Unknown as Unknown
from .linear import (
    Campbell as Campbell,
    Cluster as Cluster,
    CriticalSpeedMap as CriticalSpeedMap,
    FrequencyResponse as FrequencyResponse,
    Interference as Interference,
    LinearModel as LinearModel,
    Mode as Mode,
    OrderResponse as OrderResponse,
    Peak as Peak,
    Peaks as Peaks,
    Regulator as Regulator,
    TorsionalMode as TorsionalMode,
    campbell as campbell,
    closed_loop_cost as closed_loop_cost,
    critical_modes as critical_modes,
    critical_speed_map as critical_speed_map,
    critical_speeds as critical_speeds,
    decay_rate as decay_rate,
    frequency_response as frequency_response,
    h2_norm as h2_norm,
    h_infinity_norm as h_infinity_norm,
    holzer_table as holzer_table,
    interferences as interferences,
    linearize as linearize,
    lqg as lqg,
    lqr as lqr,
    lyapunov as lyapunov,
    modes as modes,
    order_response as order_response,
    pole_cluster as pole_cluster,
    response_peaks as response_peaks,
    riccati as riccati,
    split_derivatives as split_derivatives,
    stability_threshold as stability_threshold,
    torsional as torsional,
    torsional_modes as torsional_modes,
    unbalance_peak as unbalance_peak,
    unbalance_response as unbalance_response,
)
from .machine import Machine as Machine
from .measure.channel import Channel as Channel
from .measure.energy import EnergyAudit as EnergyAudit, energy_audit as energy_audit
from .measure.noise import Noise as Noise
from .measure.pulses import angle_of as angle_of, pulse_times as pulse_times, speed_of as speed_of
from .measure.quantities import (
    AngularAcceleration as AngularAcceleration,
    BearingForce as BearingForce,
    DrivePower as DrivePower,
    DriveTorque as DriveTorque,
    Radial as Radial,
    ShaftStress as ShaftStress,
    Signal as Signal,
    Twist as Twist,
)
from .measure.read import read_record as read_record
from .measure.record import Record as Record, Series as Series
from .measure.sensor import (
    AbstractSensor as AbstractSensor,
    Accelerometer as Accelerometer,
    Encoder as Encoder,
    ProximityProbe as ProximityProbe,
    Tachometer as Tachometer,
    TorqueSensor as TorqueSensor,
)
from .parameter import parameter as parameter
from .protocol import (
    AbstractAttachment as AbstractAttachment,
    AbstractConnector as AbstractConnector,
    AbstractElastic as AbstractElastic,
    AbstractInertia as AbstractInertia,
    AbstractPrescribed as AbstractPrescribed,
    Carried as Carried,
    Composite as Composite,
    Ended as Ended,
    Energetic as Energetic,
    Geared as Geared,
    Linear as Linear,
    Massive as Massive,
    Nominal as Nominal,
    NonSmooth as NonSmooth,
    Parts as Parts,
    Ported as Ported,
    Powered as Powered,
    Sampled as Sampled,
    Signalling as Signalling,
    Stateful as Stateful,
    Tabulated as Tabulated,
    Timed as Timed,
)
from .solve.equilibrium import static_equilibrium as static_equilibrium
from .solve.exponential import ETD4RK as ETD4RK, ExponentialAdams as ExponentialAdams
from .solve.plan import Plan as Plan, plan as plan
from .solve.response import Response as Response
from .solve.rosenbrock import Rosenbrock as Rosenbrock
from .solve.simulate import simulate as simulate
from .solve.state import State as State
from .study import Study as Study, load as load
from .sweep.cases import Cases as Cases
from .sweep.outputs import OverSpeed as OverSpeed, TimeSeries as TimeSeries
from .sweep.sensitivity import local_slopes as local_slopes, sobol_indices as sobol_indices
from .sweep.sweep import sweep as sweep
