"""The system: a machine stacked and assembled, once a solve, inside jit."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.picked import picked
from ..core.protocol import AbstractPrescribed, Acting, Linear, Nominal, Stateful, Timed
from ..profiles.motion import AbstractMotion, differentiate
from .condensed import Condensed, CondensedMatrices, condense
from .layout import Layout, joined, lay_out
from .lineup import Block, Lineup, line_up, stack
from .machine import Machine
from .mass import CoupledMass, assemble_mass, inertials
from .placing import placed
from .speed_ratios import turning

# Angle, speed and acceleration of the spin that coordinates are measured from.
Reference = tuple[Array, Array, Array]


class Actor(eqx.Module):
    """Stacked elements with a force law (or states) of their own, and the nodes of each end.

    `late`: how far the clock of each runs behind the machine's, s (see `_apart`).
    """

    element: Any
    nodes: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    states: tuple[int, int] = eqx.field(static=True)  # first and last+1 row among internal states
    late: Float[Array, " members"] | None = None

    def call(self, method: str, *args, **kwargs):
        """`element.method(...)` mapped over the stack, which is the last axis everywhere."""
        return jax.vmap(lambda e, a: getattr(e, method)(*a), in_axes=-1, out_axes=-1, **kwargs)(
            self.element, args
        )

    @property
    def has_states(self) -> bool:
        return self.states[1] > self.states[0]

    def motions(self, N: Array, V: Array) -> tuple[tuple[Array, Array], ...]:
        """Of each end the coordinates and rates (6, members), of those of all nodes."""
        return tuple((picked(N, nodes), picked(V, nodes)) for nodes in self.nodes)

    def own_states(self, z: Array) -> Float[Array, "k members"] | None:
        """Of all internal states."""
        if not self.has_states:
            return None
        return z[slice(*self.states)].reshape(-1, len(self.nodes[0]))


def clock(t: Array, late: Float[Array, " members"] | None) -> tuple[Array, int | None]:
    """The time at elements so `late`, and its axis: at each where some run late, else one for all."""
    return (t, None) if late is None else (t - late, -1)


class System(eqx.Module):
    """Everything that the vector field needs.

    `moving` is `-[K C]` of the nodes on stations with mass; `whole` has the driven ends too (they
    matter for the reactions, and for the field where a driven end does more than spin).
    `condensed`: what stands for shafts with inner stations that follow others.
    `spin` holds the generalized forces of a common unit angle and a common unit speed. `turn`: speed
    of each node over the reference's, where gears make them differ. `mass`: shafts with mass.
    """

    layout: Layout = eqx.field(static=True)
    # first and last+1 of the internal states of each group of stations, then of connectors
    rows: tuple[tuple[int, int], ...] = eqx.field(static=True)
    # of each group, which actor it is
    acting: tuple[int | None, ...] = eqx.field(static=True)
    stations: tuple[Any, ...]
    ground: tuple[AbstractPrescribed, ...]
    motions: tuple[AbstractMotion, ...]
    actors: tuple[Actor, ...]
    gravity: Float[Array, "3"]
    moving: Float[Array, "m m2"]
    whole: Float[Array, "n n2"]
    spin: Float[Array, "n 2"]
    turn: Float[Array, " k"] | None
    mass: CoupledMass | None
    # elements that answer to accelerations, as `CoupledMass.answering` counts them
    inertial: tuple[Actor, ...]
    condensed: Condensed | None

    def reference(self, t: Float[Array, ""]) -> tuple[Array, Array, Array]:
        """Angle, speed and acceleration of the spin that the coordinates are measured from.

        phi grows to thousands of turns: measured from the drive it stays small, which tolerances and
        rounding need. A machine without a given spin is measured from zero.
        """
        if self.ground:
            return differentiate(lambda s: self.ground[0].motion(s)[5], t)
        if self.lead is not None:
            return differentiate(self.motions[self.lead].position, t)
        zero = jnp.zeros_like(t)
        return zero, zero, zero

    def turns(self) -> Float[Array, " n"]:
        """How many times as fast as the reference each station turns where nothing twists, in the order of
        the machine; negative against it."""
        internal = np.array(self.layout.internal)
        if self.turn is None:
            return jnp.ones(internal.size)
        # driven ends stand behind all nodes
        behind = self.layout.n_nodes - self.layout.n_mass
        return self.turn[np.where(internal >= self.layout.n_mass, internal + behind, internal)]

    @property
    def lead(self) -> int | None:
        """The given motion of a phi that the spin is measured from, where there is no driven end."""
        for group in self.layout.stations:
            for motions in group.motions:
                for c, motion in zip(group.held, motions):
                    if c == 5 and motion >= 0 and not self.ground:
                        return motion
        return None

    def held_motion(self, motion: int, t: Array, reference) -> tuple[Array, Array, Array]:
        """Coordinate, rate and acceleration of what is held: zero for `motion` -1. What the spin is
        measured from follows `reference`, whatever that is."""
        zero = jnp.zeros_like(t)
        if motion < 0:
            return zero, zero, zero
        if motion == self.lead:
            return tuple(x + zero for x in reference)  # pyright: ignore
        return differentiate(self.motions[motion].position, t)

    def given(self, t: Float[Array, ""], reference) -> tuple[Array, Array, Array]:
        """Coordinates, rates and accelerations of the driven ends, each (6, n_ground).

        The end that the spin is measured from follows `reference`, whatever that is.
        """
        parts = []
        for k, ground in enumerate(self.ground):
            if k == 0 and type(ground).spin_only:
                parts.append([jnp.zeros(6).at[5].set(r) for r in reference])
            else:
                parts.append(differentiate(ground.motion, t))
        # each by itself: linear analysis asks what depends on the speed
        q, v, a = (jnp.stack(each, axis=-1) for each in zip(*parts))
        return q, v, a

    @property
    def quiet_ground(self) -> bool:
        """Whether the driven ends add nothing to the field beyond the reference spin."""
        return not self.ground or (len(self.ground) == 1 and type(self.ground[0]).spin_only)

    def n_states(self) -> int:
        return max((a.states[1] for a in self.actors), default=0)


def _balanced(block: Block) -> Block:
    """Without what turns with the shaft."""
    if not isinstance(block.element, Nominal):
        return block
    if block.count is None:
        return Block(block.element.nominal(), None)
    nominal = jax.vmap(lambda e: e.nominal(), in_axes=-1, out_axes=-1)
    return Block(nominal(block.element), block.count)


def assemble(machine: Machine, nominal: bool = False) -> System:
    """Fills, stacks and assembles. `nominal` leaves out what turns with the shaft."""
    return assembled(machine, line_up(machine), nominal)


def assemble_both(machine: Machine) -> tuple[System, System]:
    """The system, and the one without what turns with the shaft. What stands for shafts with inner stations
    that follow others, most of the work, is found once."""
    lineup = line_up(machine)
    nominal = _without_turning(lineup)
    actual, condensed = _put_together(machine, lineup)
    if nominal is lineup:
        return actual, actual
    return actual, _put_together(machine, nominal, (actual.layout, condensed))[0]


def assembled(machine: Machine, lineup: Lineup, nominal: bool) -> System:
    """`assemble` of what has been lined up."""
    return _put_together(machine, _without_turning(lineup) if nominal else lineup)[0]


def _without_turning(lineup: Lineup) -> Lineup:
    """Itself where nothing of it turns with the shaft."""
    blocks = (*lineup.stations, *lineup.connectors)
    if not any(isinstance(block.element, Nominal) for block in blocks):
        return lineup
    stations, connectors = (
        tuple(_balanced(block) for block in own) for own in (lineup.stations, lineup.connectors)
    )
    return Lineup(stations, connectors, lineup.wiring)


def _put_together(
    machine: Machine,
    lineup: Lineup,
    known: tuple[Layout, CondensedMatrices | None] | None = None,
) -> tuple[System, CondensedMatrices | None]:
    """`known`: of a machine that differs in what turns with the shaft alone."""
    stations = lineup.stations
    layout = lay_out(lineup)
    groups = tuple(stack([stations[b] for b in g.blocks]) for g in layout.stations)
    between, gone = joined(lineup, layout), [g.condensed for g in layout.connectors]
    own = [
        (stacked, (tuple(range(g.start, g.stop)),)) for stacked, g in zip(groups, layout.stations)
    ]
    turn = turning(layout, groups, between)
    apart = [pair for pair, condensed in zip(between, gone) if condensed]
    whole = [pair for pair, condensed in zip(between, gone) if not condensed]
    turning_too = any(isinstance(element, Nominal) for element, _ in apart)
    if known is not None and known[0] == layout and not turning_too:
        condensed = known[1]
    else:
        condensed = condense(layout, apart, machine.gravity) if apart else None
    matrices = _assemble_linear(layout, [*own, *whole], turn, condensed)
    actors, rows, acting, first = [], [], [], 0
    for (element, nodes), done in zip([*own, *between], [*[False] * len(own), *gone]):
        acting.append(None)
        if done:
            rows.append((first, first))
            continue
        count = 0
        if isinstance(element, Stateful):
            one = jax.tree.map(lambda x: x[..., 0], element)
            count = jax.eval_shape(lambda e: e.initial(), one).shape[0] * len(nodes[0])
        actor = Actor(element, nodes, (first, first + count))
        if count or (isinstance(element, Acting) and _acts(actor, count)):
            acting[-1] = len(actors)
            actors.append(actor)
        rows.append((first, first + count))
        first += count
    ground = tuple(machine.stations[i] for i in layout.ground)
    actors = _apart(actors, _given_jumps(ground, machine.motions))
    system = System(
        layout,
        tuple(rows),
        tuple(acting),
        groups,
        ground,  # pyright: ignore
        tuple(motion.prepared() for motion in machine.motions),
        tuple(actors),
        machine.gravity,
        *matrices,
        turn,
        assemble_mass(layout, groups, whole, machine.gravity, condensed),
        tuple(Actor(element, nodes, (0, 0)) for element, nodes in inertials(whole)),
        None if condensed is None else condensed.shafts,
    )
    return system, condensed


def _acts(actor: Actor, count: int) -> bool:
    """Whether the force law adds anything to the assembled matrices."""
    one = jax.tree.map(lambda x: x[..., 0], actor.element)
    motions = tuple((jnp.zeros(6), jnp.zeros(6)) for _ in actor.nodes)
    per = count // max(1, len(actor.nodes[0]))
    state = jnp.zeros(per) if count else None
    shapes = jax.eval_shape(lambda e: e.forces(jnp.zeros(()), motions, state), one)
    return shapes is not None


def _assemble_linear(
    layout: Layout, parts, turn, condensed: CondensedMatrices | None
) -> tuple[Array, Array, Array]:
    """One scatter for each kind, into K and C over all nodes, driven ends last."""
    m, n = layout.n_nodes, layout.n_nodes + layout.n_ground
    both = [
        (jax.vmap(lambda e: e.matrices(), in_axes=-1, out_axes=-1)(element), nodes)
        for element, nodes in parts
        if isinstance(element, Linear)
    ]
    if condensed is not None:
        both.append(((condensed.K[..., None], condensed.C[..., None]), condensed.ends))
    K, C = (placed(((pair[i], nodes) for pair, nodes in both), n) for i in (0, 1))
    moving = -jnp.concatenate(
        [K[:, :m, :, :m].reshape(6 * m, 6 * m), C[:, :m, :, :m].reshape(6 * m, 6 * m)], axis=1
    )
    whole = -jnp.concatenate([K.reshape(6 * n, 6 * n), C.reshape(6 * n, 6 * n)], axis=1)
    turn = jnp.ones(n) if turn is None else turn[:n]
    about = [-(X[:, :, 5] @ turn).ravel() for X in (K, C)]
    spin = jnp.stack(about, axis=1)
    return moving, whole, spin


def jump_times(system: System) -> Float[Array, " n"]:
    """Every instant at which some element's force jumps, unsorted."""
    parts = [jnp.zeros(0), _given_jumps(system.ground, system.motions)]
    for actor in system.actors:
        if isinstance(actor.element, Timed):
            times = actor.call("times")
            parts.append((times if actor.late is None else times + actor.late).ravel())
    return jnp.concatenate(parts)


