"""The vector field: a pure function of time, a flat state and the assembled system.

The state is `y = [u, s, z]`: free coordinates and rates, measured from the reference spin, and the
elements' internal states. The order inside `u` is the layout's; `pack` and `evaluate` translate.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .constraint import held_acceleration
from .mass import Coupled, solve_coupled
from .system import Actor, System


def _add_spin(x: Array, amount: Array, system: System, first: int = 0) -> Array:
    """`amount` of the reference's spin added to the phi row, of nodes from `first` on. (A
    concatenation fuses where a product with a pattern does not simplify: these microseconds are most
    of the field's.)"""
    if system.turn is not None:
        amount = amount * system.turn[first : first + x.shape[1]]
    return jnp.concatenate([x[:5], x[5:] + amount])


class Evaluation(NamedTuple):
    """One evaluation, all arrays component-first over nodes (n_nodes + n_ground) or stations.

    `q`, `v`, `a`: stations in internal order, driven ends last. `nodes`: (q, v) of every node.
    `reaction`: generalized constraint forces ON each station. `loads`: all others ON each station
    with mass, its weight among them. `states`: internal ones; `rates`: their derivatives.
    """

    q: Array
    v: Array
    a: Array
    nodes: tuple[Array, Array]
    loads: Array
    reaction: Array
    states: Array
    rates: Array


Reference = tuple[Array, Array, Array]


def vector_field(t: Float[Array, ""], y: Float[Array, " d"], system: System) -> Float[Array, " d"]:
    """dy/dt, as `diffrax.ODETerm` takes it."""
    return relative_field(t, y, system, system.reference(t))


def relative_field(
    t, y, system: System, reference: Reference, applied: Float[Array, "6 m"] | None = None
) -> Float[Array, " d"]:
    """dy/dt where y is measured from the spin `reference` = (angle, speed, acceleration).

    `applied`: further generalized forces on the nodes of stations with mass.
    """
    u, s, z = unpack(t, y, system, reference)
    ev = _evaluate(t, u, s, z, system, reference, outputs=False, applied=applied)
    free = system.layout.free
    n = 6 * system.layout.n_mass
    a = _add_spin(ev.a, -reference[2], system).ravel()
    rates = s.ravel()
    if len(free) < n:
        index = np.array(free, dtype=int)
        a, rates = a[index], rates[index]
    return jnp.concatenate([rates, a, ev.rates])


def jacobian(system: System, speed: Float[Array, ""]) -> Float[Array, "d d"]:
    """∂(dy/dt)/∂y of the undeformed line turning at a constant common `speed` (rad/s)."""
    zero = jnp.zeros_like(speed)
    reference = (zero, speed, zero)
    y = jnp.concatenate([jnp.zeros(2 * len(system.layout.free)), initial_states(system)])
    return jax.jacfwd(lambda y: relative_field(zero, y, system, reference))(y)


def evaluate(
    t: Float[Array, ""],
    y: Float[Array, " d"],
    system: System,
    reference: Reference | None = None,
) -> Evaluation:
    """Everything about one instant, reactions included."""
    if reference is None:
        reference = system.reference(t)
    u, s, z = unpack(t, y, system, reference)
    return _evaluate(t, u, s, z, system, reference, outputs=True)


def initial_states(system: System) -> Float[Array, " k"]:
    parts = [
        actor.call("initial").ravel()
        for actor in system.actors
        if actor.states[1] > actor.states[0]
    ]
    return jnp.concatenate([jnp.zeros(0), *parts])


def pack(
    q: Array, v: Array, states: Array, system: System, reference: Reference
) -> Float[Array, " d"]:
    """The flat state of stations' coordinates `q`, `v` (6, n_mass), internal order."""
    phi, w, _ = reference
    index = np.array(system.layout.free, dtype=int)
    u, s = (_add_spin(x, -r, system).ravel()[index] for x, r in ((q, phi), (v, w)))
    return jnp.concatenate([u, s, states])


