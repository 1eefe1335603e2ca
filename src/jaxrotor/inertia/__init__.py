"""What has mass or a motion of its own: the stations of a line."""

from .bearing import SelfAligningBearing as SelfAligningBearing
from .body import RigidBody as RigidBody
from .node import Node as Node
from .prescribed import PrescribedSpin as PrescribedSpin
from .rotor import Imperfection as Imperfection, Rotor as Rotor
from .unbalance import Unbalance as Unbalance
