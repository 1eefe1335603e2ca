"""Slopes of the accelerations by parts: what depends on one station alone is differentiated for all stations
at once, what hangs together is linear with constant matrices. Of a large machine that is a small part of
what a tangent for each state takes.

With the forces of inertia f of shafts with mass on the other side, the acceleration of a station depends on
its own motion and the force on it alone, `a = acc(q, v, Q - f)`; where its inertia is the shafts', `f = Q`.
So `E (s', z') = B (u, s, z)'`.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.picked import picked, placed_columns
from .acceleration import accelerate
from .between import Between, Local, between, by_itself, free_of, on_rows, placed_between
from .field import Instant, n_free, rates_at
from .inertia_slopes import inertia_slopes
from .system import Actor, System, clock
from .turning_slopes import TurningSlopes


class SlopesByParts(eqx.Module):
    """What of them is constant. `stiffness`, `damping`: less of both, of all that is linear."""

    system: System
    stiffness: Between
    damping: Between
    mass: Between | None
    turning: TurningSlopes | None

    @classmethod
    def of(cls, system: System) -> "SlopesByParts":
        m, matrix = system.layout.n_nodes, system.moving
        K, C = (between(x, m) for x in (matrix[:, : 6 * m], matrix[:, 6 * m :]))
        mass = None if system.mass is None else between(system.mass.mass, m)
        turning = None if system.condensed is None else TurningSlopes.of(system.condensed, m)
        return cls(system, K, C, mass, turning)

    @staticmethod
    def serve(system: System) -> bool:
        """Not where a station has several nodes, nor where forces answer to accelerations."""
        layout = system.layout
        one_each = not layout.ports and layout.n_nodes == layout.n_mass
        return one_each and not system.inertial

    def __call__(
        self, t: Float[Array, ""], y: Float[Array, " d"]
    ) -> tuple[Float[Array, "r r"], Float[Array, "r d"], Float[Array, " r"]]:
        """E, B, and E times what the rates below the coordinates' change by with time."""
        system, m = self.system, self.system.layout.n_nodes
        _, by_time, at = jax.jvp(
            lambda t: rates_at(t, y, system), (t,), (jnp.ones_like(t),), has_aux=True
        )
        acting = [_acting(t, at, actor) for actor in system.actors]
        by_q, by_v = self.stiffness, self.damping
        if self.turning is not None:
            q_too, v_too = self.turning(at.q[:, :m], at.v[:, :m])
            by_q, by_v = by_q + q_too, by_v + v_too
        for actor, slopes in zip(system.actors, acting):
            q_too, v_too = _on_nodes(actor, slopes.forces, m)
            by_q, by_v = by_q + q_too, by_v + v_too
        force, by_a = at.forces, None
        if system.mass is not None and self.mass is not None:
            felt, q_less, v_less, by_a = inertia_slopes(system.mass, self.mass, at.q, at.v, at.a)
            force, by_q, by_v = force - felt, by_q - q_less, by_v - v_less
        alone_q, alone_v, mobility = self._alone(t, at, force)
        E = by_itself(jnp.asarray(np.eye(6)[..., None] * ~self._carried()))
        if by_a is not None:
            E = E + on_rows(mobility, by_a)
        Bq = by_itself(alone_q) + on_rows(mobility, by_q)
        Bv = by_itself(alone_v) + on_rows(mobility, by_v)
        free = system.layout.free
        E, Bq, Bv = (free_of(x, free) for x in (E, Bq, Bv))
        B = jnp.concatenate([Bq, Bv], axis=1)
        if at.states.size:
            E, B = _with_states(system, mobility, acting, E, B)
        return E, B, E @ by_time[n_free(system) :]

    def _carried(self) -> np.ndarray:
        groups = self.system.layout.stations
        return np.concatenate([np.full(g.stop - g.start, g.carried) for g in groups])

    def _alone(self, t, at: Instant, force: Array) -> tuple[Local, Local, Local]:
        """Of the stations' own accelerations, by their coordinates, rates and the forces on them; of
        stations whose inertia is the shafts', by the forces that they pass on."""
        system, n = self.system, self.system.layout.n_mass
        reference = system.reference(t)

        def own(q, v, Q):
            return accelerate(t, q, v, Q, system, reference)[0]

        _, slope = jax.linearize(own, at.q[:, :n], at.v[:, :n], force)
        every = jnp.eye(18)[:, :, None] + jnp.zeros(n)
        found = jax.vmap(lambda d: slope(d[:6], d[6:12], d[12:]), out_axes=1)(every)
        by_q, by_v, mobility = found[:, :6], found[:, 6:12], found[:, 12:]
        return by_q, by_v, jnp.where(self._carried(), np.eye(6)[..., None], mobility)


class _Slopes(eqx.Module):
    """Of a stack of elements, members last: of the forces on all ends by coordinates and rates of all ends
    and internal states, `(6 ends, 12 ends + states, members)`; of the states' rates by these and the
    accelerations at all ends."""

    forces: Array | None
    rates: Array | None


