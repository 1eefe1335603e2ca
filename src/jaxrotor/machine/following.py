"""Shafts with mass whose inner stations follow a few of them: component mode synthesis.

A run of inner stations follows its two ends as in statics, `Ψ = -K_ii⁻¹ K_ib` (Guyan 1965), and has shapes of
its own with fixed ends beside (Hurty 1965; Craig & Bampton 1968), Z, which ritz.py chooses. The shapes'
amplitudes are told by the coordinates of the stations that are kept, as many:
`u_i = Ψ u_b + Z Z_k⁻¹ (u_k - Ψ_k u_b)`. Shapes are not differentiated: what a change of them changes in a
result is the product of what they lack and of what their derivatives lack.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..core.picked import block, some_rows, summed
from .ritz import ritz_shapes

# What deforms by itself: bending in two planes, stretching and twisting; the first coordinate moves across.
PLANES = ((0, 4), (1, 3), (2,), (5,))


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
    values = block(X, r, c)
    if xp is np:
        found = np.bincount(place.ravel(), values.ravel(), minlength=size)
    else:
        found = summed(values, place, size)
    return found.reshape(len(rows) * n, len(columns) * n)


def turning(xp: Any, G: Any, M: Any, at: Places) -> Any:
    """All that turning does about x and y per unit of spin, of rates in the second of the PLANES on the
    first, (2 n, 2 n): by pieces' `G`, and by the momentum of their spin at their ends."""
    momentum = xp.sum(in_plane(xp, M, at, (5,), (5,)), axis=1)
    none = xp.zeros((at.size, at.size))
    own = xp.concatenate(
        [xp.concatenate([none, none]), xp.concatenate([none, xp.diag(momentum)])], axis=1
    )
    return in_plane(xp, G, at, *PLANES[:2]) - own


def circling(turning: Any) -> tuple[Any, ...]:
    """What gyroscopic moments do in each plane to a motion that circles, per unit of spin and of its
    frequency: symmetric, (2 n, 2 n); `None` where nothing circles."""
    sign = np.repeat([1.0, -1.0], turning.shape[0] // 2)  # theta circles with -psi
    return turning * sign, turning * sign[:, None], None, None


def following(xp: Any, K: Any, M: Any, gyroscopic: Any, at: Places, frequency: float) -> Any:
    """The followers' coordinates in a plane for those that are solved for. K, M, and `gyroscopic` as from
    `circling`, over all nodes there; `frequency`: the highest that counts, rad/s. By NumPy (`xp`) or JAX."""
    still = (lambda x: x) if xp is np else jax.lax.stop_gradient
    n, solved = at.size, len(at.solved)
    width = K.shape[0] // n
    inner = np.array([k for _, _, own in at.runs for k in own])
    kept = np.array([k for _, keeps, _ in at.runs for k in keeps], int)
    fixed = np.array([k for k in range(solved) if k not in set(inner.tolist())])

    def every(nodes):
        return np.concatenate([c * n + np.array(nodes, int) for c in range(width)])

    i, b, of_kept = every(inner), every(fixed), every(kept)
    f = every(np.arange(solved, n))
    # scaled first: metres and radians differ by orders
    size = 1.0 / xp.sqrt(some_rows(xp.diagonal(K), i))
    stiff = block(K, i, i) * size[:, None] * size
    static = -size[:, None] * xp.linalg.solve(stiff, size[:, None] * block(K, i, b))
    # columns as found, those of what is fixed first, into the order of what is solved for
    order = np.argsort(
        np.concatenate([c * solved + x for x in (fixed, kept) for c in range(width)])
    )
    own = _rows(f, i)
    if not kept.size:
        return block(static, own, order)
    psi = some_rows(static, own)
    told = xp.zeros((f.size, of_kept.size))
    for ends, keeps, own in at.runs:
        if not keeps:
            continue
        mine, edge, ours = every(own), every(ends), every(keeps)
        moved = block(still(static), _rows(mine, i), _rows(edge, b))

        def pushed(X, rows, mine=mine, edge=edge, moved=moved):
            X = still(X)
            return block(X, rows, edge) + block(X, rows, mine) @ moved

        loads = [pushed(X, mine) for X in (M, gyroscopic) if X is not None]
        stiff, mass = (block(still(X), mine, mine) for X in (K, M))
        shapes = ritz_shapes(xp, stiff, mass, loads, pushed(K, edge), ours.size, frequency)
        theirs = np.setdiff1d(mine, ours)
        by = xp.linalg.solve(
            some_rows(shapes, _rows(ours, mine)).T, some_rows(shapes, _rows(theirs, mine)).T
        ).T
        into = np.ix_(_rows(theirs, f), _rows(ours, of_kept))
        if xp is np:
            told[into] = by
        else:
            told = told.at[into].set(by)
    told = still(told)
    whole = xp.concatenate([psi - told @ some_rows(static, _rows(of_kept, i)), told], axis=1)
    return block(whole, np.arange(f.size), order)


def _rows(some: np.ndarray, among: np.ndarray) -> np.ndarray:
    """Where each of some numbers stands."""
    place = {int(p): j for j, p in enumerate(among)}
    return np.array([place[int(p)] for p in some], int)


def followings(
    xp: Any, K: Any, M: Any, gyroscopic: Any, at: Places, frequency: float
) -> tuple[Any, ...]:
    """`following` in each of the PLANES; shafts are round, so that the second is the first one's mirror
    image."""
    given = list(zip(K, M, gyroscopic))
    first, *others = (following(xp, *given[plane], at, frequency) for plane in (0, 2, 3))
    sign = np.array([1.0, -1.0])  # of what is across and of what tilts
    rows, columns = (np.repeat(sign, x // 2) for x in first.shape)
    return first, rows[:, None] * first * columns, *others


def with_own(xp: Any, T: Any, width: int, solved: int) -> Any:
    """The coordinates of all nodes: of those that are solved for themselves, then of the followers."""
    own = xp.eye(width * solved).reshape(width, solved, -1)
    return xp.concatenate([own, T.reshape(width, -1, width * solved)], axis=1).reshape(
        -1, width * solved
    )
