"""Accelerations where shafts with mass make them hang together.

One solve over the stations with inertia of their own that such a shaft touches (owners):
`(I + P T' Mc T) a = a0 - P (...)`, P their mobility, Mc the mass of the shafts condensed to them.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.elimination import solution
from ..core.kinematics import with_last
from ..core.picked import picked, placed_columns
from .mass import CoupledMass


def spin_by_tilts(q: Array, v: Array, invariant: bool) -> tuple[Array, Array, Array]:
    """b and d above, and what the spin's rate has beyond `a_5 + b a_3 + d a_4`, (n,) each."""
    convective = v[3] * v[4] * jnp.cos(q[4])
    if invariant:
        return jnp.sin(q[4]) - 0.5 * q[4], -0.5 * q[3], convective - v[3] * v[4]
    return jnp.sin(q[4]), jnp.zeros_like(q[3]), convective


class Coupled(eqx.Module):
    """Accelerations of all stations (6, n_mass), and the inertia force of the shafts on each node
    (6, n) and on each of the `owners` (6, owners). `answer`: the forces of what is `Inertial`, (6, members),
    the sixth conjugate to the spin; they count among the inertia forces."""

    acceleration: Array
    inertia_force: Array
    on_owners: Array
    answer: Array | None


def solve_coupled(mass: CoupledMass, q, v, Q, given, a, mobility, maps, inertia=None) -> Coupled:
    """**Arguments:**

    - `q`, `v`, `Q`, `given`: of all nodes (6, n): coordinates, rates, generalized forces (weight of
      the shafts among them), and the accelerations of what is given (elsewhere anything).
    - `a`: accelerations of all stations (6, n_mass) if no shaft had mass.
    - `mobility`: (6, 6, owners), their acceleration per unit force.
    - `maps`: how the coordinates of `mass.nodes` follow those of their stations: J (6, 6, nodes), and
      J's rate times v (6, nodes); `None` where they are the same.
    - `inertia`: (6, 6, members) of what is `Inertial`.
    """
    n, n_mass = q.shape[1], a.shape[1]
    cos = jnp.cos(q[4])
    b, d, convective = spin_by_tilts(q, v, mass.invariant)
    momentum = mass.spin_rows @ with_last(v, v[5] + b * v[3] + d * v[4]).ravel()
    zero = jnp.zeros_like(cos)
    gyro = jnp.stack([zero, zero, zero, cos * v[4] * momentum, -cos * v[3] * momentum, zero])

    def hat_acceleration(a):
        return with_last(a, a[5] + b * a[3] + d * a[4] + convective)

    force = Q - gyro
    on_tilts = force[3] - b * Q[5], force[4] - d * Q[5]
    force = jnp.stack([force[0], force[1], force[2], *on_tilts, Q[5]])
    at_rest = _of(mass.given, hat_acceleration(given))
    right = _of(mass.carried, force) - mass.carried_given @ at_rest
    # unknown: accelerations of the owners, and forces that accelerations decide (`_Links`)
    k, owners = (np.array(x, int) for x in (mass.nodes, mass.owners))
    touch = _Touch.of(mass, b, d, maps)
    extra = jnp.zeros((6, len(k))) if maps is None else maps[1]
    extra = with_last(extra, touch.turned(extra) + picked(convective, k)).T.ravel()
    turning = touch.on_owners(picked(gyro, k).T.ravel(), hat=False)
    pull = mass.passed_on @ right + mass.own_given @ at_rest + mass.condensed @ extra
    size = 6 * len(owners)

    per = jnp.unstack(mobility.transpose(1, 2, 0))

    def moved_by(forces: Array) -> Any:
        own = jnp.unstack(_six(forces), axis=1)
        parts = [a[:, :, None] * f[:, None] for a, f in zip(per, own)]
        return sum(parts[1:], parts[0]).reshape(forces.shape)

    reduced = touch.on_owners(touch.on_owners(mass.condensed).T)
    alone = picked(a, owners).T.ravel() - moved_by(touch.on_owners(pull) + turning)
    matrix, unknown = np.eye(size) + moved_by(reduced), alone
    links, push = _links(mass, n, b, d, convective, given, inertia, at_rest), jnp.zeros(())
    if links is not None:
        push = _times(touch.on_owners(mass.passed_on), links.on_carried.T)
        there = links.on_carried @ (mass.inverse @ right - extra @ mass.passed_on)
        if links.on_nodes is not None:
            push = push - touch.on_owners(jnp.asarray(links.on_nodes.T))
            there = there + links.on_nodes @ extra
        carried = _times(_times(mass.inverse, links.on_carried.T).T, links.on_carried.T)
        upper = jnp.concatenate([matrix, moved_by(push)], axis=1)
        lower = jnp.concatenate([links.by(-push.T), links.own + links.by(carried)], axis=1)
        matrix = jnp.concatenate([upper, lower])
        unknown = jnp.concatenate([alone, links.right - links.by(there)])
    if unknown.size:
        unknown = solution(matrix, unknown)
    moved, forces = unknown[: alone.size], unknown[alone.size :]
    on_owners = -(touch.on_owners(pull) + turning + reduced @ moved)
    if links is not None:
        right, on_owners = right + forces @ links.on_carried, on_owners - push @ forces
    at_nodes = touch.at_nodes(moved) + extra
    at_carried = mass.inverse @ right - at_nodes @ mass.passed_on
    a = _placed(a, moved.reshape(-1, 6).T, owners)
    own = picked(a, mass.node_owners)
    if maps is not None:
        own = jnp.einsum("ijk,jk->ik", maps[0], own) + maps[1]
    whole = _placed(given, own, k)
    free = np.zeros(6 * n, bool)
    free[np.array(mass.carried, int)] = True
    free = free.reshape(6, n)
    spins = _back(mass.carried, at_carried, n)
    bent = [jnp.where(free[tilt], spins[tilt], given[tilt]) for tilt in (3, 4)]
    spins = with_last(spins, spins[5] - (b * bent[0] + d * bent[1] + convective) * free[5])
    whole = jnp.where(free, spins, whole)
    carried = sorted({i % n for i in mass.carried} | {i % n for i in mass.given if i % n < n_mass})
    a = jnp.where(np.isin(np.arange(n_mass), carried), whole[:, :n_mass], a)
    felt = (mass.mass @ hat_acceleration(whole).ravel()).reshape(6, n)
    on_tilts = [felt[3] + b * felt[5], felt[4] + d * felt[5]]
    felt = jnp.stack([*felt[:3], *on_tilts, felt[5]]) + gyro
    answer = None
    if mass.answering:
        member, coordinate, node = np.array(mass.answering, int).T
        own = forces[len(mass.bound) :]
        answer = _spread(own, coordinate, member)
        on = _spread(own, coordinate, node, n)
        tilts = [on[3] + b * on[5], on[4] + d * on[5]]
        felt = felt - jnp.stack([*on[:3], *tilts, on[5]])
    return Coupled(a, felt, on_owners.reshape(-1, 6).T, answer)


