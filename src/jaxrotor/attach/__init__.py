"""What acts at stations: supports and loads."""

from .load import Force as Force, Torque as Torque
from .support import LinearSupport as LinearSupport
