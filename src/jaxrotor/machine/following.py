"""Shafts with mass whose inner stations follow a few of them: component mode synthesis.

A run of inner stations follows its two ends as in statics, `Ψ = -K_ii⁻¹ K_ib` (Guyan 1965), and has natural
shapes with fixed ends beside (Hurty 1965; Craig & Bampton 1968). The shapes' amplitudes are told by the
coordinates of the stations that are kept, as many: `u_i = Ψ u_b + Z Z_k⁻¹ (u_k - Ψ_k u_b)`. Of the shapes the
first are static ones, under the inertia of a run that its ends move, so that statics are exact; then come
those of the lowest natural frequencies, by subspace iteration. Shapes are not differentiated: what a change
of them changes in a result is the product of what they lack and of what their derivatives lack.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

# What deforms by itself: bending in two planes, stretching and twisting; the first coordinate moves across.
PLANES = ((0, 4), (1, 3), (2,), (5,))
# Of the subspace iteration: a shape at half the first frequency that is left out is found to 1e-6.
_ITERATIONS = 10


class Places(eqx.Module):
    """Where pieces stand among their nodes: first `solved` ones, then `followers`. `runs`: of each run its
    two ends, those of its stations that are kept, and all of them, as numbers here."""

    solved: tuple[int, ...] = eqx.field(static=True)
    followers: int = eqx.field(static=True)
    runs: tuple[tuple[tuple[int, int], tuple[int, ...], tuple[int, ...]], ...] = eqx.field(
        static=True
    )
    ends: tuple[tuple[int, ...], tuple[int, ...]] = eqx.field(static=True)

    @property
    def lines(self) -> tuple[int, ...]:
        """Of each that is solved for, the first station of those that pieces join to it."""
        of = np.arange(self.size)
        for a, b in zip(*self.ends):
            of[of == max(of[a], of[b])] = min(of[a], of[b])
        return tuple(of[: len(self.solved)].tolist())

    @property
    def size(self) -> int:
        return len(self.solved) + self.followers


def places(ends: Any, kept: Iterable[int], followers: Sequence[int]) -> Places:
    """`ends`: nodes of both ends of each piece."""
    kept, last = set(kept), set(followers)
    solved = tuple(sorted({k for end in ends for k in end} - last))
    number = {k: i for i, k in enumerate((*solved, *followers))}
    ends = tuple(tuple(number[k] for k in end) for end in ends)
    beside: dict[int, set[int]] = {}
    for a, b in zip(*ends):
        beside.setdefault(a, set()).add(b)
        beside.setdefault(b, set()).add(a)
    inner = {number[k] for k in (*kept, *followers)}
    keeps, runs, seen = {number[k] for k in kept}, [], set()
    for start in sorted(inner):
        if start in seen:
            continue
        edge, run, queue = set(), [], [start]
        while queue:
            here = queue.pop()
            if here not in inner:
                edge.add(here)
            elif here not in seen:
                seen.add(here)
                run.append(here)
                queue += [k for k in beside[here] if k not in seen]
        own = tuple(sorted(run))
        runs.append((tuple(sorted(edge)), tuple(k for k in own if k in keeps), own))
    return Places(solved, len(followers), tuple(runs), ends)  # pyright: ignore


def in_plane(xp: Any, X: Any, at: Places, rows: tuple[int, ...], columns: tuple[int, ...]) -> Any:
    """Pieces' matrices over all nodes, for coordinates `rows` by `columns`, (len(rows) n, len(columns) n)."""
    n, ends = at.size, np.array(at.ends)
    r = np.array([end * 6 + c for end in (0, 1) for c in rows])
    c = np.array([end * 6 + c for end in (0, 1) for c in columns])
    row = np.concatenate([i * n + ends[end][None] for end in (0, 1) for i in range(len(rows))])
    column = np.concatenate(
        [i * n + ends[end][None] for end in (0, 1) for i in range(len(columns))]
    )
    place = row[:, None] * (len(columns) * n) + column[None]
    size = len(rows) * len(columns) * n * n
    values = X[r][:, c]
    if xp is np:
        found = np.bincount(place.ravel(), values.ravel(), minlength=size)
    else:
        found = jnp.zeros(size).at[place].add(values, mode="promise_in_bounds")
    return found.reshape(len(rows) * n, len(columns) * n)


