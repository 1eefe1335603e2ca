"""Instruments and what they record."""

from .channel import Channel
from .noise import Noise
from .pulses import angle_of, pulse_times, speed_of
from .quantities import (
    AngularAcceleration,
    BearingForce,
    DrivePower,
    DriveTorque,
    Radial,
    ShaftStress,
    Signal,
    Twist,
)
from .read import read_record
from .record import Record, Series
from .sensor import AbstractSensor, Accelerometer, Encoder, ProximityProbe, Tachometer, TorqueSensor

__all__ = [
    "AbstractSensor",
    "Accelerometer",
    "AngularAcceleration",
    "BearingForce",
    "Channel",
    "DrivePower",
    "DriveTorque",
    "Encoder",
    "Noise",
    "ProximityProbe",
    "Radial",
    "Record",
    "Series",
    "ShaftStress",
    "Signal",
    "Tachometer",
    "TorqueSensor",
    "Twist",
    "angle_of",
    "pulse_times",
    "read_record",
    "speed_of",
]


def __dir__() -> list[str]:
    return __all__
