"""Where each station stands in the arrays: static bookkeeping, computed from a machine's structure.

Inside, stations with mass come first, sorted by kind, so that each kind is a slice; given motions
(driven ends) come next, and last the stations that follow others (condensation). *Nodes* are the points
where connectors hold: the stations themselves, and after the stations with mass any further ports. Arrays
are component-first, `(6, n)`; those who solve leave the followers out.
"""

from dataclasses import dataclass
from typing import Any

import jax

from ..core.protocol import AbstractPrescribed, Carried, Ported, Prepared
from .lineup import Block, Lineup, by_structure, stack, structure, structure_of


@dataclass(frozen=True)
class StationGroup:
    """Stations of one kind with mass: internal indices `start` to `stop`, the line-up's `blocks` and
    `members`, coordinates that are not free, and for each member the motion of each (or -1).
    `carried`: their inertia is that of shafts with mass."""

    blocks: tuple[int, ...]
    members: tuple[int, ...]
    start: int
    stop: int
    held: tuple[int, ...]
    motions: tuple[tuple[int, ...], ...]
    carried: bool


@dataclass(frozen=True)
class ConnectorGroup:
    """Connectors of one kind: the line-up's `blocks` and `members`, and for each end the nodes it
    holds. `condensed`: some hold a station that follows others; what all of them do is done by what stands
    for them (condensed.py)."""

    blocks: tuple[int, ...]
    members: tuple[int, ...]
    nodes: tuple[tuple[int, ...], ...]
    condensed: bool


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
    # as `turns_by_chi` says
    invariant: bool
    # the nodes that are kept among followers
    kept: tuple[int, ...]
    # the highest frequency at which these do, Hz
    up_to: float
    n_followers: int

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


def _grouped(blocks: tuple[Block, ...], keys: list[Any]) -> list[tuple[list[int], list[int]]]:
    """Blocks of one kind together: (blocks, members), in the order in which kinds appear."""
    kinds: list[Any] = []
    found: list[tuple[list[int], list[int]]] = []
    member = 0
    for i, (block, key) in enumerate(zip(blocks, keys)):
        if key is not None:
            if key not in kinds:
                kinds.append(key)
                found.append(([], []))
            of_kind = found[kinds.index(key)]
            of_kind[0].append(i)
            of_kind[1].extend(range(member, member + len(block)))
        member += len(block)
    return found


def lay_out(lineup: Lineup) -> Layout:
    """Only names, options and shapes are looked at."""
    wiring = lineup.wiring
    held: dict[int, dict[int, int]] = {}
    for h in wiring.held:
        held.setdefault(h.station, {})[h.coordinate] = h.motion
    condensation = wiring.condensation
    followers = () if condensation is None else condensation.followers
    condensed = set() if condensation is None else condensation.stations
    keys, ground, first, member = [], [], {}, 0
    for block in lineup.stations:
        one = block.one()
        first.update(dict.fromkeys(range(member, member + len(block)), one))
        if isinstance(one, AbstractPrescribed):
            ground.append(member)
            keys.append(None)
        else:
            keys.append((structure(one), tuple(sorted(held.get(member, {})))))
        member += len(block)
    groups, internal, start = [], {}, 0
    for blocks, members in _grouped(lineup.stations, keys):
        members = [m for m in members if m not in followers]
        if not members:
            continue
        coordinates = tuple(sorted(held.get(members[0], {})))
        one = first[members[0]]
        groups.append(
            StationGroup(
                tuple(blocks),
                tuple(members),
                start,
                start + len(members),
                coordinates,
                tuple(tuple(held[m][c] for c in coordinates) for m in members),
                isinstance(one, Carried)
                and jax.eval_shape(lambda s: s.own_mass(), one) is not None,
            )
        )
        for m in members:
            internal[m] = start
            start += 1
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
    for k, s in enumerate(followers, len(ground)):
        internal[s] = start + k
        nodes[s, ""] = len(node_station) + k
    connector_keys, member = [], 0
    for block in lineup.connectors:
        connector_keys.append((structure(block.one()), len(wiring.ends[member])))
        member += len(block)
    connectors = tuple(
        ConnectorGroup(
            tuple(blocks),
            tuple(members),
            tuple(
                tuple(nodes[wiring.ends[m][end]] for m in members)
                for end in range(len(wiring.ends[members[0]]))
            ),
            any(s in condensed for m in members for s, _ in wiring.ends[m]),
        )
        for blocks, members in _grouped(lineup.connectors, connector_keys)
    )
    return Layout(
        tuple(groups),
        tuple(ground),
        connectors,
        _ports(lineup, groups, nodes),
        tuple(node_station),
        tuple(internal[i] for i in range(len(wiring.stations))),
        turns_by_chi(lineup),
        tuple(
            internal[s] for span in (condensation.spans if condensation else ()) for s in span.kept
        ),
        condensation.up_to if condensation else 0.0,
        len(followers),
    )


def joined(lineup: Lineup, layout: Layout) -> list[tuple[Any, tuple[tuple[int, ...], ...]]]:
    """Of each group of connectors its elements, stacked and `Prepared`, and the nodes of each end."""
    return [
        (_prepared(stack([lineup.connectors[b] for b in group.blocks])), group.nodes)
        for group in layout.connectors
    ]


def _prepared(stacked: Any) -> Any:
    if not isinstance(stacked, Prepared):
        return stacked
    return jax.vmap(lambda e: e.prepared(), in_axes=-1, out_axes=-1)(stacked)


def turns_by_chi(lineup: Lineup) -> bool:
    """Whether turning is measured by chi = phi + psi theta/2 (kinematics); a shaft that says `twist="paper"`
    makes its whole machine the paper's, which measures by phi."""
    return all(getattr(block.one(), "twist", None) != "paper" for block in lineup.connectors)


def _ports(lineup: Lineup, groups, nodes) -> tuple[Port, ...]:
    found = []
    for g, group in enumerate(groups):
        first = lineup.stations[group.blocks[0]].one()
        if not isinstance(first, Ported):
            continue
        for name in ("", *first.ports):
            members = [m for m in group.members if (m, name) in nodes]
            if not members:
                continue
            shifted = jax.eval_shape(lambda s, name=name: s.shift(name, jax.numpy.zeros(6)), first)  # noqa: B023
            if shifted is not None:
                found.append(
                    Port(
                        g,
                        name,
                        tuple(group.members.index(m) for m in members),
                        tuple(nodes[m, name] for m in members),
                    )
                )
    return tuple(found)


@by_structure
def layout_of(machine: Any) -> Layout:
    return lay_out(structure_of(machine))


def count_of_free(machine: Any) -> int:
    """How many coordinates are free."""
    return len(layout_of(machine).free)