def following(xp: Any, K: Any, M: Any, at: Places, width: int) -> Any:
    """The followers' coordinates in a plane of `width` coordinates for those that are solved for; K and M
    over all nodes there. By NumPy (`xp`) or JAX."""
    still = (lambda x: x) if xp is np else jax.lax.stop_gradient
    n, solved = at.size, len(at.solved)
    inner = np.array([k for _, _, own in at.runs for k in own])
    kept = np.array([k for _, keeps, _ in at.runs for k in keeps], int)
    fixed = np.array([k for k in range(solved) if k not in set(inner.tolist())])

    def every(nodes):
        return np.concatenate([c * n + nodes for c in range(width)]).astype(int)

    i, b, of_kept = every(inner), every(fixed), every(kept)
    place = {int(p): j for j, p in enumerate(i)}
    k = np.array([place[int(p)] for p in of_kept], int)
    f = np.array([place[int(p)] for p in every(np.arange(solved, n))], int)
    # scaled first: metres and radians differ by orders
    size = 1.0 / xp.sqrt(xp.diagonal(K)[i])
    stiff = K[np.ix_(i, i)] * size[:, None] * size
    static = -size[:, None] * xp.linalg.solve(stiff, size[:, None] * K[np.ix_(i, b)])
    # columns as found, those of what is fixed first, into the order of what is solved for
    order = np.argsort(
        np.concatenate([c * solved + x for x in (fixed, kept) for c in range(width)])
    )
    if not kept.size:
        return static[f][:, order]
    K, M, stiff, size, psi = (still(x) for x in (K, M, stiff, size, static))
    L = xp.linalg.cholesky(stiff)
    back = xp.linalg.solve(L, xp.eye(i.size)) * size  # of a load to the shape's own measure
    pushed = back @ (M[np.ix_(i, b)] + M[np.ix_(i, i)] @ psi)
    own = back @ M[np.ix_(i, i)] @ back.T
    # static shapes, where both ends move alike and against each other, across and tilting; then natural ones,
    # one for each other coordinate that is kept (of a symmetric run, as many symmetric ones as can be told
    # apart)
    begin = []
    for ends, keeps, _ in at.runs:
        if not keeps:
            continue
        count = min(2 * width, width * len(keeps))
        ours = np.zeros((b.size, count))
        ways = [(c, sign) for c in range(width) for sign in (1.0, -1.0)]
        for column, (c, sign) in enumerate(ways[:count]):
            for end, share in zip(ends, (1.0, sign)):
                ours[c * fixed.size + np.flatnonzero(fixed == end)[0], column] = share
        others = every(np.array(keeps))[: width * len(keeps) - count]
        begin.append((ours, [place[int(p)] for p in others]))
    masks = [np.isin(i % n, own) for _, keeps, own in at.runs if keeps]
    first = xp.concatenate(
        [(pushed @ ours) * mask[:, None] for (ours, _), mask in zip(begin, masks)], axis=1
    )
    first = xp.linalg.qr(first)[0]
    units = np.eye(i.size)[:, [p for _, others in begin for p in others]]
    shapes = back @ units
    for _ in range(_ITERATIONS if units.shape[1] else 0):
        shapes = xp.linalg.qr(own @ shapes)[0]
    # the first natural shapes are nearly static ones
    every_shape = xp.linalg.qr(xp.concatenate([first, shapes], axis=1))[0]
    every_shape = back.T @ xp.linalg.qr(every_shape)[0]
    told = still(xp.linalg.solve(every_shape[k].T, every_shape[f].T).T)
    return xp.concatenate([static[f] - told @ static[k], told], axis=1)[:, order]


def with_own(xp: Any, T: Any, width: int, solved: int) -> Any:
    """The coordinates of all nodes: of those that are solved for themselves, then of the followers."""
    own = xp.eye(width * solved).reshape(width, solved, -1)
    return xp.concatenate([own, T.reshape(width, -1, width * solved)], axis=1).reshape(
        -1, width * solved
    )
