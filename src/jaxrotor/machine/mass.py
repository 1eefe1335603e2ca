"""Shafts with mass: accelerations that hang together, solved with constant matrices.

With the spin `w = phi' + psi' sin theta` in place of phi', the kinetic energy of all such shafts is
`v' M v/2` with M constant (protocol.Massive). Of chi, `w = chi' + b psi' + d theta'` with
`b = sin theta - theta/2`, `d = -psi/2`; of phi, b = sin theta and d = 0. Stations without inertia of
their own (carried) are eliminated once a solve, `S = (M_cc)^-1`. What is left in the vector field is one
solve over the stations with inertia of their own that a shaft with mass touches:
`(I + P T' Mc T) a = a0 - P (...)`, P their mobility, Mc the mass of the shafts condensed to them.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.kinematics import with_last
from ..core.protocol import Carried, Massive
from .condensed import CondensedMatrices
from .layout import Layout
from .placing import placed


class CoupledMass(eqx.Module):
    """The constant parts. Nodes are all nodes, driven ends last; flat positions are `c n + node`.

    `carried`: free coordinates of carried stations. `given`: their held ones, and driven ends.
    `bound`: carried nodes whose turning is held but a tilt is free, so that the spin follows from tilts.
    `nodes`: touched nodes of stations with inertia of their own, `node_owners` their stations;
    `owners`: each of those stations once.
    """

    carried: tuple[int, ...] = eqx.field(static=True)
    given: tuple[int, ...] = eqx.field(static=True)
    bound: tuple[int, ...] = eqx.field(static=True)
    nodes: tuple[int, ...] = eqx.field(static=True)
    node_owners: tuple[int, ...] = eqx.field(static=True)
    owners: tuple[int, ...] = eqx.field(static=True)
    touches_ground: bool = eqx.field(static=True)
    invariant: bool = eqx.field(static=True)
    mass: Float[Array, "n n"]
    spin_rows: Float[Array, "k n"]
    inverse: Float[Array, "c c"]
    carried_given: Float[Array, "c g"]
    own_given: Float[Array, "r g"]
    passed_on: Float[Array, "r c"]
    condensed: Float[Array, "r r"]
    weight: Float[Array, "6 m"]


def assemble_mass(
    layout: Layout, stations, joined, gravity, condensed: CondensedMatrices | None = None
) -> CoupledMass | None:
    """`stations`: stacked elements of each group; `joined`: (stacked connector, nodes of each end)."""
    massive = [(e, nodes) for e, nodes in joined if isinstance(e, Massive)]
    carried = [g for g in layout.stations if g.carried]
    if not massive and not carried and condensed is None:
        return None
    n, m = layout.n_nodes + layout.n_ground, layout.n_nodes
    parts = [
        (jax.vmap(lambda e: e.mass_matrix(), in_axes=-1, out_axes=-1)(e), at) for e, at in massive
    ]
    for group, stacked in zip(layout.stations, stations):
        if group.carried and isinstance(stacked, Carried):
            own = jax.vmap(
                lambda e: e.own_mass(),
                in_axes=-1,
                out_axes=-1,
                axis_size=group.stop - group.start,
            )(stacked)
            parts.append((own, (tuple(range(group.start, group.stop)),)))
    touched = {k for _, nodes in massive for end in nodes for k in end}
    if condensed is not None:
        parts.append((condensed.M[..., None], condensed.ends))
        touched |= {*condensed.shafts.nodes}
    M = placed(parts, n)
    weight = jnp.einsum("anbm,b->an", M[:, :, :3], gravity)
    M = M.reshape(6 * n, 6 * n)

    is_carried = {k for g in carried for k in range(g.start, g.stop)}
    tilts = (3, 4) if layout.invariant else (3,)
    bound = [
        k
        for g in carried
        for k in range(g.start, g.stop)
        if 5 in g.held and not all(tilt in g.held for tilt in tilts)
    ]
    places = [(c * n + k, c in g.held and not (c == 5 and k in bound))
              for g in carried for k in range(g.start, g.stop) for c in range(6)]  # fmt: skip
    free = [place for place, held in places if not held]
    given = [place for place, held in places if held]
    given += [c * n + k for k in range(m, n) for c in range(6)]
    own = tuple(k for k in sorted(touched) if k < m and layout.node_station[k] not in is_carried)
    c, g = np.array(free, int), np.array(given, int)
    r = np.array([a * n + k for k in own for a in range(6)], int)
    # scaled first: masses and moments of inertia differ by orders
    scale = 1.0 / jnp.sqrt(jnp.diagonal(M)[c])
    scaled = M[np.ix_(c, c)] * scale[:, None] * scale
    inverse = (jnp.linalg.inv(scaled) if c.size else scaled) * scale[:, None] * scale
    passed_on = M[np.ix_(r, c)] @ inverse
    return CoupledMass(
        tuple(free),
        tuple(given),
        tuple(bound),
        own,
        tuple(layout.node_station[k] for k in own),
        tuple(sorted({layout.node_station[k] for k in own})),
        any(k >= m for k in touched),
        layout.invariant,
        M,
        M[5 * n :],
        inverse,
        M[np.ix_(c, g)],
        M[np.ix_(r, g)],
        passed_on,
        M[np.ix_(r, r)] - passed_on @ M[np.ix_(c, r)],
        weight,
    )


def _spin_by_tilts(q: Array, v: Array, invariant: bool) -> tuple[Array, Array, Array]:
    """b and d above, and what the spin's rate has beyond `a_5 + b a_3 + d a_4`, (n,) each."""
    convective = v[3] * v[4] * jnp.cos(q[4])
    if invariant:
        return jnp.sin(q[4]) - 0.5 * q[4], -0.5 * q[3], convective - v[3] * v[4]
    return jnp.sin(q[4]), jnp.zeros_like(q[3]), convective


