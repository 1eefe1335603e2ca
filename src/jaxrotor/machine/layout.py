"""Where each station stands in the arrays: static bookkeeping, computed from a machine's structure.

Inside, stations with mass come first, sorted by kind, so that each kind is a slice; given motions
(driven ends) come last. *Nodes* are the points where connectors hold: the stations themselves, and
after the stations with mass any further ports. Arrays are component-first, `(6, n)`.
"""

from dataclasses import dataclass
from typing import Any

import jax

from ..protocol import AbstractInertia, AbstractPrescribed, Ported
from .machine import Machine


@dataclass(frozen=True)
class StationGroup:
    """Stations of one kind with mass: internal indices `start` to `stop`, the machine's `members`,
    coordinates that are not free, and for each member the motion of each (or -1)."""

    members: tuple[int, ...]
    start: int
    stop: int
    held: tuple[int, ...]
    motions: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class ConnectorGroup:
    """Connectors of one kind: the machine's `members`, and for each end the nodes it holds."""

    members: tuple[int, ...]
    nodes: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Port:
    """Nodes that are not simply their station's coordinates."""

    group: int
    name: str
    members: tuple[int, ...]
    nodes: tuple[int, ...]


@dataclass(frozen=True)
class Layout:
    stations: tuple[StationGroup, ...]
    ground: tuple[int, ...]
    connectors: tuple[ConnectorGroup, ...]
    ports: tuple[Port, ...]
    node_station: tuple[int, ...]
    internal: tuple[int, ...]

    @property
    def n_mass(self) -> int:
        return self.stations[-1].stop if self.stations else 0

    @property
    def n_ground(self) -> int:
        return len(self.ground)

    @property
    def n_nodes(self) -> int:
        """Nodes on stations with mass."""
        return len(self.node_station)

    @property
    def free(self) -> tuple[int, ...]:
        """Positions of the free coordinates in a flattened `(6, n_mass)`."""
        held = self.held
        return tuple(i for i in range(6 * self.n_mass) if i not in held)

    @property
    def held(self) -> dict[int, int]:
        """Position -> motion (or -1) of each coordinate that is not free."""
        return {
            c * self.n_mass + g.start + m: motions[k]
            for g in self.stations
            for m, motions in enumerate(g.motions)
            for k, c in enumerate(g.held)
        }


def structure(element: Any) -> Any:
    """What must agree for elements to stack: the kind, its options and the shapes of its fields."""
    leaves, tree = jax.tree.flatten(element)
    return tree, tuple(x.shape for x in leaves)


def _grouped(keys: dict[int, Any]) -> list[tuple[int, ...]]:
    kinds: list[tuple[Any, list[int]]] = []
    for i, key in keys.items():
        for known, members in kinds:
            if known == key:
                members.append(i)
                break
        else:
            kinds.append((key, [i]))
    return [tuple(members) for _, members in kinds]


def lay_out(machine: Machine) -> Layout:
    """`machine` must be `filled()`."""
    wiring = machine.wiring
    held: dict[int, dict[int, int]] = {}
    for h in wiring.held:
        held.setdefault(h.station, {})[h.coordinate] = h.motion
    with_mass = {
        i: (structure(s), tuple(sorted(held.get(i, {}))))
        for i, s in enumerate(machine.stations)
        if isinstance(s, AbstractInertia)
    }
    groups, internal, start = [], {}, 0
    for members in _grouped(with_mass):
        coordinates = with_mass[members[0]][1]
        groups.append(
            StationGroup(
                members,
                start,
                start + len(members),
                coordinates,
                tuple(tuple(held[m][c] for c in coordinates) for m in members)
                if coordinates
                else tuple(() for _ in members),
            )
        )
        for m in members:
            internal[m] = start
            start += 1
    ground = tuple(i for i, s in enumerate(machine.stations) if isinstance(s, AbstractPrescribed))
    node_station = list(range(start))
    nodes: dict[tuple[int, str], int] = {(i, ""): k for i, k in internal.items()}
    for ends in wiring.ends:
        for s, port in ends:
            if port and (s, port) not in nodes:
                nodes[s, port] = len(node_station)
                node_station.append(internal[s])
    for k, s in enumerate(ground):
        internal[s] = start + k
        nodes[s, ""] = len(node_station) + k
    connector_keys = {i: structure(c) for i, c in enumerate(machine.connectors)}
    connectors = tuple(
        ConnectorGroup(
            members,
            tuple(
                tuple(nodes[wiring.ends[m][end]] for m in members)
                for end in range(len(wiring.ends[members[0]]))
            ),
        )
        for members in _grouped(
            {i: (key, len(wiring.ends[i])) for i, key in connector_keys.items()}
        )
    )
    return Layout(
        tuple(groups),
        ground,
        connectors,
        _ports(machine, groups, nodes),
        tuple(node_station),
        tuple(internal[i] for i in range(len(machine.stations))),
    )


def _ports(machine: Machine, groups, nodes) -> tuple[Port, ...]:
    found = []
    for g, group in enumerate(groups):
        first = machine.stations[group.members[0]]
        if not isinstance(first, Ported):
            continue
        for name in ("", *first.ports):
            members = [m for m in group.members if (m, name) in nodes]
            shifted = jax.eval_shape(lambda s: s.shift(name, jax.numpy.zeros(6)), first)  # noqa: B023
            if members and shifted is not None:
                found.append(
                    Port(
                        g,
                        name,
                        tuple(group.members.index(m) for m in members),
                        tuple(nodes[m, name] for m in members),
                    )
                )
    return tuple(found)
