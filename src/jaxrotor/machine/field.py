"""The vector field: a pure function of time, a flat state and the assembled system.

The state is `y = [u, s, z]`: free coordinates and rates, measured from the reference spin, and the
elements' internal states. The order inside `u` is the layout's; `pack` and `evaluate` translate.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.columns import columns
from ..core.kinematics import from_turning, turning_lead_acceleration, with_last
from ..core.picked import picked, placed_columns
from .acceleration import accelerate, couple, coupled_reaction, mobilise
from .ports import ports, shift_of, spread
from .system import Actor, Reference, System, clock


def _add_spin(x: Array, amount: Array, system: System, first: int = 0) -> Array:
    """`amount` of the reference's spin added to the phi row, of nodes from `first` on. (A
    concatenation fuses where a product with a pattern does not simplify: these microseconds are most
    of the field's.)"""
    if system.turn is not None:
        amount = amount * system.turn[first : first + x.shape[1]]
    return jnp.concatenate([x[:5], x[5:] + amount])


def _join(*parts: Array) -> Array:
    """One vector. Empty parts leave nothing in the program: with zero-size arrays in it, XLA of jax 0.10
    may lose what it needs to find a LAPACK routine (docs/solving.md)."""
    full = [x for x in parts if x.size]
    return jnp.concatenate(full) if full else jnp.zeros(0)


class Evaluation(NamedTuple):
    """One evaluation, all arrays component-first over nodes (n_nodes + n_ground) or stations.

    `q`, `v`, `a`: stations in internal order, behind those with mass the driven ends, last those that follow
    others. `nodes`: (q, v) of every node. The sixth coordinate is chi, as force laws see it (`angles` has
    phi), but in the paper's machines. `reaction`: generalized constraint forces ON each station. `loads`: all
    others ON each station with mass, its weight among them. `states`: internal ones; `rates`: their
    derivatives. `answer`: as of `Coupled`. `forces`: on the nodes, but for the stations' own weight and
    inertia.
    """

    q: Array
    v: Array
    a: Array
    nodes: tuple[Array, Array]
    loads: Array
    reaction: Array
    states: Array
    rates: Array
    answer: Array | None
    forces: Array | None = None

    def angles(self, invariant: bool) -> tuple[Array, Array, Array]:
        """`q`, `v`, `a` with phi; `invariant`: the layout's."""
        if not invariant:
            return self.q, self.v, self.a
        q, v = from_turning(self.q, self.v)
        return q, v, with_last(self.a, self.a[5] - turning_lead_acceleration(q, v, self.a))


def vector_field(t: Float[Array, ""], y: Float[Array, " d"], system: System) -> Float[Array, " d"]:
    """dy/dt, as `diffrax.ODETerm` takes it."""
    return relative_field(t, y, system, system.reference(t))


@eqx.filter_jit  # a function of its own within any program: all that ask for it trace it once
def relative_field(
    t, y, system: System, reference: Reference, applied: Float[Array, "6 m"] | None = None
) -> Float[Array, " d"]:
    """dy/dt where y is measured from the spin `reference` = (angle, speed, acceleration).

    `applied`: further generalized forces on the nodes of stations with mass.
    """
    u, s, z = unpack(t, y, system, reference)
    ev = _evaluate(t, u, s, z, system, reference, outputs=False, applied=applied)
    return _flat_rates(s, ev, system, reference)


def watched_field(
    t: Float[Array, ""], y: Float[Array, " d"], system: System
) -> tuple[Float[Array, " d"], "Evaluation"]:
    """`vector_field` and `evaluate` at once."""
    reference = system.reference(t)
    u, s, z = unpack(t, y, system, reference)
    ev = _evaluate(t, u, s, z, system, reference, outputs=True)
    return _flat_rates(s, ev, system, reference), ev