class _Touch(NamedTuple):
    """How the nodes that shafts touch follow their stations, the owners: T = B J, J by `maps`."""

    b: Array
    d: Array
    J: Array | None
    holds: np.ndarray | None  # (nodes, owners), where it is not one each

    @classmethod
    def of(cls, mass: CoupledMass, b, d, maps) -> "_Touch":
        k, owners = np.array(mass.nodes, int), np.array(mass.owners, int)
        holds = (np.array(mass.node_owners, int)[:, None] == owners).astype(float)
        # products, not slices: the sines in them would be made anew for each entry of what they enter
        of_k = (k[:, None] == np.arange(b.size)).astype(float)
        one_each = np.array_equal(holds, np.eye(len(owners)))
        return cls(of_k @ b, of_k @ d, maps and maps[0], None if one_each else holds)

    def turned(self, a: Float[Array, "6 k"]) -> Float[Array, " k"]:
        return a[5] + self.b * a[3] + self.d * a[4]

    def on_owners(self, X: Array, hat: bool = True) -> Array:
        """T' X, (6 owners, ...), of what acts on the nodes' coordinates, (6 nodes, ...); on phi in place of
        the spin where it is not `hat`."""
        x = _six(X)
        if hat:
            *along, psi, theta, turn = jnp.unstack(x, axis=1)
            tilts = psi + self.b[:, None] * turn, theta + self.d[:, None] * turn
            x = jnp.stack([*along, *tilts, turn], axis=1)
        if self.J is not None:
            x = jnp.einsum("jlk,kjn->kln", self.J, x)
        if self.holds is not None:
            x = jnp.einsum("ks,kln->sln", self.holds, x)
        return x.reshape(6 * x.shape[0], *X.shape[1:])

    def at_nodes(self, a: Float[Array, " m"]) -> Float[Array, " n"]:
        """T a, of the owners' accelerations."""
        x = a.reshape(-1, 6).T
        if self.holds is not None:
            x = x @ self.holds.T
        if self.J is not None:
            x = jnp.einsum("ijk,jk->ik", self.J, x)
        return with_last(x, self.turned(x)).T.ravel()


class _Links(NamedTuple):
    """Forces f that accelerations decide, `own f + by(a) = right`: where they act and a is, among carried
    coordinates, (u, c), and those of nodes, (u, 6 nodes); `None` where they act on no node."""

    on_carried: Array
    on_nodes: np.ndarray | None
    own: Any
    answers: Array | None
    right: Array

    def by(self, a: Array) -> Array:
        """What the accelerations (u, ...) of these places call for."""
        if self.answers is None:
            return a
        held = a.shape[0] - self.answers.shape[0]
        answered = self.answers @ a[held:]
        return jnp.concatenate([a[:held], answered]) if held else answered


