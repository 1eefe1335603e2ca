"""Profiles in time: given motions, and schedules of torque and force."""

from .motion import (
    AbstractMotion as AbstractMotion,
    ConstantSpeed as ConstantSpeed,
    CosineRamp as CosineRamp,
    LinearRamp as LinearRamp,
    SpeedTable as SpeedTable,
)
from .schedule import AbstractSchedule as AbstractSchedule, Steady as Steady, Step as Step