def unpack(t, y, system: System, reference: Reference) -> tuple[Array, Array, Array]:
    """Relative coordinates and rates (6, n_mass), held ones filled in, and internal states."""
    layout = system.layout
    held = layout.held
    n, f = 6 * layout.n_mass, n_free(system)
    u, s, z = y[:f], y[f : 2 * f], y[2 * f :]
    if held:
        given = [system.held_motion(m, t, reference) for m in held.values()]
        spin: Any = np.array([p // layout.n_mass == 5 for p in held], float)
        if system.turn is not None:
            spin = spin * system.turn[np.array([p % layout.n_mass for p in held])]
        at = np.argsort(np.array([*layout.free, *held]))
        u, s = (
            jnp.concatenate([x, jnp.stack([g[i] + 0.0 * t for g in given]) - spin * reference[i]])[
                at
            ]
            for i, x in enumerate((u, s))
        )
    return u.reshape(6, n // 6), s.reshape(6, n // 6), z


def n_free(system: System) -> int:
    return len(system.layout.free)


def _evaluate(
    t, u, s, z, system: System, reference, outputs: bool, applied: Array | None = None
) -> Evaluation:
    layout = system.layout
    phi, w, _ = reference
    n, m, g = layout.n_mass, layout.n_nodes, layout.n_ground
    q, v = _add_spin(u, phi, system), _add_spin(s, w, system)

    # nodes: relative motion for the assembled part, absolute for force laws
    shift, shift_t, pull = _ports(q, v, system)
    U, S = _spread(u, layout, shift), _spread(s, layout, shift_t)
    whole = outputs or (g and not system.quiet_ground)
    if whole and g:
        qg, vg, ag = system.given(t, reference)
        U = jnp.concatenate([U, _add_spin(qg, -phi, system, m)], axis=1)
        S = jnp.concatenate([S, _add_spin(vg, -w, system, m)], axis=1)
    matrix = system.whole if whole else system.moving
    state = jnp.concatenate([U.ravel(), S.ravel()])
    count = U.shape[1]
    spin = system.spin if whole else system.spin.reshape(6, m + g, 2)[:, :m].reshape(-1, 2)
    Q = (matrix @ state + spin[:, 0] * phi + spin[:, 1] * w).reshape(6, count)

    N, V = _add_spin(U, phi, system), _add_spin(S, w, system)
    if g and not whole and _ground_acts(system):
        qg, vg, ag = system.given(t, reference)
        N, V = jnp.concatenate([N, qg], axis=1), jnp.concatenate([V, vg], axis=1)
    extra = [_act(t, actor, N, V, z) for actor in system.actors]
    Q = _gather(Q, [e for e in extra if e is not None], count)
    if system.mass is not None:
        Q = Q + system.mass.weight[:, :count]

    if applied is not None:
        Q = Q.at[:, :m].add(applied)

    # what reaches the stations, then each kind's own acceleration
    on_stations = Q[:, :n]
    if pull is not None:
        on_stations = pull(Q[:, :m])
    a, reaction, loads = _accelerate(t, q, v, on_stations, system, reference)
    inertia = None
    if system.mass is not None:
        given = ag if g and N.shape[1] > m else jnp.zeros((6, 0))
        coupled = _couple(t, q, v, (N, V, Q), on_stations, a, given, system, reference)
        a, inertia = coupled.acceleration, coupled.inertia_force
        if outputs:
            reaction = _coupled_reaction(t, q, v, on_stations, coupled, reaction, system, reference)
    rates = _rates(t, N, V, a, q, v, z, system, reference)
    if outputs and g:
        q, v, a = (jnp.concatenate(pair, axis=1) for pair in ((q, qg), (v, vg), (a, ag)))
        on_ground = -Q[:, m:] if inertia is None else inertia[:, m:] - Q[:, m:]
        reaction = jnp.concatenate([reaction, on_ground], axis=1)
    return Evaluation(q, v, a, (N, V), loads, reaction, z, rates)


def _spread(x: Array, layout, shift: Array | None) -> Array:
    """Station values (6, n_mass) to node values (6, n_nodes)."""
    if layout.n_nodes > layout.n_mass:
        x = x[:, np.array(layout.node_station)]
    return x if shift is None else x + shift


def _shift(q: Array, system: System) -> Array:
    """Ports' coordinates less their stations' own, (6, n_nodes)."""
    layout = system.layout
    out = jnp.zeros((6, layout.n_nodes))
    for port in layout.ports:
        group = layout.stations[port.group]
        members = np.array(port.members)
        element = jax.tree.map(lambda x: x[..., members], system.stations[port.group])  # noqa: B023
        at = q[:, group.start + members]
        moved = jax.vmap(lambda e, p: e.shift(port.name, p), in_axes=-1, out_axes=-1)(element, at)  # noqa: B023
        out = out.at[:, np.array(port.nodes)].set(moved)
    return out


def _ports(q: Array, v: Array, system: System):
    """Shift and its rate, and the map that takes forces on nodes to stations (virtual work)."""
    layout = system.layout
    if not layout.ports and layout.n_nodes == layout.n_mass:
        return None, None, None
    shift, shift_t = jax.jvp(lambda p: _shift(p, system), (q,), (v,))
    _, pull = jax.vjp(lambda p: _spread(p, layout, _shift(p, system)), q)
    return shift, shift_t, lambda Q: pull(Q)[0]


def _act(t, actor: Actor, N: Array, V: Array, z: Array):
    """Forces of one stacked force law: a list of (6, members), one for each end, with its nodes."""
    motions = tuple((_take(N, nodes), _take(V, nodes)) for nodes in actor.nodes)
    states = z[slice(*actor.states)].reshape(-1, len(actor.nodes[0])) if _has_state(actor) else None
    forces = jax.vmap(lambda e, m, s: e.forces(t, m, s), in_axes=-1, out_axes=-1)(
        actor.element, motions, states
    )
    return None if forces is None else list(zip(actor.nodes, forces))


def _has_state(actor: Actor) -> bool:
    return actor.states[1] > actor.states[0]


def _take(x: Array, nodes: tuple[int, ...]) -> Array:
    """Columns; a slice where they stand side by side, for it fuses."""
    if nodes == tuple(range(nodes[0], nodes[0] + len(nodes))):
        return x[:, nodes[0] : nodes[0] + len(nodes)]
    return x[:, np.array(nodes)]


def _gather(Q: Array, extra: list, count: int) -> Array:
    """Adds forces to the columns of their nodes: padding for neighbours, one product for the rest."""
    scattered = []
    for nodes, force in (pair for group in extra for pair in group):
        first, stop = nodes[0], nodes[0] + len(nodes)
        if nodes == tuple(range(first, stop)):
            if first < count:
                keep = min(stop, count) - first
                Q = Q + jnp.pad(force[:, :keep], ((0, 0), (first, count - first - keep)))
        else:
            scattered.append((nodes, force))
    if scattered:
        columns = np.concatenate([np.array(nodes) for nodes, _ in scattered])
        incidence = (columns[:, None] == np.arange(count)[None]).astype(float)
        Q = Q + jnp.concatenate([force for _, force in scattered], axis=1) @ incidence
    return Q


def _ground_acts(system: System) -> bool:
    """Whether a force law or a shaft with mass holds at a driven end."""
    m = system.layout.n_nodes
    if system.mass is not None and system.mass.touches_ground:
        return True
    return any(n >= m for a in system.actors for end in a.nodes for n in end)


def _given(t, group, system: System, reference: Reference) -> Array | None:
    """Accelerations of the coordinates that a group does not find itself, (held, members)."""
    if not group.held:
        return None
    given = [[system.held_motion(m, t, reference)[2] for m in row] for row in group.motions]
    return jnp.stack([jnp.stack(row) for row in given], axis=-1)


def _accelerate(
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


def _couple(t, q, v, nodes, Q, a, given, system: System, reference: Reference) -> Coupled:
    """What shafts with mass make of the accelerations `a`."""
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

    # P: accelerations of the touched stations per unit of each force
    one = jnp.eye(6)[:, :, None] + jnp.zeros(layout.n_mass)
    response = jax.vmap(
        lambda d: jax.jvp(lambda F: _accelerate(t, q, v, F, system, reference)[0], (Q,), (d,))[1]
    )
    mobility = jnp.swapaxes(response(one), 0, 1)[:, :, np.array(mass.owners, int)]
    k = np.array(mass.nodes, int)
    if layout.ports:

        def place(p):
            return _spread(p, layout, _shift(p, system))[:, k]

        J = jax.vmap(lambda d: jax.jvp(place, (q,), (d,))[1])(one)
        J = jnp.swapaxes(J, 0, 1)
        still = jnp.zeros_like(v)
        drift = jax.jvp(lambda q, v: jax.jvp(place, (q,), (v,))[1], (q, v), (v, still))[1]
    else:
        J = jnp.eye(6)[:, :, None] + jnp.zeros(len(k))
        drift = jnp.zeros((6, len(k)))
    return solve_coupled(mass, full(N), full(V), full(force), fixed, a, mobility, (J, drift))


def _coupled_reaction(
    t, q, v, Q, coupled: Coupled, reaction, system: System, reference: Reference
) -> Array:
    """Constraint forces of held coordinates, the inertia of shafts included."""
    mass, layout = system.mass, system.layout
    assert mass is not None
    if mass.owners:
        on = Q.at[:, np.array(mass.owners)].add(coupled.on_owners)
        reaction = _accelerate(t, q, v, on, system, reference)[1]
    for group in layout.stations:
        if group.carried and group.held:
            at = np.ix_(group.held, range(group.start, group.stop))
            reaction = reaction.at[at].set(coupled.inertia_force[at] - Q[at])
    return reaction


def _rates(t, N, V, a, q, v, z, system: System, reference: Reference) -> Array:
    """Derivatives of the internal states, after the accelerations."""
    stateful = [actor for actor in system.actors if _has_state(actor)]
    if not stateful:
        return jnp.zeros(0)
    layout = system.layout
    A = a
    if layout.ports or layout.n_nodes > layout.n_mass:

        def velocity(q, v):
            return jax.jvp(lambda p: _spread(p, layout, _shift(p, system)), (q,), (v,))[1]

        A = jax.jvp(velocity, (q, v), (v, a))[1]
    if layout.n_ground:
        A = jnp.concatenate([A, system.given(t, reference)[2]], axis=1)
    out = []
    for actor in stateful:
        motions = tuple((_take(N, nodes), _take(V, nodes)) for nodes in actor.nodes)
        accelerations = tuple(_take(A, nodes) for nodes in actor.nodes)
        states = z[slice(*actor.states)].reshape(-1, len(actor.nodes[0]))
        out.append(
            jax.vmap(lambda e, m, b, s: e.rates(t, m, b, s), in_axes=-1, out_axes=-1)(
                actor.element, motions, accelerations, states
            ).ravel()
        )
    return jnp.concatenate(out)
