"""One part of a machine by name, those inside composites too: its element, nodes and states."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.protocol import Acting, Linear, Motion, Signalling
from ..machine.lineup import line_up, structure_of
from ..machine.machine import Machine
from ..machine.system import System

_lined_up = eqx.filter_jit(line_up)  # traced once for all names


def inner_element(machine: Machine, name: str) -> Any:
    lineup = _lined_up(machine)
    wiring = lineup.wiring
    station = name in wiring.stations
    index = (wiring.stations if station else wiring.connectors).index(name)
    for block in lineup.stations if station else lineup.connectors:
        if index < len(block):
            if block.count is None:
                return block.element
            return jax.tree.map(lambda x: x[..., index], block.element)  # noqa: B023
        index -= len(block)


def signals_of(machine: Machine, name: str) -> dict[str, str]:
    """name -> unit of the quantities that a part offers, those inside composites too."""
    lineup = structure_of(machine)
    index = (*lineup.wiring.stations, *lineup.wiring.connectors).index(name)
    for block in (*lineup.stations, *lineup.connectors):
        if index < len(block):
            one = block.one()
            return dict(one.signals) if isinstance(one, Signalling) else {}
        index -= len(block)
    return {}


def part_of(machine: Machine, system: System, name: str) -> tuple[Any, list[int], np.ndarray]:
    """An element, the nodes of its ends, and the rows of its internal states."""
    layout, wiring = system.layout, structure_of(machine).wiring
    element = (
        machine.filled()[name] if name in machine.wiring.order else inner_element(machine, name)
    )
    if name in wiring.stations:
        index = layout.internal[wiring.stations.index(name)]
        if index >= layout.n_mass:  # a driven end: no states
            return element, [index + layout.n_nodes - layout.n_mass], np.zeros(0, int)
        nodes = [index]
        groups = [range(g.start, g.stop) for g in layout.stations]
        index_of_group = next(i for i, g in enumerate(groups) if index in g)
        member, many = groups[index_of_group].index(index), len(groups[index_of_group])
    else:
        which = wiring.connectors.index(name)
        at = next(i for i, g in enumerate(layout.connectors) if which in g.members)
        group = layout.connectors[at]
        member, many = group.members.index(which), len(group.members)
        nodes = [end[member] for end in group.nodes]
        index_of_group = len(layout.stations) + at
    first, last = system.rows[index_of_group]
    return element, nodes, np.arange(first + member, last, many)


def forces_on_ends(element: Any, t, motions: tuple[Motion, ...], state) -> Float[Array, "ends 6"]:
    """Generalized force ON each of a connector's stations, linear part and force law together."""
    total = jnp.zeros((len(motions), 6))
    if isinstance(element, Linear):
        K, C = element.matrices()
        q, v = (jnp.concatenate([m[i] for m in motions]) for i in (0, 1))
        total -= (K @ q + C @ v).reshape(-1, 6)
    if isinstance(element, Acting):
        own = element.forces(t, motions, state)
        total += 0.0 if own is None else jnp.stack(own)
    return total