def _flat_rates(s: Array, ev: "Evaluation", system: System, reference: Reference) -> Array:
    free = system.layout.free
    n = 6 * system.layout.n_mass
    a = _add_spin(ev.a[:, : n // 6], -reference[2], system).ravel()
    rates = s.ravel()
    if len(free) < n:
        a, rates = picked(a, free), picked(rates, free)
    return _join(rates, a, ev.rates)


def jacobian(system: System, speed: Float[Array, ""]) -> Float[Array, "d d"]:
    """∂(dy/dt)/∂y of the undeformed line turning at a constant common `speed` (rad/s)."""
    zero = jnp.zeros_like(speed)
    reference = (zero, speed, zero)
    y = _join(jnp.zeros(2 * len(system.layout.free)), initial_states(system))
    return columns(lambda y: relative_field(zero, y, system, reference), y)[0]


def jacobians(system: System, speeds: Float[Array, " s"]) -> Float[Array, "s d d"]:
    """`jacobian` at each of the speeds (rad/s)."""
    return jax.lax.map(lambda w: jacobian(system, w), speeds)


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


class Instant(NamedTuple):
    """Coordinates, rates, accelerations and forces (without inertia) of all nodes, driven ends last (of these
    no forces), (6, n); internal states."""

    q: Array
    v: Array
    a: Array
    forces: Array
    states: Array


def rates_at(
    t: Float[Array, ""], y: Float[Array, " d"], system: System
) -> tuple[Float[Array, " d"], Instant]:
    """`vector_field`, and what holds at the nodes."""
    reference, m = system.reference(t), system.layout.n_nodes
    u, s, z = unpack(t, y, system, reference)
    ev = _evaluate(t, u, s, z, system, reference, outputs=False)
    q, v = (x[:, :m] for x in ev.nodes)
    if system.layout.n_ground:
        given = system.given(t, reference)
        q, v = (jnp.concatenate(pair, axis=1) for pair in zip((q, v), given))
    a = _node_accelerations(t, ev.q, ev.v, ev.a, system, reference)
    assert ev.forces is not None
    return _flat_rates(s, ev, system, reference), Instant(q, v, a, ev.forces[:, :m], z)


@eqx.filter_jit  # as `relative_field`
def net_loads(
    y: Float[Array, " d"], system: System, reference: Reference
) -> tuple[Float[Array, " f"], Float[Array, " k"]]:
    """At t = 0: the generalized loads on the free coordinates (N, N·m), and the internal states' rates."""
    ev = evaluate(jnp.zeros(()), y, system, reference)
    return ev.loads.ravel()[np.array(system.layout.free, int)], ev.rates


@eqx.filter_jit  # as `relative_field`
def rates_and_loads(
    t, y, system: System, reference: Reference, applied: Float[Array, "6 m"]
) -> tuple[Float[Array, " d"], Float[Array, " f"], Float[Array, " k"]]:
    """`relative_field`, and what a steady state has none of: the generalized loads on the free coordinates
    (N, N·m), and the internal states' rates."""
    u, s, z = unpack(t, y, system, reference)
    ev = _evaluate(t, u, s, z, system, reference, outputs=False, applied=applied)
    loads = ev.loads.ravel()[np.array(system.layout.free, int)]
    return _flat_rates(s, ev, system, reference), loads, ev.rates


def on_nodes(system: System, force: Float[Array, " n"]) -> Float[Array, "6 m"]:
    """Forces on the free coordinates, as the vector field takes them."""
    layout = system.layout
    component, station = np.divmod(np.array(layout.free, int), layout.n_mass)
    return jnp.zeros((6, layout.n_nodes)).at[component, station].set(force)


def initial_states(system: System) -> Float[Array, " k"]:
    parts = [actor.call("initial").ravel() for actor in system.actors if actor.has_states]
    return _join(*parts)


def pack(
    q: Array, v: Array, states: Array, system: System, reference: Reference
) -> Float[Array, " d"]:
    """The flat state of stations' coordinates `q`, `v` (6, n_mass), internal order."""
    phi, w, _ = reference
    index = np.array(system.layout.free, dtype=int)
    u, s = (_add_spin(x, -r, system).ravel()[index] for x, r in ((q, phi), (v, w)))
    return _join(u, s, states)


def unpack(t, y, system: System, reference: Reference) -> tuple[Array, Array, Array]:
    """Relative coordinates and rates (6, n_mass), held ones filled in, and internal states."""
    layout = system.layout
    held = layout.held
    n, f = 6 * layout.n_mass, n_free(system)
    u, s, z = y[:f], y[f : 2 * f], y[2 * f :] if y.size > 2 * f else jnp.zeros(0)
    if held:
        given = [system.held_motion(m, t, reference) for m in held.values()]
        spin: Any = np.array([p // layout.n_mass == 5 for p in held], float)
        if system.turn is not None:
            spin = spin * system.turn[np.array([p % layout.n_mass for p in held])]
        at, still = np.argsort(np.array([*layout.free, *held])), 0.0 * t
        u, s = (
            picked(_join(x, jnp.stack([g[i] + still for g in given]) - spin * reference[i]), at)
            for i, x in enumerate((u, s))
        )
    return u.reshape(6, n // 6), s.reshape(6, n // 6), z


def n_free(system: System) -> int:
    return len(system.layout.free)


def station_motions(
    t, y, system: System, reference: Reference | None = None
) -> tuple[Array, Array]:
    """Coordinates and rates (6, n) of every station, driven ends behind, and last those that follow others;
    with phi; no force is looked at."""
    layout = system.layout
    nodes = layout.n_nodes
    reference = system.reference(t) if reference is None else reference
    u, s, _ = unpack(t, y, system, reference)
    q, v = _add_spin(u, reference[0], system), _add_spin(s, reference[1], system)
    if system.condensed is not None:
        N, V = node_motions(t, y, system, reference)
        q, v = (jnp.concatenate([x, y[:, nodes:]], axis=1) for x, y in ((q, N), (v, V)))
    elif layout.n_ground:
        given = system.given(t, reference)
        q, v = (jnp.concatenate(pair, axis=1) for pair in zip((q, v), given))
    return from_turning(q, v) if layout.invariant else (q, v)


def node_motions(t, y, system: System, reference: Reference | None = None) -> tuple[Array, Array]:
    """Coordinates and rates (6, n) of every node, of driven ends, and of stations that follow others."""
    reference = system.reference(t) if reference is None else reference
    u, s, _ = unpack(t, y, system, reference)
    q, v = _add_spin(u, reference[0], system), _add_spin(s, reference[1], system)
    shift, shift_t, _ = ports(q, v, system)
    N, V = spread(q, system.layout, shift), spread(v, system.layout, shift_t)
    if system.layout.n_ground:
        qg, vg, _ = system.given(t, reference)
        N, V = jnp.concatenate([N, qg], axis=1), jnp.concatenate([V, vg], axis=1)
    return with_followers(N, V, system)


def _evaluate(
    t, u, s, z, system: System, reference, outputs: bool, applied: Array | None = None
) -> Evaluation:
    layout = system.layout
    phi, w, _ = reference
    n, m, g = layout.n_mass, layout.n_nodes, layout.n_ground
    q, v = _add_spin(u, phi, system), _add_spin(s, w, system)

    # nodes: relative motion for the assembled part, absolute for force laws
    shift, shift_t, pull = ports(q, v, system)
    if shift is not None and shift_t is not None and system.turn is not None:
        # what a port behind gears turns with the reference is not its station's
        owners = np.array(layout.node_station)
        more = system.turn[:m] - system.turn[owners]
        shift = with_last(shift, shift[5] - more * phi)
        shift_t = with_last(shift_t, shift_t[5] - more * w)
    U, S = spread(u, layout, shift), spread(s, layout, shift_t)
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
    if system.condensed is not None:
        extra.append([(system.condensed.nodes, system.condensed.forces(N, V))])
    Q = _gather(Q, [e for e in extra if e is not None], count)
    if system.mass is not None:
        Q = Q + system.mass.weight[:, :count]

    if applied is not None:
        Q = Q.at[:, :m].add(applied)

    # what reaches the stations, then each kind's own acceleration
    on_stations = Q[:, :n]
    if pull is not None:
        on_stations = pull(Q[:, :m])
    inertia = answer = None
    if system.mass is None:
        a, reaction, loads = accelerate(t, q, v, on_stations, system, reference)
    else:
        free, mobility = mobilise(t, q, v, on_stations, system, reference)
        a, reaction, loads = free
        given = ag if g and N.shape[1] > m else jnp.zeros((6, 0))
        coupled = couple(t, q, v, (N, V, Q), a, mobility, given, system, reference)
        a, inertia, answer = coupled.acceleration, coupled.inertia_force, coupled.answer
        if outputs:
            reaction = coupled_reaction(t, q, v, on_stations, coupled, reaction, system, reference)
    rates = _rates(t, N, V, a, q, v, z, system, reference)
    if outputs and g:
        q, v, a = (jnp.concatenate(pair, axis=1) for pair in ((q, qg), (v, vg), (a, ag)))
        on_ground = -Q[:, m:] if inertia is None else inertia[:, m:] - Q[:, m:]
        reaction = jnp.concatenate([reaction, on_ground], axis=1)
    if outputs and system.condensed is not None:
        at_nodes = with_followers(N, V, system)
        q, v = (jnp.concatenate([x, y[:, m + g :]], axis=1) for x, y in zip((q, v), at_nodes))
        A = _node_accelerations(t, q[:, :n], v[:, :n], a[:, :n], system, reference)
        a = jnp.concatenate([a, system.condensed.followers(A)], axis=1)
        reaction = jnp.pad(reaction, ((0, 0), (0, layout.n_followers)))
        N, V = at_nodes
    return Evaluation(q, v, a, (N, V), loads, reaction, z, rates, answer, Q)


def _act(t, actor: Actor, N: Array, V: Array, z: Array):
    """Forces of one stacked force law: a list of (6, members), one for each end, with its nodes."""
    time, axis = clock(t, actor.late)
    axes = -1, axis, -1, -1
    forces = jax.vmap(lambda e, t, m, s: e.forces(t, m, s), in_axes=axes, out_axes=-1)(
        actor.element, time, actor.motions(N, V), actor.own_states(z)
    )
    return None if forces is None else list(zip(actor.nodes, forces))


def _gather(Q: Array, extra: list, count: int) -> Array:
    """Adds forces to the columns of their nodes, but for those behind the first `count`."""
    for nodes, force in (pair for group in extra for pair in group):
        inside = [i for i, node in enumerate(nodes) if node < count]
        if inside:
            own = force if len(inside) == len(nodes) else picked(force, inside)
            Q = Q + placed_columns(own, [nodes[i] for i in inside], count)
    return Q


def _ground_acts(system: System) -> bool:
    """Whether a force law or a shaft with mass holds at a driven end."""
    m = system.layout.n_nodes
    if system.mass is not None and system.mass.touches_ground:
        return True
    return any(n >= m for a in system.actors for end in a.nodes for n in end)


def with_followers(N: Array, V: Array, system: System) -> tuple[Array, Array]:
    """Coordinates and rates (6, n) of all nodes, with those of stations that follow others behind; in a spin
    that all share or as they are."""
    condensed = system.condensed
    if condensed is None:
        return N, V
    following = condensed.followers(N) + condensed.sag, condensed.followers(V)
    return tuple(jnp.concatenate(pair, axis=1) for pair in zip((N, V), following))  # pyright: ignore


def _node_accelerations(t, q, v, a, system: System, reference: Reference) -> Array:
    """Of all nodes, driven ends last; `q`, `v`, `a` of stations with mass."""
    layout = system.layout
    A = a
    if layout.ports or layout.n_nodes > layout.n_mass:

        def velocity(q, v):
            return jax.jvp(lambda p: spread(p, layout, shift_of(p, system)), (q,), (v,))[1]

        A = jax.jvp(velocity, (q, v), (v, a))[1]
    if layout.n_ground:
        A = jnp.concatenate([A, system.given(t, reference)[2]], axis=1)
    return A


def _rates(t, N, V, a, q, v, z, system: System, reference: Reference) -> Array:
    """Derivatives of the internal states, after the accelerations."""
    stateful = [actor for actor in system.actors if actor.has_states]
    if not stateful:
        return jnp.zeros(0)
    A = _node_accelerations(t, q, v, a, system, reference)
    out = []
    for actor in stateful:
        accelerations = tuple(picked(A, nodes) for nodes in actor.nodes)
        time, axis = clock(t, actor.late)
        axes = -1, axis, -1, -1, -1
        out.append(
            jax.vmap(lambda e, t, m, b, s: e.rates(t, m, b, s), in_axes=axes, out_axes=-1)(
                actor.element, time, actor.motions(N, V), accelerations, actor.own_states(z)
            ).ravel()
        )
    return jnp.concatenate(out)
