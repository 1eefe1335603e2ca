"""Constants of a synchronous machine, from those that its maker gives."""

import math
from typing import NamedTuple

from ...core.errors import InputError


class Base(NamedTuple):
    """Bases of per unit: peak of the phase voltage (V), impedance (ohm), inductance (H)."""

    voltage: float
    impedance: float
    inductance: float


def base_of(power: float, line_voltage: float, frequency: float) -> Base:
    """From the rated apparent power (V·A), the line's voltage (V rms) and frequency (Hz)."""
    impedance = line_voltage**2 / power
    voltage = line_voltage * math.sqrt(2 / 3)
    return Base(voltage, impedance, impedance / (2 * math.pi * frequency))


def two_windings(name: str, x, leakage, transient, subtransient, times, frequency):
    """Per unit: leakage reactances and resistances of two windings of an axis, the slow one first.

    `times`: the open-circuit ones, s. The classical definitions, in which each winding has its own time: the
    slow one with the fast one open, the fast one with the slow one's resistance none.
    """
    _falling(
        (f"{name}", x), (f"{name}_transient", transient), (f"{name}_subtransient", subtransient)
    )
    _falling((f"{name}_subtransient", subtransient), ("leakage", leakage))
    mutual, turn = x - leakage, 2 * math.pi * frequency
    slow = mutual * (transient - leakage) / (x - transient)
    fast = (transient - leakage) * (subtransient - leakage) / (transient - subtransient)
    resistances = (
        (mutual + slow) / (turn * times[0]),
        (fast + transient - leakage) / (turn * times[1]),
    )
    return (slow, fast), resistances


def one_winding(name: str, x, leakage, subtransient, time, frequency):
    """Per unit: leakage reactance and resistance of the only winding of an axis."""
    _falling((f"{name}", x), (f"{name}_subtransient", subtransient), ("leakage", leakage))
    mutual = x - leakage
    own = mutual * (subtransient - leakage) / (x - subtransient)
    return (own,), ((mutual + own) / (2 * math.pi * frequency * time),)


def _falling(*named: tuple[str, float]) -> None:
    for (large, high), (small, low) in zip(named, named[1:]):
        if not high > low:
            raise InputError(
                f"SynchronousMachine.from_standard: {small} must be below {large}, {high:g}, but is "
                f"{low:g}: give both in parts of the rated impedance"
            )
