"""Shafts with mass: accelerations that hang together, solved with constant matrices.

With the spin `w = phi' + psi' sin theta` in place of phi', the kinetic energy of all such shafts is
`v' M v/2` with M constant (protocol.Massive). Of chi, `w = chi' + b psi' + d theta'` with
`b = sin theta - theta/2`, `d = -psi/2`; of phi, b = sin theta and d = 0. Stations without inertia of
their own (carried) are eliminated once a solve, `S = (M_cc)^-1`; `coupled` finds the accelerations.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.picked import block, some_rows
from ..core.protocol import Carried, first_of, is_inertial, is_massive
from .condensed import CondensedMatrices
from .layout import Layout
from .placing import placed


class CoupledMass(eqx.Module):
    """The constant parts. Nodes are all nodes, driven ends last; flat positions are `c n + node`.

    `carried`: free coordinates of carried stations. `given`: their held ones, and driven ends.
    `bound`: carried nodes whose turning is held but a tilt is free, so that the spin follows from tilts.
    `nodes`: touched nodes of stations with inertia of their own, `node_owners` their stations;
    `owners`: each of those stations once. `answering`: (member, coordinate, node) of each force of elements
    that are `Inertial`, their members counted through.
    """

    carried: tuple[int, ...] = eqx.field(static=True)
    given: tuple[int, ...] = eqx.field(static=True)
    bound: tuple[int, ...] = eqx.field(static=True)
    nodes: tuple[int, ...] = eqx.field(static=True)
    node_owners: tuple[int, ...] = eqx.field(static=True)
    owners: tuple[int, ...] = eqx.field(static=True)
    answering: tuple[tuple[int, int, int], ...] = eqx.field(static=True)
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
    massive = [(e, nodes) for e, nodes in joined if is_massive(first_of(e))]
    carried = [g for g in layout.stations if g.carried]
    answering = _answering(joined)
    if not massive and not carried and not answering and condensed is None:
        return None
    n, m = layout.n_nodes + layout.n_ground, layout.n_nodes
    parts, afloat = [], []
    for e, at in massive:
        matrix = jax.vmap(lambda e: e.mass_matrix(), in_axes=-1, out_axes=-1)(e)
        (parts if e.weighs else afloat).append((matrix, at))
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
    touched |= {node for _, _, node in answering}
    if condensed is not None:
        parts.append((condensed.M[..., None], condensed.ends))
        touched |= {*condensed.shafts.nodes}
    M = placed(parts, n)
    weight = jnp.einsum("anbm,b->an", M[:, :, :3], gravity)
    if afloat:
        M = M + placed(afloat, n)
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
    scale = 1.0 / jnp.sqrt(some_rows(jnp.diagonal(M), c))
    scaled = block(M, c, c) * scale[:, None] * scale
    inverse = (jnp.linalg.inv(scaled) if c.size else scaled) * scale[:, None] * scale
    passed_on = block(M, r, c) @ inverse
    return CoupledMass(
        tuple(free),
        tuple(given),
        tuple(bound),
        own,
        tuple(layout.node_station[k] for k in own),
        tuple(sorted({layout.node_station[k] for k in own})),
        answering,
        any(k >= m for k in touched),
        layout.invariant,
        M,
        M[5 * n :],
        inverse,
        block(M, c, g),
        block(M, r, g),
        passed_on,
        block(M, r, r) - passed_on @ block(M, c, r),
        weight,
    )


def inertials(joined) -> list:
    """Those of the groups of elements that are `Inertial`, in the order in which they are counted."""
    return [(e, nodes) for e, nodes in joined if is_inertial(first_of(e), len(nodes))]


def _answering(joined) -> tuple[tuple[int, int, int], ...]:
    found = [(e, node) for e, nodes in inertials(joined) for node in nodes[0]]
    return tuple((k, c, node) for k, (e, node) in enumerate(found) for c in e.answers)