def _given_jumps(ground, motions) -> Float[Array, " n"]:
    parts = [end.times() for end in ground if isinstance(end, Timed)]
    return jnp.concatenate([jnp.zeros(0), *parts, *(motion.jumps() for motion in motions)])


# What instants of different elements differ by at least, in spacings of floats: adaptive solvers come out of
# a shorter interval by so many ever longer steps that rounding spoils the derivative.
_GAP = 4096


def _apart(actors: list[Actor], given: Float[Array, " n"]) -> list[Actor]:
    """Elements that jump at one instant are made to jump one after another, 1e-12 of the time apart.

    The derivative by an instant is what its own element's jump does: seen together, the jumps of two
    elements could not be told apart.
    """
    timed = [i for i, actor in enumerate(actors) if isinstance(actor.element, Timed)]
    times = {i: actors[i].call("times") for i in timed}
    timed = [i for i in timed if times[i].size]
    if not timed or (len(timed) == 1 and times[timed[0]].shape[-1] == 1 and not given.size):
        return actors
    owner, count = [np.zeros(given.size, int)], 1
    for i in timed:
        members = times[i].shape[-1]
        owner.append(np.broadcast_to(count + np.arange(members), times[i].shape).ravel())
        count += members
    owner = np.concatenate(owner)
    every = jnp.concatenate([given, *(times[i].ravel() for i in timed)])
    every = jax.lax.stop_gradient(every)
    size = jnp.max(jnp.where(jnp.isfinite(every), jnp.abs(every), 0.0))
    gap = _GAP * jnp.exp2(jnp.ceil(jnp.log2(jnp.maximum(size, 1e-3))) - 53)
    close = (jnp.abs(every[:, None] - every) < gap) & (owner[:, None] != owner)
    tied = jnp.zeros(count, bool).at[owner].max(jnp.any(close, axis=1))
    late = jnp.where(tied, gap * jnp.arange(count), 0.0)
    actors, first = list(actors), 1
    for i in timed:
        members = times[i].shape[-1]
        actors[i] = Actor(
            actors[i].element, actors[i].nodes, actors[i].states, late[first : first + members]
        )
        first += members
    return actors
