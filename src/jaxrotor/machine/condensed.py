"""What stands for condensed shafts (following.py): a shaft between fewer stations, with the same law.

`T' K T`, `T' C T`, `T' M T` are assembled as any other's; `T' G T`, less what the spin's momentum gives at
the stations already, makes its forces of turning.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.kinematics import from_turning, spin_speed
from ..core.picked import block, gathered, picked
from ..core.turning import turning_forces
from .following import PLANES, Places, circling, followings, in_plane, places, turning, with_own
from .layout import Layout


class Condensed(eqx.Module):
    """All condensed shafts of a machine. `nodes`: those that they hold and that are solved for; `lines`:
    which shaft each is on; `follow`: of each plane, the followers' coordinates for those of `nodes`; `sag`:
    what their own weight adds where nothing between two ends is kept; the rest as `turning_forces` takes
    it."""

    nodes: tuple[int, ...] = eqx.field(static=True)
    lines: tuple[int, ...] = eqx.field(static=True)
    invariant: bool = eqx.field(static=True)
    follow: tuple[Float[Array, "f k"], ...]
    sag: Float[Array, "6 f"]
    G: Float[Array, "m m"]
    rotating: Float[Array, "m m"] | None

    def followers(self, x: Float[Array, "6 n"]) -> Float[Array, "6 f"]:
        """Their coordinates, rates or accelerations, for those of all nodes."""
        x = picked(x, self.nodes)
        rows: dict[int, Array] = {}
        for plane, T in zip(PLANES, self.follow):
            found = T @ x[np.array(plane)].ravel()
            rows.update(zip(plane, found.reshape(len(plane), -1)))
        return jnp.stack([rows[c] for c in range(6)])

    def turned(self, angles: Float[Array, " n"]) -> Float[Array, " f"]:
        """The followers' angles of turning, for those of all nodes."""
        return self.follow[PLANES.index((5,))] @ picked(angles, self.nodes)

    def forces(self, q: Float[Array, "6 n"], v: Float[Array, "6 n"]) -> Float[Array, "6 k"]:
        """Of turning, on `nodes`, for the motion of all nodes."""
        q, v = picked(q, self.nodes), picked(v, self.nodes)
        angles = from_turning(q, v) if self.invariant else (q, v)
        lines = np.array(self.lines)
        same = (lines[:, None] == lines).astype(float)
        shared = same / same.sum(axis=0)
        return turning_forces(self.G, self.rotating, q, v, spin_speed(*angles), shared)


class Pieces(eqx.Module):
    """Elements of condensed shafts, side by side: (12, 12, members) each, and the nodes of both ends."""

    K: Any
    C: Any
    M: Any
    G: Any
    rotating: Any
    ends: tuple[tuple[int, ...], tuple[int, ...]] = eqx.field(static=True)


def pieces(joined) -> Pieces:
    """`joined`: (stacked elements, nodes of each end)."""

    def of(element, count):
        def one(e):
            G, rotating = e.turning()
            return (
                *e.matrices(),
                e.mass_matrix(),
                G,
                jnp.zeros((12, 12)) if rotating is None else rotating,
            )

        return jax.vmap(one, in_axes=-1, out_axes=-1, axis_size=count)(element)

    found = [of(element, len(nodes[0])) for element, nodes in joined]
    left, right = (tuple(k for _, nodes in joined for k in nodes[end]) for end in (0, 1))
    K, C, M, G, rotating = (jnp.concatenate(x, axis=-1) for x in zip(*found))
    return Pieces(K, C, M, G, rotating, (left, right))


def turns_rigidly(joined) -> bool:
    """Whether nothing of the damping turns with the shaft."""
    return all(
        jax.eval_shape(lambda e: e.turning(), jax.tree.map(lambda x: x[..., 0], element))[1] is None
        for element, _ in joined
    )


class CondensedMatrices(NamedTuple):
    """Matrices over `nodes`, (6 n, 6 n) in the order of elements, node by node."""

    shafts: Condensed
    K: Array
    C: Array
    M: Array

    @property
    def ends(self) -> tuple[tuple[int, ...], ...]:
        """As of an element that holds each of the nodes."""
        return tuple((node,) for node in self.shafts.nodes)


def condense(layout: Layout, joined, gravity: Float[Array, "3"]) -> CondensedMatrices:
    """`joined`: the stacked elements of the condensed groups, and the nodes of each end."""
    own = pieces(joined)
    first = layout.n_nodes + layout.n_ground
    at = places(own.ends, layout.kept, range(first, first + layout.n_followers))
    k = len(at.solved)
    K, C, M, B = (
        [in_plane(jnp, X, at, p, p) for p in PLANES] for X in (own.K, own.C, own.M, own.rotating)
    )
    across = turning(jnp, own.G, own.M, at)
    frequency = 2 * np.pi * layout.up_to
    follow = followings(jnp, K, M, circling(across), at, frequency)
    sag = _sag(K, M, at, gravity)
    whole = [with_own(jnp, T, len(plane), k) for T, plane in zip(follow, PLANES)]

    def reduced(X):
        return [T.T @ x @ T for T, x in zip(whole, X)]

    K, C, M, B = map(reduced, (K, C, M, B))
    # beyond the momentum of the spin at the stations that are solved for
    tilt = k + np.arange(k)
    across = (whole[0].T @ across @ whole[1]).at[tilt, tilt].add(jnp.sum(M[3], axis=1))
    G = jnp.zeros((6 * k, 6 * k)).at[_places(k, PLANES[0], PLANES[1])].set(across)
    rotating = None if turns_rigidly(joined) else _one(B, k)
    shafts = Condensed(
        at.solved, at.lines, layout.invariant, follow, sag, _by_node(G - G.T, k), rotating
    )
    return CondensedMatrices(shafts, *(_one(X, k) for X in (K, C, M)))


def _sag(
    K: list[Array], M: list[Array], at: Places, gravity: Float[Array, "3"]
) -> Float[Array, "6 f"]:
    """Of runs without kept stations: those of others bend under their weight as their shapes do."""
    solved, n = len(at.solved), at.size
    inner = np.array([k for _, keeps, own in at.runs if not keeps for k in own], int)
    rows = [jnp.zeros(at.followers)] * 6
    for plane, stiff, mass in zip(PLANES[:3], K, M) if inner.size else ():
        i = np.concatenate([c * n + inner for c in range(len(plane))])
        weight = jnp.sum(mass[i, :n], axis=1) * gravity[plane[0]]
        found = jnp.zeros(len(plane) * n).at[i].set(jnp.linalg.solve(block(stiff, i, i), weight))
        for c, own in zip(plane, found.reshape(len(plane), n)):
            rows[c] = own[solved:]
    return jnp.stack(rows)


def _places(k: int, rows: tuple[int, ...], columns: tuple[int, ...]):
    return np.ix_(
        *(np.concatenate([c * k + np.arange(k) for c in plane]) for plane in (rows, columns))
    )


def _one(parts: list[Array], k: int) -> Array:
    """Of all planes, (6 k, 6 k)."""
    flat = jnp.concatenate([*(part.ravel() for part in parts), jnp.zeros(1)])
    at, first = np.full((6 * k, 6 * k), flat.size - 1), 0
    for plane, part in zip(PLANES, parts):
        at[_places(k, plane, plane)] = first + np.arange(part.size).reshape(part.shape)
        first += part.size
    return gathered(flat, _by_node(at, k)[..., None])


def _by_node(X: Any, k: int) -> Any:
    return X.reshape(6, k, 6, k).transpose(1, 0, 3, 2).reshape(6 * k, 6 * k)
