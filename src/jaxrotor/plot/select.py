"""Which parts of a machine a figure is about."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Array

from ..core.errors import InputError
from ..core.protocol import AbstractInertia, AbstractPrescribed
from ..core.quick import lightly_compiled
from ..elements.bearings.annular_seal import AnnularSeal
from ..elements.bearings.foundation import AbstractFoundation
from ..elements.bearings.journal import AbstractFilm
from ..elements.bearings.labyrinth_seal import LabyrinthSeal
from ..elements.bearings.law_support import LawSupport
from ..elements.bearings.measured_foundation import MeasuredFoundation
from ..elements.bearings.pad_bearing import AbstractPadBearing
from ..elements.bearings.radial import RadialBearing
from ..elements.bearings.rolling import RollingBearing
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..elements.rotors.body import RigidBody
from ..elements.rotors.rotor import Rotor
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from ..machine.system import assemble
from ..simulation.response import Response

# Rotors that a figure shows where none is named.
_MOST = 3


def rotors(machine: Machine) -> list[str]:
    """Names of the rotors, heaviest first; any station with mass where there is none."""
    named = dict(zip(machine.wiring.stations, machine.stations))
    found = [n for n, s in named.items() if isinstance(s, (Rotor, RigidBody))]
    found = found or [n for n, s in named.items() if isinstance(s, AbstractInertia)]
    return sorted(found, key=lambda n: -float(np.asarray(getattr(named[n], "mass", 0.0))))


def named(given: str | Sequence[str] | None, usual: list[str], what: str) -> list[str]:
    """The names given, or the usual ones. Raises `InputError` where there are none."""
    names = usual if given is None else [given] if isinstance(given, str) else list(given)
    if not names:
        raise InputError(f"{what}: this machine has none to show: name some")
    return names


def swaying(machine: Machine) -> list[str]:
    """Rotors that can move across the axis, the three heaviest."""
    return [name for name in rotors(machine) if machine.sways(name)][:_MOST]


def turns(machine: Machine, over: str) -> dict[str, float]:
    """How many times as fast as one station each one turns, where gears make them differ."""
    every = np.asarray(_turns(machine))
    names = structure_of(machine).wiring.stations
    return dict(zip(names, (every / every[names.index(over)]).tolist()))


@lightly_compiled
def _turns(machine: Machine) -> Array:
    return assemble(machine).turns()


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


# Attachments that carry a rotor against the ground.
_SUPPORTS = (
    AbstractFilm,
    AbstractFoundation,
    AnnularSeal,
    LabyrinthSeal,
    AbstractPadBearing,
    LawSupport,
    LinearSupport,
    MeasuredFoundation,
    RadialBearing,
    RollingBearing,
    SpeedDependentSupport,
)


def bearings(machine: Machine) -> list[str]:
    """Stations that bear the line, and supports."""
    found = with_signal(machine, "bearing_force")
    return found + [n for n, e in machine.elements().items() if isinstance(e, _SUPPORTS)]


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
