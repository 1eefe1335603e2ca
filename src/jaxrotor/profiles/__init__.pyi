from .motion import (
    AbstractMotion as AbstractMotion,
    ConstantSpeed as ConstantSpeed,
    CosineRamp as CosineRamp,
    LinearRamp as LinearRamp,
    SpeedTable as SpeedTable,
)
from .ground import AccelerationRecord as AccelerationRecord, HarmonicMotion as HarmonicMotion
from .schedule import (
    AbstractSchedule as AbstractSchedule,
    Harmonic as Harmonic,
    Impulse as Impulse,
    PulseTrain as PulseTrain,
    Ramp as Ramp,
    Steady as Steady,
    Step as Step,
    Table as Table,
)
from .short_circuit import (
    Reclosing as Reclosing,
    ShortCircuit as ShortCircuit,
    short_circuit_amplitude as short_circuit_amplitude,
)
from .spline import SpeedSpline as SpeedSpline
