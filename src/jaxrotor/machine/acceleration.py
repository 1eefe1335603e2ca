"""Accelerations of the stations: each kind's closed form, then what shafts with mass make of it."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .constraint import held_acceleration
from .mass import Coupled, solve_coupled
from .ports import shift_of, spread
from .seen import seen
from .system import Reference, System


def _given(t, group, system: System, reference: Reference) -> Array | None:
    """Accelerations of the coordinates that a group does not find itself, (held, members)."""
    if not group.held:
        return None
    given = [[system.held_motion(m, t, reference)[2] for m in row] for row in group.motions]
    return jnp.stack([jnp.stack(row) for row in given], axis=-1)


def accelerate(
    t, q: Array, v: Array, Q: Array, system: System, reference: Reference
) -> tuple[Array, Array, Array]:
    """Accelerations, reactions and loads of all stations, as if no shaft had mass."""
    parts = []
    for group, element in zip(system.layout.stations, system.stations):
        at = slice(group.start, group.stop)
        if group.carried:  # all of its inertia is coupled, its weight too
            parts.append((jnp.zeros_like(Q[:, at]), jnp.zeros_like(Q[:, at]), Q[:, at]))
            continue

        def one(e, q, v, Q, held: Any = None, group=group):
            e = seen(e, system.layout.invariant)
            # row by row: the sum with a whole weight vector would not fuse with what follows
            weight = e.weight(q, system.gravity)
            Q = jnp.stack([Q[i] + weight[i] for i in range(6)])
            if not group.held:
                return e.acceleration(q, v, Q), jnp.zeros(6), Q
            return *held_acceleration(e, q, v, Q, group.held, held), Q

        parts.append(
            jax.vmap(one, in_axes=-1, out_axes=-1)(
                element, q[:, at], v[:, at], Q[:, at], _given(t, group, system, reference)
            )
        )
    a, reaction, loads = (jnp.concatenate(each, axis=1) for each in zip(*parts))
    return a, reaction, loads


def mobilise(
    t, q: Array, v: Array, Q: Array, system: System, reference: Reference
) -> tuple[tuple[Array, Array, Array], Float[Array, "6 6 n"]]:
    """`accelerate`, and the acceleration of each station per unit of each force on it: one trace for both."""
    one = jnp.eye(6)[:, :, None] + jnp.zeros(Q.shape[1])

    def response(d):
        found, slopes = jax.jvp(lambda F: accelerate(t, q, v, F, system, reference), (Q,), (d,))
        return found, slopes[0]

    return jax.vmap(response, out_axes=(None, 1))(one)


def couple(t, q, v, nodes, a, mobility, given, system: System, reference: Reference) -> Coupled:
    """What shafts with mass make of the accelerations `a` (`mobility` as from `mobilise`)."""
    layout, mass = system.layout, system.mass
    assert mass is not None
    N, V, force = nodes
    count = layout.n_nodes + layout.n_ground
    fixed = jnp.zeros((6, count))
    for group in layout.stations:
        held = _given(t, group, system, reference)
        if group.carried and held is not None:
            fixed = fixed.at[np.ix_(group.held, range(group.start, group.stop))].set(held)
    if given.shape[1]:
        fixed = fixed.at[:, layout.n_nodes :].set(given)

    def full(x):  # driven ends that nothing holds on to may be left out of the arrays
        return jnp.pad(x, ((0, 0), (0, count - x.shape[1])))

    mobility = mobility[:, :, np.array(mass.owners, int)]
    k = np.array(mass.nodes, int)
    if layout.ports:

        def place(p):
            return spread(p, layout, shift_of(p, system))[:, k]

        one = jnp.eye(6)[:, :, None] + jnp.zeros(layout.n_mass)
        J = jax.vmap(lambda d: jax.jvp(place, (q,), (d,))[1])(one)
        J = jnp.swapaxes(J, 0, 1)
        still = jnp.zeros_like(v)
        drift = jax.jvp(lambda q, v: jax.jvp(place, (q,), (v,))[1], (q, v), (v, still))[1]
    else:
        J = jnp.eye(6)[:, :, None] + jnp.zeros(len(k))
        drift = jnp.zeros((6, len(k)))
    return solve_coupled(mass, full(N), full(V), full(force), fixed, a, mobility, (J, drift))


def coupled_reaction(
    t, q, v, Q, coupled: Coupled, reaction, system: System, reference: Reference
) -> Array:
    """Constraint forces of held coordinates, the inertia of shafts included."""
    mass, layout = system.mass, system.layout
    assert mass is not None
    if mass.owners:
        on = Q.at[:, np.array(mass.owners)].add(coupled.on_owners)
        reaction = accelerate(t, q, v, on, system, reference)[1]
    for group in layout.stations:
        if group.carried and group.held:
            at = np.ix_(group.held, range(group.start, group.stop))
            reaction = reaction.at[at].set(coupled.inertia_force[at] - Q[at])
    return reaction
