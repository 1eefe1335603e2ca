"""Which parts of a machine a figure is about."""

import numpy as np

from ..core.protocol import AbstractInertia, AbstractPrescribed
from ..elements.rotors.body import RigidBody
from ..elements.rotors.rotor import Rotor
from ..machine.machine import Machine
from ..simulation.response import Response


def rotors(machine: Machine) -> list[str]:
    """Names of the rotors, heaviest first; any station with mass where there is none."""
    named = dict(zip(machine.wiring.stations, machine.stations))
    found = [n for n, s in named.items() if isinstance(s, (Rotor, RigidBody))]
    found = found or [n for n, s in named.items() if isinstance(s, AbstractInertia)]
    return sorted(found, key=lambda n: -float(np.asarray(getattr(named[n], "mass", 0.0))))


def drive(machine: Machine) -> str | None:
    """The first driven end."""
    for name, station in zip(machine.wiring.stations, machine.stations):
        if isinstance(station, AbstractPrescribed):
            return name
    return None


def with_signal(machine: Machine, signal: str, kind: type = object) -> list[str]:
    """Names of the elements that offer a signal; of those of one kind."""
    return [
        name
        for name, element in machine.elements().items()
        if isinstance(element, kind) and signal in getattr(element, "signals", {})
    ]


def passage(response: Response, name: str) -> int:
    """The sample of a station's largest radial displacement: its passage through resonance."""
    station = response[name].position
    return int(np.argmax(np.hypot(np.asarray(station[:, 0]), np.asarray(station[:, 1]))))


def smooth(t: np.ndarray, values: np.ndarray, part: slice, finer: int = 8) -> np.ndarray:
    """A part of a sampled path, (n, m), with so many points between samples, by a cubic spline: a turn
    has few samples at high speed, and a polygon is not what the rotor drew."""
    from scipy.interpolate import CubicSpline

    t, values = t[part], values[part]
    if len(t) < 4:
        return values
    return CubicSpline(t, values)(np.linspace(t[0], t[-1], finer * (len(t) - 1) + 1))


def around(response: Response, sample: int, seconds: float) -> slice:
    """The samples within `seconds` of one of them."""
    t = np.asarray(response.t)
    first, last = np.searchsorted(t, [t[sample] - seconds, t[sample] + seconds])
    return slice(int(first), max(int(last), int(first) + 4))