def _links(mass: CoupledMass, n: int, b, d, convective, given, inertia, at_rest) -> _Links | None:
    """Moments that hold phi where a tilt is free, then forces of what is `Inertial`."""
    held = _holding(mass, n, b, d, convective, given) if mass.bound else None
    if not mass.answering:
        return None if held is None else _Links(held[0], None, np.zeros((1, 1)), None, held[1])
    member, coordinate, node = np.array(mass.answering, int).T
    place = coordinate * n + node
    on_carried: Any = (place[:, None] == np.array(mass.carried, int)).astype(float)
    k = np.array(mass.nodes, int)
    on_nodes = (node[:, None, None] == k[:, None]) & (coordinate[:, None, None] == np.arange(6))
    on_nodes = on_nodes.astype(float).reshape(place.size, 6 * k.size)
    # E of each member, row by row, on its own places
    rows = picked(inertia.transpose(1, 2, 0).reshape(6, -1), 6 * member + coordinate)
    same = (member[:, None] == member).astype(float)
    answers = (rows.T @ (np.arange(6)[:, None] == coordinate).astype(float)) * same
    still = (place[:, None] == np.array(mass.given, int)).astype(float) @ at_rest
    own, right = np.eye(place.size), -answers @ still
    if held is not None:
        zero = np.zeros((len(held[1]), place.size))
        own = np.block([[np.zeros((len(held[1]),) * 2), zero], [zero.T, own]])
        on_carried = jnp.concatenate([held[0], on_carried])
        on_nodes = np.concatenate([np.zeros((len(held[1]), on_nodes.shape[1])), on_nodes])
        right = jnp.concatenate([held[1], right])
    return _Links(on_carried, on_nodes if k.size else None, own, answers, right)


def _spread(values: Array, row: np.ndarray, column: np.ndarray, count: int = 0) -> Array:
    """Values in a table (6, count) of zeros, added where they fall together."""
    count = count or int(column.max()) + 1
    into = ((row * count + column)[:, None] == np.arange(6 * count)).astype(float)
    return (values @ into).reshape(6, count)


def _holding(mass: CoupledMass, n: int, b, d, convective, given) -> tuple[Array, Array]:
    """Of the moments that hold phi where a tilt is free: D, what they act on among the carried coordinates,
    and what the accelerations there must be."""
    bound, places = np.array(mass.bound, int), np.array(mass.carried, int)
    D: Any = (places == 5 * n + bound[:, None]).astype(float)
    held = picked(given[5] + convective, bound)
    for tilt, share in ((3, b), (4, d)):  # a tilt that is free, or given itself
        at = (places == tilt * n + bound[:, None]).astype(float)
        own = picked(share, bound)
        D = D - at * own[:, None]
        held = held + (1.0 - at.sum(axis=1)) * own * picked(given[tilt], bound)
    return D, held


# More columns pay for a library's product.
_LIBRARY = 16


def _times(a: Float[Array, "m k"], b: Float[Array, "k n"]) -> Float[Array, "m n"]:
    """`a @ b`: a library's product would keep the loop around the field from being one kernel."""
    if b.shape[1] > _LIBRARY:
        return a @ b
    return jnp.stack([a @ b[:, j] for j in range(b.shape[1])], axis=1)


def _six(X: Array) -> Array:
    """(6 n, ...) as (n, 6, columns)."""
    return X.reshape(X.shape[0] // 6, 6, int(np.prod(X.shape[1:])))


# No scatter among these: one would keep the loop around the field from being one kernel.


def _by_node(positions: tuple[int, ...], n: int) -> np.ndarray:
    """Flat positions `c n + node` as they stand node by node, in which they come in runs."""
    c, node = np.divmod(np.array(positions, int), n)
    return 6 * node + c


def _of(positions: tuple[int, ...], x: Float[Array, "6 n"]) -> Array:
    return picked(x.T.ravel(), _by_node(positions, x.shape[1]))


def _back(positions: tuple[int, ...], values: Array, n: int) -> Float[Array, "6 n"]:
    """Zeros but for the values at the positions."""
    return placed_columns(values, _by_node(positions, n), 6 * n).reshape(n, 6).T


def _placed(x: Float[Array, "6 n"], values: Float[Array, "6 k"], columns: np.ndarray) -> Array:
    """`x` with other columns."""
    count = x.shape[1]
    there = placed_columns(values, columns, count)
    return jnp.where(np.isin(np.arange(count), columns), there, x)
