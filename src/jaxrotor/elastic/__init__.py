"""What joins two stations."""

from .asymmetry import Asymmetry as Asymmetry, keyway as keyway
from .bilinear import Bilinear as Bilinear
from .bow import Bow as Bow, Kink as Kink
from .clutch import CoulombClutch as CoulombClutch, StickSlipClutch as StickSlipClutch
from .coupling import (
    AbstractCoupling as AbstractCoupling,
    Coupling as Coupling,
    Misalignment as Misalignment,
)
from .crack import (
    AbstractCrack as AbstractCrack,
    Crack as Crack,
    SwitchingCrack as SwitchingCrack,
)
from .finite import FiniteElementShaft as FiniteElementShaft
from .flaw import AbstractFlaw as AbstractFlaw, Flaws as Flaws
from .gear import GearMesh as GearMesh
from .hysteresis import BoucWen as BoucWen, Maxwell as Maxwell
from .joint import UniversalJoint as UniversalJoint
from .law import (
    AbstractLaw as AbstractLaw,
    Backlash as Backlash,
    KelvinVoigt as KelvinVoigt,
    Parallel as Parallel,
    Progressive as Progressive,
)
from .material import STEEL as STEEL, Material as Material
from .matrix import ElasticMatrix as ElasticMatrix
from .pieces import RigidElementShaft as RigidElementShaft
from .shaft import Shaft as Shaft
from .table import TabulatedLaw as TabulatedLaw
