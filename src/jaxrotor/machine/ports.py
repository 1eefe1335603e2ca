"""From stations to the nodes where connectors hold, and forces back."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..core.picked import picked
from .seen import seen
from .system import System


def spread(x: Array, layout, shift: Array | None) -> Array:
    """Station values (6, n_mass) to node values (6, n_nodes)."""
    if layout.n_nodes > layout.n_mass:
        x = x[:, np.array(layout.node_station)]
    return x if shift is None else x + shift


def shift_of(q: Array, system: System) -> Array:
    """Ports' coordinates less their stations' own, (6, n_nodes)."""
    layout = system.layout
    parts, columns = [jnp.zeros((6, layout.n_nodes))], np.arange(layout.n_nodes)
    for port in layout.ports:
        group = layout.stations[port.group]
        members = np.array(port.members)
        element = jax.tree.map(lambda x: picked(x, members), system.stations[port.group])  # noqa: B023
        at = picked(q, group.start + members)
        moved = jax.vmap(
            lambda e, p: seen(e, layout.invariant).shift(port.name, p),  # noqa: B023
            in_axes=-1,
            out_axes=-1,
        )(element, at)
        columns[np.array(port.nodes)] = sum(x.shape[1] for x in parts) + np.arange(len(members))
        parts.append(moved)
    return picked(jnp.concatenate(parts, axis=1), columns)


def ports(q: Array, v: Array, system: System):
    """Shift and its rate, and the map that takes forces on nodes to stations (virtual work)."""
    layout = system.layout
    if not layout.ports and layout.n_nodes == layout.n_mass:
        return None, None, None
    shift, shift_t = jax.jvp(lambda p: shift_of(p, system), (q,), (v,))
    _, pull = jax.vjp(lambda p: spread(p, layout, shift_of(p, system)), q)
    return shift, shift_t, lambda Q: pull(Q)[0]
