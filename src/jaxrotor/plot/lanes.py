"""Where a machine's parts stand on a drawing: stations along the axis, branches and geared shafts in lanes
beside their line, words in rows so that none hides another."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..core.protocol import AbstractConnector, AbstractPrescribed, Composite, Epicyclic, Geared
from ..elements.bearings.self_aligning import SelfAligningBearing
from ..elements.rotors.body import RigidBody
from ..elements.rotors.rotor import Rotor
from ..machine.machine import Machine
from .labels import rows

# Length given to a connection that has none, as part of the mean of those that have; the free part of it.
_SCHEMATIC, _FREE = 1.0, 0.35
# Points: width of a letter of so many points, height of a row of names and of smaller words.
LETTER, NAME_ROW, ROW = 0.66, 13.0, 11.0
NAME, SMALL = 10.0, 8.0
_GAP = 8.0
MOST_ROWS = 4
_INSIDE = 0.94  # of the figure's width, between its margins
# Inches: width of a drawing, and its greatest height.
_WIDE, _HIGH = 10.0, 8.5


def positions(machine: Machine) -> dict[str, tuple[float, int]]:
    """station -> (z in m, lane): along the line from the first station; each branch gets a lane, and so does
    what gears drive, beside its driver. Stations inside a composite stand where its pieces meet."""
    own = machine.wiring.stations[: len(machine.stations)]
    halves = dict(zip(own, map(half_width, machine.stations)))
    joined: dict[str, list[tuple[str, float, int]]] = {s: [] for s in own}
    lengths = [_length(c) for c in machine.connectors]
    given = [x for x in lengths if x is not None]
    usual = _SCHEMATIC * float(np.mean(given)) if given else 0.1
    for connector, ends, length in zip(machine.connectors, machine.wiring.ends, lengths):
        if isinstance(connector, AbstractConnector):
            (a, _), (b, _) = ends
            names = machine.wiring.stations[a], machine.wiring.stations[b]
            geared = isinstance(connector, Geared)
            if length is None:
                # what has no length of its own keeps its neighbours apart
                both = halves[names[0]] + halves[names[1]]
                length = 0.0 if geared else max(usual, (1 + _FREE) * both)
            joined[names[0]].append((names[1], length, 0 if geared else 1))
            joined[names[1]].append((names[0], length, 0 if geared else -1))
        elif isinstance(connector, Epicyclic):
            (first, _), *others = ends
            for other, _ in others:
                joined[own[first]].append((own[other], 0.0, 0))
                joined[own[other]].append((own[first], 0.0, 0))
    placed: dict[str, tuple[float, int]] = {}
    taken: dict[str, set[int]] = {s: set() for s in own}
    lanes = 0
    for first in own:
        if first in placed:
            continue
        placed[first] = (0.0, lanes)
        queue = deque([first])
        while queue:
            here = queue.popleft()
            z, lane = placed[here]
            taken[here] |= {s for n, _, s in joined[here] if n in placed}
            for name, length, sense in joined[here]:
                if name in placed:
                    continue
                beside = sense == 0 or sense in taken[here]
                lanes += beside
                taken[here].add(sense)
                placed[name] = (z + sense * length, lanes if beside else lane)
                queue.append(name)
        lanes += 1
    for i, (connector, ends) in enumerate(zip(machine.connectors, machine.wiring.ends)):
        if isinstance(connector, Composite):
            (a, lane), (b, other) = (placed[own[end]] for end, _ in ends)
            parts = np.repeat(sections(connector.length), connector.elements)  # pyright: ignore
            along = a + (b - a) * np.cumsum(parts) / (np.sum(parts))
            first = machine.wiring.inner[i]
            for k in range(connector.inner):
                name = machine.wiring.stations[first + k]
                placed[name] = (float(along[k]), max(lane, other))
    least = min(z for z, _ in placed.values())
    return {name: (z - least, lane) for name, (z, lane) in placed.items()}


def _length(connector: object) -> float | None:
    length = getattr(connector, "length", None)
    return None if length is None else float(np.sum(sections(length)))


def sections(value: object) -> np.ndarray:
    """A number, or one for each section of a stepped shaft, as a list."""
    return np.atleast_1d(np.asarray(value, float))


def disc(station: Rotor | RigidBody) -> tuple[float, float]:
    """Radius and width of the disc with this mass and these inertias, m."""
    if isinstance(station, Rotor):
        m, jp, jt = station.mass, station.polar_inertia, station.transverse_inertia
    else:
        J = np.asarray(station.tensor())
        m, jp, jt = station.mass, J[2, 2], (J[0, 0] + J[1, 1]) / 2
    m, jp, jt = (float(np.asarray(x)) for x in (m, jp, jt))
    radius = np.sqrt(2 * jp / m)
    return radius, np.sqrt(max(0.0, 12 * jt / m - 3 * radius**2))


def half_width(station: object) -> float:
    return disc(station)[1] / 2 if isinstance(station, (Rotor, RigidBody)) else 0.0


def attached(machine: Machine) -> list[tuple[str, str, str]]:
    """(name, kind, station) of every attachment, at each of its stations."""
    return [
        (name, type(connector).__name__, machine.wiring.stations[end])
        for name, connector, ends in zip(
            machine.wiring.connectors, machine.connectors, machine.wiring.ends
        )
        if not isinstance(connector, AbstractConnector)
        for end, _ in ends
    ]


def load_words(name: str, kind: str, many: bool) -> str:
    """Of what is attached; its name alone where there are many."""
    return name if many else f"{name} ({kind})"


@dataclass
class Lane:
    """One axis. `up`, `down`: how far the parts reach from it, m; `level`: its height on the drawing, m.
    `names`, `shafts`, `loads`: the row of each word above, right below and further below; words for which
    there is no room are left out."""

    up: float
    down: float
    level: float = 0.0
    names: dict[str, int] = field(default_factory=dict)
    shafts: dict[str, int] = field(default_factory=dict)
    loads: dict[str, int] = field(default_factory=dict)
    lines: int = 1

    def below(self) -> float:
        """Room for words, points."""
        shafts = (1 + max(self.shafts.values(), default=-1)) * self.lines * ROW
        loads = (1 + max(self.loads.values(), default=-1)) * ROW
        return shafts + loads + 2 * _GAP

    def above(self) -> float:
        return (1 + max(self.names.values(), default=-1)) * NAME_ROW + _GAP


@dataclass(frozen=True)
class Drawing:
    """`where`: station -> (z, lane); `tall`: the largest radius, m; `left`, `right`, `bottom`, `top`: what is
    seen, m; `size`: of the figure, inches."""

    where: dict[str, tuple[float, int]]
    lanes: list[Lane]
    tall: float
    length: float
    left: float
    right: float
    bottom: float
    top: float
    size: tuple[float, float]

    def at(self, name: str) -> tuple[float, float]:
        z, lane = self.where[name]
        return z, self.lanes[lane].level

    def lane(self, name: str) -> Lane:
        return self.lanes[self.where[name][1]]

    def leads(self, machine: Machine, name: str) -> bool:
        """Whether a driven end stands at the left of its line."""
        z, lane = self.where[name]
        others = [x for n, (x, k) in self.where.items() if k == lane and n != name]
        return bool(others) and z <= min(others)


def laid_out(machine: Machine, shaft_words: dict[str, str]) -> Drawing:
    """`shaft_words`: what is written below each connection."""
    where = positions(machine)
    tall = max(
        (disc(s)[0] for s in machine.stations if isinstance(s, (Rotor, RigidBody))), default=0.02
    )
    length = max(max(z for z, _ in where.values()), tall)
    lanes = [Lane(0.3 * tall, 0.3 * tall) for _ in range(1 + max(k for _, k in where.values()))]
    left, right = -0.02 * length, 1.02 * length
    for name, station in zip(machine.wiring.stations, machine.stations):
        z, k = where[name]
        lane = lanes[k]
        half = max(half_width(station), 0.02 * length)
        left, right = min(left, z - half), max(right, z + half)
        if isinstance(station, (Rotor, RigidBody)):
            radius = disc(station)[0]
            lane.up, lane.down = max(lane.up, radius), max(lane.down, radius)
        elif isinstance(station, AbstractPrescribed):
            lane.up, lane.down = max(lane.up, 0.45 * tall), max(lane.down, 0.45 * tall)
            left, right = min(left, z - 0.75 * tall), max(right, z + 0.75 * tall)
        elif isinstance(station, SelfAligningBearing):
            lane.down = max(lane.down, 1.05 * tall)
    wide = 1.06 * (right - left)
    left, right = left - 0.03 * (right - left), right + 0.03 * (right - left)
    width, high = _WIDE, 0.0
    for _ in range(4):  # words take more of a smaller figure
        point = wide / (72 * _INSIDE * width)
        _rows(machine, where, lanes, shaft_words, point)
        high = _levels(lanes, point) + 36 * point
        width = min(_WIDE, _HIGH * wide / high)
    top = lanes[0].up + lanes[0].above() * wide / (72 * _INSIDE * width)
    return Drawing(
        where, lanes, tall, length, left, right, top - high, top, (width, width * high / wide)
    )


def _levels(lanes: list[Lane], point: float) -> float:
    """Puts the lanes below each other; returns their height."""
    level, high = 0.0, lanes[0].up + lanes[0].above() * point
    for before, lane in zip(lanes, lanes[1:]):
        level -= before.down + before.below() * point + lane.up + lane.above() * point
        lane.level = level
    return high - level + lanes[-1].down + lanes[-1].below() * point


def _rows(machine: Machine, where, lanes: list[Lane], shaft_words, point: float) -> None:
    def placed(words: Sequence[tuple[str, float, str]], size: float) -> dict[str, int]:
        """Of a machine of so many parts that words would fill the picture, those that fit into few rows."""
        words = sorted(words, key=lambda w: w[1])
        widths = [
            (max(map(len, text.split("\n"))) + 1.5) * LETTER * size * point for _, _, text in words
        ]
        found = rows([z for _, z, _ in words], widths)
        return {name: row for (name, _, _), row in zip(words, found) if row < MOST_ROWS}

    stations = machine.wiring.stations[: len(machine.stations)]
    middle = {name: _middle(machine, where, name) for name in shaft_words}
    loads = attached(machine)
    for k, lane in enumerate(lanes):
        lane.names = placed([(n, where[n][0], n) for n in stations if where[n][1] == k], NAME)
        own = [(n, middle[n][0], words) for n, words in shaft_words.items() if middle[n][1] == k]
        lane.shafts = placed(own, SMALL)
        lane.lines = max((1 + words.count("\n") for _, _, words in own), default=1)
        many = len(loads) > 2 * MOST_ROWS
        hung = [
            (n, where[s][0], load_words(n, kind, many)) for n, kind, s in loads if where[s][1] == k
        ]
        lane.loads = placed(hung, SMALL)


def _middle(machine: Machine, where, name: str) -> tuple[float, int]:
    ends = machine.wiring.ends[machine.wiring.connectors.index(name)]
    (za, a), (zb, b) = (where[machine.wiring.stations[s]] for s, _ in ends)
    return 0.5 * (za + zb), max(a, b)