class Coupled(eqx.Module):
    """Accelerations of all stations (6, n_mass), and the inertia force of the shafts on each node
    (6, n) and on each of the `owners` (6, owners)."""

    acceleration: Array
    inertia_force: Array
    on_owners: Array


def solve_coupled(mass: CoupledMass, q, v, Q, given, a, mobility, maps) -> Coupled:
    """**Arguments:**

    - `q`, `v`, `Q`, `given`: of all nodes (6, n): coordinates, rates, generalized forces (weight of
      the shafts among them), and the accelerations of what is given (elsewhere anything).
    - `a`: accelerations of all stations (6, n_mass) if no shaft had mass.
    - `mobility`: (6, 6, owners), their acceleration per unit force.
    - `maps`: how the coordinates of `mass.nodes` follow those of their stations: J (6, 6, nodes), and
      J's rate times v (6, nodes).
    """
    n, n_mass = q.shape[1], a.shape[1]
    c = np.array(mass.carried, int)
    cos = jnp.cos(q[4])
    b, d, convective = _spin_by_tilts(q, v, mass.invariant)
    momentum = mass.spin_rows @ with_last(v, v[5] + b * v[3] + d * v[4]).ravel()
    zero = jnp.zeros_like(cos)
    gyro = jnp.stack([zero, zero, zero, cos * v[4] * momentum, -cos * v[3] * momentum, zero])

    def hat_acceleration(a):
        return with_last(a, a[5] + b * a[3] + d * a[4] + convective)

    force = Q - gyro
    on_tilts = force[3] - b * Q[5], force[4] - d * Q[5]
    force = jnp.stack([force[0], force[1], force[2], *on_tilts, Q[5]])
    at_rest = hat_acceleration(given).ravel()[np.array(mass.given, int)]
    right = force.ravel()[c] - mass.carried_given @ at_rest
    # unknown: accelerations of the owners, and the moments that hold phi where psi is free
    k, owners, bound = (np.array(x, int) for x in (mass.nodes, mass.owners, mass.bound))
    J, drift = maps
    holds = np.array(mass.node_owners, int)[:, None] == owners[None]
    B = jnp.zeros((6, 6, len(k))).at[5, 3].set(b[k]).at[5, 4].set(d[k])
    B = B + jnp.eye(6)[:, :, None]
    T = jnp.einsum("ijk,jlk,ks->kisl", B, J, holds).reshape(6 * len(k), 6 * len(owners))
    extra = with_last(drift, drift[5] + b[k] * drift[3] + d[k] * drift[4] + convective[k])
    extra = extra.T.ravel()
    turning = jnp.einsum("jlk,jk,ks->sl", J, gyro[:, k], holds).ravel()
    pull = mass.passed_on @ right + mass.own_given @ at_rest + mass.condensed @ extra
    P = jnp.einsum("ijs,st->sitj", mobility, jnp.eye(len(owners)))
    P = P.reshape(6 * len(owners), 6 * len(owners))
    reduced = T.T @ mass.condensed @ T
    at_place = {int(place): i for i, place in enumerate(c)}
    rows = np.arange(len(bound))
    D = jnp.zeros((len(bound), len(c)))
    D = D.at[rows, [at_place[5 * n + k] for k in bound]].set(1.0)
    held = given[5, bound] + convective[bound]
    for tilt, share in ((3, b), (4, d)):  # a tilt that is free, or given itself
        free = [i for i, k in enumerate(bound) if int(tilt * n + k) in at_place]
        columns = [at_place[int(tilt * n + bound[i])] for i in free]
        D = D.at[np.array(free, int), np.array(columns, int)].add(-share[bound[free]])
        stays = np.array([int(tilt * n + k) not in at_place for k in bound], float)
        held = held + stays * share[bound] * given[tilt, bound]
    passed = T.T @ mass.passed_on
    matrix = jnp.block(
        [
            [jnp.eye(P.shape[0]) + P @ reduced, P @ passed @ D.T],
            [-D @ passed.T, D @ mass.inverse @ D.T],
        ]
    )
    alone = a[:, owners].T.ravel() - P @ (T.T @ pull + turning)
    held = held - D @ (mass.inverse @ right - extra @ mass.passed_on)
    unknown = jnp.concatenate([alone, held])
    if unknown.shape[0]:
        unknown = jnp.linalg.solve(matrix, unknown)
    moved, moments = unknown[: alone.shape[0]], unknown[alone.shape[0] :]
    right = right + moments @ D
    at_nodes = T @ moved + extra
    at_carried = mass.inverse @ right - at_nodes @ mass.passed_on
    on_owners = -(T.T @ pull + turning + reduced @ moved + passed @ (moments @ D))
    on_owners = on_owners.reshape(-1, 6).T
    a = a.at[:, owners].set(moved.reshape(-1, 6).T)
    whole = given.at[:, k].set(
        jnp.einsum("ijk,jk->ik", J, a[:, np.array(mass.node_owners, int)]) + drift
    )
    spins = jnp.zeros(6 * n).at[c].set(at_carried).reshape(6, n)
    free = np.zeros(6 * n, bool)
    free[c] = True
    free = free.reshape(6, n)
    bent = [jnp.where(free[tilt], spins[tilt], given[tilt]) for tilt in (3, 4)]
    spins = spins.at[5].add(-(b * bent[0] + d * bent[1] + convective) * free[5])
    whole = jnp.where(free, spins, whole)
    carried = sorted({i % n for i in mass.carried} | {i % n for i in mass.given if i % n < n_mass})
    if carried:
        a = a.at[:, np.array(carried)].set(whole[:, np.array(carried)])
    inertia = (mass.mass @ hat_acceleration(whole).ravel()).reshape(6, n)
    inertia = inertia.at[3].add(b * inertia[5]).at[4].add(d * inertia[5]) + gyro
    return Coupled(a, inertia, on_owners)
