"""Whose force law gives no number."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.protocol import Acting
from ..core.quick import quickly_compiled
from ..machine.field import initial_states, n_free, node_motions
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from ..machine.system import assemble
from .named_parts import forces_on_ends, part_of


def not_finite(
    machine: Machine, t: Float[Array, " n"], y: Float[Array, "n d"] | None = None
) -> str | None:
    """The first part whose forces at one of these instants and states, or their slopes at the first, are not
    finite, as the beginning of a sentence; `None` where there is none. Without `y`: undeformed."""
    for name, (force, slope) in _sound_parts(machine, t, y).items():
        if not force or not slope:
            return f"`{name}`: {'the slope of its force' if force else 'its force'} is not finite"
    return None


@quickly_compiled
def _sound_parts(machine: Machine, t: Array, y: Array | None) -> dict[str, tuple[Array, Array]]:
    """Of each part that acts: whether its forces, and their slopes, are finite."""
    system = assemble(machine)
    wiring, n = structure_of(machine).wiring, n_free(system)
    if y is None:
        rest = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])
        y = jnp.broadcast_to(rest, (t.size, rest.size))
    found = {}
    for name in (*wiring.stations, *wiring.connectors):
        element, nodes, rows = part_of(machine, system, name)
        if not isinstance(element, Acting):
            continue

        def force(t, y, element=element, nodes=nodes, rows=rows):
            q, v = node_motions(t, y, system)
            states = y[2 * n :][rows] if rows.size else None
            return forces_on_ends(element, t, tuple((q[:, i], v[:, i]) for i in nodes), states)

        at_all, slope = jax.vmap(force)(t, y), jax.jacfwd(force, 1)(t[0], y[0])
        found[name] = (jnp.all(jnp.isfinite(at_all)), jnp.all(jnp.isfinite(slope)))
    return found
