"""How fast each station turns against the spin that everything is measured from."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.protocol import AbstractConnector, Epicyclic, Geared
from .built import Built
from .layout import Layout


def root(layout: Layout) -> int:
    """The node whose spin is the reference: a driven end, a given phi, else the first station."""
    if layout.n_ground:
        return layout.n_nodes
    for group in layout.stations:
        for m, motions in enumerate(group.motions):
            if any(c == 5 and motion >= 0 for c, motion in zip(group.held, motions)):
                return group.start + m
    return layout.internal[0]


def is_geared(machine: Built) -> bool:
    """Whether parts of it turn at different speeds."""
    return any(isinstance(part, Geared) for part in (*machine.stations, *machine.connectors))


def port_turns(layout: Layout, stations: Sequence[Any]) -> dict[int, Array]:
    """Of each port that gears stand before, by its node: its speed over its station's. `stations`: of each
    group, stacked."""
    found = {}
    for port in layout.ports:
        group = stations[port.group]
        if isinstance(group, Geared):
            turns = jax.vmap(lambda e: e.turns(port.name), in_axes=-1, out_axes=-1)(group)  # noqa: B023
            found |= {node: turns[m] for m, node in zip(port.members, port.nodes)}
    return found


def turning(layout: Layout, stations: Sequence[Any], joined) -> Float[Array, " n"] | None:
    """Ratio of each node's speed to the reference's (then driven ends, then followers); `None` where all are
    one. `stations`: of each group, stacked.

    Found by walking from the reference through shafts and gears; around a ring of gears any way. Through
    planetary gears once two of three are known; of what nothing tells, what is held stands still, else the
    ring.
    """
    if not any(isinstance(element, Geared) for element in (*stations, *(e for e, _ in joined))):
        return None
    n = layout.n_nodes + layout.n_ground + layout.n_followers
    edges: dict[int, list[tuple[int, Array | None, bool]]] = {}

    def join(a: int, b: int, ratio: Array | None) -> None:
        edges.setdefault(a, []).append((b, ratio, False))
        edges.setdefault(b, []).append((a, ratio, True))

    ports = port_turns(layout, stations)
    for node in range(layout.n_mass, layout.n_nodes):
        join(layout.node_station[node], node, ports.get(node))
    sets: list[tuple[Array, tuple[int, ...]]] = []
    for element, nodes in joined:
        if isinstance(element, Epicyclic):
            weights = jax.vmap(lambda e: e.balance(), in_axes=-1, out_axes=-1)(element)
            sets += [(weights[:, k], ends) for k, ends in enumerate(zip(*nodes))]
        if not isinstance(element, AbstractConnector):
            continue
        ratios = None
        if isinstance(element, Geared):
            ratios = jax.vmap(lambda e: e.ratio(), in_axes=-1, out_axes=-1)(element)
        for k, (a, b) in enumerate(zip(nodes[0], nodes[1])):
            join(a, b, None if ratios is None else ratios[k])
    start = root(layout)
    found: dict[int, Array] = {start: jnp.ones(())}
    queue = [start]
    while queue:
        here = queue.pop(0)
        for there, ratio, backwards in edges.get(here, []):
            if there not in found:
                step = 1.0 if ratio is None else 1.0 / ratio if backwards else ratio
                found[there] = found[here] * step
                queue.append(there)
        if not queue:
            queue = _through(sets, found, _still(layout))
    one = jnp.ones(())
    return jnp.stack([found.get(k, one) for k in range(n)])[np.arange(n)]


def _still(layout: Layout) -> set[int]:
    """Nodes that are held from turning."""
    return {
        group.start + m
        for group in layout.stations
        for m, motions in enumerate(group.motions)
        for c, motion in zip(group.held, motions)
        if c == 5 and motion < 0
    }


def _through(
    sets: list[tuple[Array, tuple[int, ...]]], found: dict[int, Array], still: set[int]
) -> list[int]:
    """One more node whose ratio a planetary gear tells, now in `found`."""
    for weights, places in sets:
        unknown = [k for k in range(3) if places[k] not in found]
        if len(unknown) == 1:
            (k,) = unknown
            others = sum(weights[i] * found[places[i]] for i in range(3) if i != k)
            found[places[k]] = -others / weights[k]
            return [places[k]]
    for _, places in sets:
        unknown = [place for place in places if place not in found]
        if len(unknown) == 2:
            place = next((p for p in unknown if p in still), unknown[-1])
            found[place] = jnp.zeros(())
            return [place]
    return []
