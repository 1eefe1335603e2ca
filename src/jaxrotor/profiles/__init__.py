"""Quantities given in time: speeds, torques, schedules."""

from .motion import AbstractMotion, ConstantSpeed, CosineRamp, LinearRamp, SpeedTable
from .schedule import AbstractSchedule, Harmonic, Impulse, PulseTrain, Ramp, Steady, Step, Table
from .spline import SpeedSpline

__all__ = [
    "AbstractMotion",
    "AbstractSchedule",
    "ConstantSpeed",
    "CosineRamp",
    "Harmonic",
    "Impulse",
    "LinearRamp",
    "PulseTrain",
    "Ramp",
    "SpeedSpline",
    "SpeedTable",
    "Steady",
    "Step",
    "Table",
]


def __dir__() -> list[str]:
    return __all__
