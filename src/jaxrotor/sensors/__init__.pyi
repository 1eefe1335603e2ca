from .channel import AbstractChannel as AbstractChannel, Channel as Channel
from .noise import Noise as Noise
from .pulses import angle_of as angle_of, pulse_times as pulse_times, speed_of as speed_of
from .quantities import (
    AngularAcceleration as AngularAcceleration,
    BearingForce as BearingForce,
    DrivePower as DrivePower,
    DriveTorque as DriveTorque,
    Radial as Radial,
    ShaftStress as ShaftStress,
    Signal as Signal,
    Twist as Twist,
)
from .read import read_record as read_record
from .record import Record as Record, Series as Series
from .sensor import (
    AbstractSensor as AbstractSensor,
    Accelerometer as Accelerometer,
    Encoder as Encoder,
    ProximityProbe as ProximityProbe,
    Synchronous as Synchronous,
    Tachometer as Tachometer,
    TorqueSensor as TorqueSensor,
)
from .tracking_filter import TrackingFilter as TrackingFilter
