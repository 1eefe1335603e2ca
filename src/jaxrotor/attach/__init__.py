"""What acts at stations: supports, loads and motors."""

from .damper import TorsionalDamper as TorsionalDamper
from .engine import EngineTorque as EngineTorque
from .governor import SpeedGovernor as SpeedGovernor
from .induction import InductionMotor as InductionMotor
from .inertia import AddedInertia as AddedInertia
from .laws import LawSupport as LawSupport
from .load import (
    Brake as Brake,
    FanLoad as FanLoad,
    Force as Force,
    SpeedTorque as SpeedTorque,
    Torque as Torque,
)
from .motor import DCMotor as DCMotor, KlossMotor as KlossMotor
from .rub import Rub as Rub
from .support import (
    LinearSupport as LinearSupport,
    SpeedDependentSupport as SpeedDependentSupport,
)
