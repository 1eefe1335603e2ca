"""Accelerations of the stations: each kind's closed form, then what shafts with mass make of it."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.kinematics import rows
from ..core.picked import picked
from ..core.protocol import AbstractInertia
from .constraint import held_acceleration
from .coupled import Coupled, solve_coupled
from .ports import shift_of, spread
from .seen import seen
from .system import Actor, Reference, System


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
            free = isinstance(e, AbstractInertia) and e.falls_freely
            e = seen(e, system.layout.invariant)
            # row by row: the sum with a whole weight vector would not fuse with what follows
            weight = rows(e.weight(q, system.gravity))
            loads = jnp.stack([force + own for force, own in zip(rows(Q), weight)])

            def acceleration(Q):
                if not free:
                    return e.acceleration(q, v, Q)
                # the moment of the weight about the station, and its rates, are not needed at all
                a = rows(e.acceleration(q, v, Q))
                fall = rows(system.gravity)
                return jnp.stack([*(own + g for own, g in zip(a, fall)), *a[3:]])

            on = Q if free else loads
            if not group.held:
                return acceleration(on), jnp.zeros(6), loads
            return *held_acceleration(acceleration, on, group.held, held), loads

        parts.append(
            jax.vmap(one, in_axes=-1, out_axes=-1)(
                element, q[:, at], v[:, at], Q[:, at], _given(t, group, system, reference)
            )
        )
    a, reaction, loads = (jnp.concatenate(each, axis=1) for each in zip(*parts))
    return a, reaction, loads


def mobilise(
    t, q: Array, v: Array, Q: Array, system: System, reference: Reference
) -> tuple[tuple[Array, Array, Array], Float[Array, "6 6 owners"]]:
    """`accelerate`, and for the owners of shafts with mass (`CoupledMass`) the acceleration of each per unit
    of each force on it."""
    assert system.mass is not None
    owners = system.mass.owners
    found, slope = jax.linearize(lambda F: accelerate(t, q, v, F, system, reference), Q)
    one = jnp.eye(6)[:, :, None] + jnp.zeros(Q.shape[1])
    return found, jax.vmap(lambda d: picked(slope(d)[0], owners), out_axes=1)(one)


def couple(t, q, v, nodes, a, mobility, given, system: System, reference: Reference) -> Coupled:
    """What shafts with mass, and what answers to accelerations, make of the accelerations `a` (`mobility` as
    from `mobilise`)."""
    layout, mass = system.layout, system.mass
    assert mass is not None
    N, V, force = nodes
    count = layout.n_nodes + layout.n_ground
    none, columns = jnp.zeros((6, 0)), []
    for group in layout.stations:
        held, size = _given(t, group, system, reference), group.stop - group.start
        own = jnp.zeros((6, size))
        if group.carried and held is not None:
            rows = np.arange(6)[:, None] == np.array(group.held)
            own = rows.astype(float) @ held
        columns.append(own)
    if layout.n_nodes > layout.n_mass:
        columns.append(jnp.zeros((6, layout.n_nodes - layout.n_mass)))
    columns.append(given if given.shape[1] else jnp.zeros((6, layout.n_ground)))
    fixed = jnp.concatenate([x for x in columns if x.shape[1]] or [none], axis=1)

    def full(x):  # driven ends that nothing holds on to may be left out of the arrays
        return jnp.pad(x, ((0, 0), (0, count - x.shape[1])))

    k, maps = mass.nodes, None
    if layout.ports:

        def place(p):
            return picked(spread(p, layout, shift_of(p, system)), k)

        one = jnp.eye(6)[:, :, None] + jnp.zeros(layout.n_mass)
        J = jax.vmap(lambda d: jax.jvp(place, (q,), (d,))[1])(one)
        J = jnp.swapaxes(J, 0, 1)
        still = jnp.zeros_like(v)
        drift = jax.jvp(lambda q, v: jax.jvp(place, (q,), (v,))[1], (q, v), (v, still))[1]
        maps = J, drift
    inertia = None
    if system.inertial:
        inertia = jnp.concatenate([_inertia(t, e, full(N), full(V)) for e in system.inertial], -1)
    return solve_coupled(mass, full(N), full(V), full(force), fixed, a, mobility, maps, inertia)


def _inertia(t, actor: Actor, N: Array, V: Array) -> Float[Array, "6 6 members"]:
    inertias = jax.vmap(lambda e, m: e.inertia(t, m), in_axes=-1, out_axes=-1)
    return inertias(actor.element, actor.motions(N, V))


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