def _acting(t, at: Instant, actor: Actor) -> _Slopes:
    nodes, states = actor.nodes, actor.own_states(at.states)
    per = 0 if states is None else states.shape[0]
    motion = [x for end in actor.motions(at.q, at.v) for x in end]
    time, axis = clock(t, actor.late)

    def parts(x):
        motions = tuple(
            (x[12 * i : 12 * i + 6], x[12 * i + 6 : 12 * i + 12]) for i in range(len(nodes))
        )
        return motions, x[12 * len(nodes) : 12 * len(nodes) + per]

    def forces(e, t, x):
        motions, own = parts(x)
        found = e.forces(t, motions, own if per else None)
        return None if found is None else jnp.concatenate(found)

    def rates(e, t, x):
        motions, own = parts(x)
        rest = x[12 * len(nodes) + per :]
        accelerations = tuple(rest[6 * i : 6 * i + 6] for i in range(len(nodes)))
        return e.rates(t, motions, accelerations, own)

    def slopes(function, x):
        def one(e, t, x):
            return jax.jacfwd(lambda x: function(e, t, x))(x)

        return jax.vmap(one, in_axes=(-1, axis, -1), out_axes=-1)(actor.element, time, x)

    x = jnp.concatenate(motion if states is None else [*motion, states])
    acts = jax.eval_shape(
        jax.vmap(forces, in_axes=(-1, axis, -1), out_axes=-1), actor.element, time, x
    )
    of_rates = None
    if per:
        of_rates = slopes(rates, jnp.concatenate([x, *(picked(at.a, end) for end in nodes)]))
    return _Slopes(None if acts is None else slopes(forces, x), of_rates)


def _on_nodes(actor: Actor, slopes: Array | None, m: int) -> tuple[Any, Any]:
    """What forces change by with coordinates and rates of nodes."""
    by: list[Any] = [0.0, 0.0]
    if slopes is None:
        return by[0], by[1]
    for i, rows in enumerate(actor.nodes):
        for j, columns in enumerate(actor.nodes):
            for k in range(2):
                first = 12 * j + 6 * k
                own = slopes[6 * i : 6 * i + 6, first : first + 6]
                by[k] = by[k] + placed_between(own, rows, columns, m)
    return by[0], by[1]


def _with_states(
    system: System, mobility: Local, acting: list[_Slopes], E: Array, B: Array
) -> tuple[Array, Array]:
    """Rows and columns of the internal states too."""
    m, free = system.layout.n_nodes, system.layout.free
    across, down, beside = [], [], []
    for actor, slopes in zip(system.actors, acting):
        ends, count = len(actor.nodes), len(actor.nodes[0])
        size = actor.states[1] - actor.states[0]
        if not size:
            continue
        of_states = slice(12 * ends, 12 * ends + size // count)
        across.append(jnp.zeros((6, m, size)))
        if slopes.forces is not None:
            for i, rows in enumerate(actor.nodes):
                own = slopes.forces[6 * i : 6 * i + 6, of_states]
                across[-1] += _by_states(own, rows, m)
        assert slopes.rates is not None
        row = [jnp.zeros((size, 6 * m))] * 3
        for j, columns in enumerate(actor.nodes):
            firsts = 12 * j, 12 * j + 6, of_states.stop + 6 * j
            for k, first in enumerate(firsts):
                own = slopes.rates[:, first : first + 6].transpose(1, 0, 2)
                own = _by_states(own, columns, m).reshape(6 * m, size).T
                row[k] = row[k] + own
        down.append([picked(x, free) for x in row])
        own = slopes.rates[:, of_states][..., None] * np.eye(count)
        own = own.transpose(0, 2, 1, 3).reshape(size, size)
        beside.append(
            jnp.pad(own, ((0, 0), (actor.states[0], system.n_states() - actor.states[1])))
        )
    on = [mobility[:, i, :, None] * jnp.concatenate(across, axis=2)[i] for i in range(6)]
    by_states = sum(on[1:], on[0]).reshape(6 * m, -1)
    by_states = picked(by_states.T, free).T
    by_q, by_v, by_a = (jnp.concatenate(x) for x in zip(*down))
    E = jnp.concatenate([E, jnp.zeros((len(free), system.n_states()))], axis=1)
    E = jnp.concatenate([E, jnp.concatenate([-by_a, np.eye(system.n_states())], axis=1)])
    B = jnp.concatenate([B, by_states], axis=1)
    rest = jnp.concatenate([by_q, by_v, jnp.concatenate(beside)], axis=1)
    return E, jnp.concatenate([B, rest])


def _by_states(own: Float[Array, "6 s k"], nodes: tuple[int, ...], m: int) -> Float[Array, "6 m z"]:
    """Slopes of members' six by their own states, of nodes by all states as they stand."""
    s, count = own.shape[1:]
    inside = [k for k in range(count) if nodes[k] < m]
    at = [nodes[k] * count + k for k in inside]
    placed = placed_columns(picked(own, inside), at, m * count)
    return placed.reshape(6, s, m, count).transpose(0, 2, 1, 3).reshape(6, m, s * count)
