"""How a machine's axes bend, twist and stretch in a mode: numbers for the figures of mode shapes."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..core.kinematics import COORDINATES
from ..core.protocol import AbstractConnector, AbstractPrescribed, Composite, Geared, Ported
from ..elements.bearings.self_aligning import SelfAligningBearing
from ..elements.rotors.body import RigidBody
from ..elements.rotors.rotor import Rotor
from ..elements.shafts.finite import FiniteElementShaft
from ..elements.shafts.rigid_pieces import RigidElementShaft
from ..elements.shafts.section import Shaft
from ..linear.linearise import LinearModel
from ..linear.observe import at_stations
from ..machine.machine import Machine
from .lanes import positions

# Columns of an axis' amplitudes; of a station's six the same ones.
X, Y, Z, PHI = range(4)
SAME = [COORDINATES.index(name) for name in ("x", "y", "z", "phi")]
_PSI, _THETA = COORDINATES.index("psi"), COORDINATES.index("theta")
# Between the rest lines of lanes, in largest deflections.
PITCH = 2.9
# Points of a curve between two stations.
_POINTS = 25
# Orbits as near to a circle as this part have no direction in which they are largest.
_ROUND = 1e-6
# What is smaller than this part of a mode's largest coordinate is rounding.
_NOTHING = 1e-12


class Axis(NamedTuple):
    """One lane of the machine: places `z` (k,), m; `amplitudes` (k, 4) complex: x, y, z, phi. A row of
    nan parts what no shaft or coupling joins."""

    lane: int
    z: np.ndarray
    amplitudes: np.ndarray


class Places(NamedTuple):
    """Where the stations stand: names, `z` (n,) in m, `lanes` (n,); the numbers of those that are
    `named` by the user, of the `rotors` and of those that are `held` across the axis or `supported`."""

    names: tuple[str, ...]
    z: np.ndarray
    lanes: np.ndarray
    named: list[int]
    rotors: list[int]
    supported: list[int]


def places(machine: Machine) -> Places:
    where = positions(machine)
    names = machine.wiring.stations
    springs = {
        ends[0][0]
        for element, ends in zip(machine.connectors, machine.wiring.ends)
        if not isinstance(element, AbstractConnector)
        and np.ndim(getattr(element, "stiffness", 0.0)) > 0  # of six coordinates: a support's
    }
    own = dict(enumerate(machine.stations))
    bearings = {
        i for i, s in own.items() if isinstance(s, (SelfAligningBearing, AbstractPrescribed))
    }
    held = {h.station for h in machine.wiring.held if h.coordinate in (0, 1)}
    return Places(
        names,
        np.array([where[n][0] for n in names]),
        np.array([where[n][1] for n in names]),
        list(own),
        [i for i, s in own.items() if isinstance(s, (Rotor, RigidBody))],
        sorted(springs | bearings | held),
    )


def station_amplitudes(machine: Machine, model: LinearModel, shape: np.ndarray) -> np.ndarray:
    """(n, 6) complex, in the machine's order of stations; what is held stays at zero."""
    condensation, names = machine.wiring.condensation, machine.wiring.stations
    if condensation is not None and condensation.followers:
        return np.asarray(at_stations(machine, jnp.asarray(shape)))
    out = np.zeros((len(names), 6), complex)
    for (station, coordinate), value in zip(model.coordinates, shape):
        out[names.index(station), COORDINATES.index(coordinate)] = value
    return out


def axes_of(machine: Machine, where: Places, amplitudes: np.ndarray) -> list[Axis]:
    """Smooth curves through the stations' `amplitudes` (n, 6): the beam's cubic along shafts, by their
    ends' displacements and slopes (dx/dz = theta, dy/dz = -psi), straight along all else. Gears join no
    axis to another."""
    pieces: dict[int, list[tuple[int, int, np.ndarray, np.ndarray]]] = {}
    for i, (connector, ends) in enumerate(zip(machine.connectors, machine.wiring.ends)):
        if not isinstance(connector, AbstractConnector) or isinstance(connector, Geared):
            continue
        (a, port_a), (b, port_b) = ends
        line = [(a, 0.0), (a, _reach(machine, a, port_a))]
        if isinstance(connector, Composite):
            line += [(machine.wiring.inner[i] + k, 0.0) for k in range(connector.inner)]
        line += [(b, _reach(machine, b, port_b)), (b, 0.0)]
        curved = isinstance(connector, (Shaft, FiniteElementShaft, RigidElementShaft))
        found = [_between(where, amplitudes, *two, curved) for two in zip(line, line[1:])]
        z, values = (np.concatenate(parts) for parts in zip(*found))
        lane = int(max(where.lanes[a], where.lanes[b]))
        pieces.setdefault(lane, []).append((a, b, z, values))
    return [_joined(lane, parts) for lane, parts in sorted(pieces.items())]


