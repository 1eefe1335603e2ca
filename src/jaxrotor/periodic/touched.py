"""Which coordinates force laws touch: all others of a large machine can be eliminated order by order."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..core.protocol import Acting, Condensable, Stateful
from ..core.quick import quickly_compiled
from ..machine.field import n_free
from ..machine.system import Actor, System

# Motions at which laws are looked at, of sizes between these (m, rad; of rates a thousand times as much): a
# contact must be reached, and a smooth step not be passed.
_MOTIONS, _LEAST, _MOST, _RATE = 64, 1e-8, 10.0, 1e3
# A force that differs by less than this part of itself is the same.
_ROUNDING = 1e-10
# Free coordinates up to which all of a machine is solved for at once, and of others the share of touched
# unknowns up to which elimination pays.
_SMALL, _SHARE = 12, 0.4


def touched_by_laws(system: System) -> tuple[int, ...] | None:
    """Of the unknowns, free coordinates and then internal states, those on which some force law (or internal
    state's rate) depends; `None` where eliminating the others would not pay."""
    layout, n = system.layout, n_free(system)
    if n <= _SMALL:
        return None
    found = np.zeros((6, layout.n_mass), bool)
    # pieces of shafts push by their gyroscopic moments alone, constant as the spin is
    actors = tuple(a for a in system.actors if not isinstance(a.element, Condensable))
    for actor, depends in zip(actors, _dependence(actors)):
        for nodes, own in zip(actor.nodes, np.asarray(depends)):
            for node, rows in zip(nodes, own.T):
                if node >= layout.n_nodes + layout.n_ground:
                    return None
                if node < layout.n_mass:
                    found[:, node] |= rows
                elif node < layout.n_nodes:  # a port moves with all of its station
                    found[:, layout.node_station[node]] = True
    free = np.flatnonzero(found.ravel()[np.array(layout.free, int)])
    both = (*free.tolist(), *range(n, n + system.n_states()))
    return both if len(both) <= _SHARE * (n + system.n_states()) else None


@quickly_compiled
def _dependence(actors: tuple[Actor, ...]) -> list[Any]:
    """(ends, 6, members) of each, whether a coordinate or its rate counts for anything."""
    return [_depends(actor) for actor in actors]


def _depends(actor: Actor) -> Any:
    random = np.random.default_rng(0)
    ends, members = len(actor.nodes), len(actor.nodes[0])
    per = (actor.states[1] - actor.states[0]) // members

    def some(count: int) -> np.ndarray:
        sizes = random.permutation(np.geomspace(_LEAST, _MOST, _MOTIONS))
        return sizes[:, None] * random.normal(size=(_MOTIONS, count))

    scale = np.tile(np.repeat([1.0, _RATE], 6), ends)
    motions, others, states = some(12 * ends) * scale, some(12 * ends) * scale, some(per)

    def at(element, moved, state):
        each = tuple(zip(moved.reshape(ends, 2, 6)[:, 0], moved.reshape(ends, 2, 6)[:, 1]))
        zero, own = jnp.zeros(()), state if per else None
        found = []
        if isinstance(element, Acting):
            forces = element.forces(zero, each, own)
            found += [] if forces is None else [jnp.stack(forces).ravel()]
        if per and isinstance(element, Stateful):
            still = tuple(jnp.zeros(6) for _ in range(ends))
            found.append(element.rates(zero, each, still, state).ravel())
        return jnp.concatenate(found)

    def of_members(moved, state):
        return jax.vmap(lambda e: at(e, moved, state), in_axes=-1, out_axes=-1, axis_size=members)(
            actor.element
        )

    along = jax.vmap(of_members)
    before = along(motions, states)

    def differs(one):
        after = along(jnp.where(one > 0, others, motions), states)
        # beyond what a law is made for (a journal outside its bearing) no number comes out
        other = jnp.abs(after - before) > _ROUNDING * (jnp.abs(after) + jnp.abs(before))
        return jnp.any(other & jnp.isfinite(after - before), axis=(0, 1))

    found = jax.lax.map(differs, jnp.eye(12 * ends))
    return jnp.any(found.reshape(ends, 2, 6, members), axis=1)