def _reach(machine: Machine, station: int, port: str) -> float:
    """How far along the axis from a station's centre a shaft is fixed, m: by how much theta moves it."""
    element = machine.stations[station]
    if not port or not isinstance(element, Ported):
        return 0.0
    tilt = jnp.zeros(6).at[_THETA].set(1.0)
    moved = jax.jvp(lambda q: element.shift(port, q), (jnp.zeros(6),), (tilt,))[1]
    return 0.0 if moved is None else float(moved[0])


def _between(where: Places, amplitudes, start, end, curved: bool) -> tuple[np.ndarray, np.ndarray]:
    (a, before), (b, after) = start, end
    first, last = where.z[a] + before, where.z[b] + after
    q0, q1 = _moved(amplitudes[a], before), _moved(amplitudes[b], after)
    s = np.linspace(0.0, 1.0, _POINTS if a != b else 2)[:, None]
    values = (1 - s) * q0[SAME] + s * q1[SAME]
    if curved and a != b:
        length = where.z[b] - where.z[a]
        h = 1 - 3 * s**2 + 2 * s**3, s - 2 * s**2 + s**3, 3 * s**2 - 2 * s**3, s**3 - s**2
        for column, tilt, sign in ((X, _THETA, 1), (Y, _PSI, -1)):
            ends = q0[column], sign * length * q0[tilt], q1[column], sign * length * q1[tilt]
            values[:, column] = sum(part[:, 0] * value for part, value in zip(h, ends))
    return first + s[:, 0] * (last - first), values


def _moved(q: np.ndarray, along: float) -> np.ndarray:
    """A rigid station's amplitudes at a point so far along its axis."""
    out = q.copy()
    out[0] += along * q[_THETA]
    out[1] -= along * q[_PSI]
    return out


def _joined(lane: int, parts: list) -> Axis:
    z, values, last = [], [], None
    for a, b, along, amplitudes in sorted(parts, key=lambda p: min(p[2][0], p[2][-1])):
        if last is not None and last != a:
            z.append([np.nan])
            values.append(np.full((1, 4), np.nan, complex))
        z.append(along)
        values.append(amplitudes)
        last = b
    return Axis(lane, np.concatenate(z), np.concatenate(values))


def links(machine: Machine, where: Places) -> list[tuple[list[float], list[int]]]:
    """What joins axes at rest, as two places and their lanes: gears, and where a branch leaves."""
    found = []
    for connector, ends in zip(machine.connectors, machine.wiring.ends):
        if isinstance(connector, AbstractConnector):
            a, b = sorted((s for s, _ in ends), key=lambda s: where.lanes[s])
            lanes = [int(where.lanes[a]), int(where.lanes[b])]
            if isinstance(connector, Geared):
                found.append(([where.z[a], where.z[b]], lanes))
            elif lanes[0] != lanes[1]:
                found.append(([where.z[a], where.z[a]], lanes))
    return found


def scale(values: np.ndarray) -> float:
    """The largest of `values`; 1 where nothing but rounding is left (a station that only tilts)."""
    found = float(np.max(values, initial=0.0))
    return found if found > _NOTHING else 1.0


def major(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Major semi-axes of the orbits Re(x e^iwt), Re(y e^iwt)."""
    size, straight = np.abs(x) ** 2 + np.abs(y) ** 2, np.abs(x**2 + y**2)
    return np.sqrt((size + straight) / 2)


def turning(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """1 for a circle run through from x to y, -1 from y to x, 0 for a straight line (or a point)."""
    size = np.abs(x) ** 2 + np.abs(y) ** 2
    return -2 * np.imag(np.conj(x) * y) / np.where(size > 0, size, 1.0)


def largest(values: np.ndarray) -> complex:
    """The factor e^(-i a) that makes the largest of `values` real and positive."""
    value = values[np.argmax(np.abs(values))]
    return np.conj(value) / abs(value) if value else 1.0 + 0j


def instant(x: np.ndarray, y: np.ndarray) -> complex:
    """The factor e^(i w t) of the instant at which the largest orbit is at the end of its long axis; at
    the end of x where it is a circle."""
    k = int(np.argmax(major(x, y)))
    square = x[k] ** 2 + y[k] ** 2
    if abs(square) <= _ROUND * (abs(x[k]) ** 2 + abs(y[k]) ** 2):
        return largest(x[k : k + 1])
    factor = np.sqrt(np.conj(square) / abs(square))
    lead = (x[k] if abs(x[k]) > abs(y[k]) else y[k]) * factor
    return factor if lead.real >= 0 else -factor
