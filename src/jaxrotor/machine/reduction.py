"""Choosing which stations of shafts with mass follow others, and what that costs in accuracy, as numbers.

The estimate: of a natural vibration (λ = ω², shape u with u' M u = 1) of the reduced machine at rest, what is
out of balance on the stations between, r = (K - λM) u, lowers λ by r' (K_ii - λM_ii)⁻¹ r, the second term of
its series: Galerkin's error is the square of the shape's. Taken are twice r' K_ii⁻¹ r, which is more where
the lowest natural shape that is left out lies above 1.4 times the frequency. Where the shaft turns (Ω) and
the motion circles, gyroscopic moments leave ω Ω G u out of balance beside, with or against that.
"""

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..core.columns import columns
from ..core.errors import InputError
from ..core.parameter import is_concrete
from ..core.quick import quickly_compiled
from .built import Built
from .condensation import Condensation, Span, condensed_by, paths_of
from .condensed import pieces
from .field import initial_states, n_free, node_motions, on_nodes, relative_field
from .following import PLANES, Places, circling, followings, in_plane, places, turning, with_own
from .layout import joined, lay_out
from .lineup import line_up, structure_of
from .system import assembled

# Natural shapes with fixed ends are taken up to so many times the frequency at first.
_FARTHER = 1.5
# Backward whirl gets slower with the speed: what is faster than the frequency at rest need not stay so.
_FALLING = 1.15
# What is slower than this part of the frequency moves as in statics.
_SLOW = 1e-3
# Coordinates of kept stations that tell shapes apart badly would bring as much more rounding.
_ROUGH = 1e3


def choose(
    machine: Built,
    up_to: float,
    tolerance: float,
    speed: float | None = None,
    keep: Iterable[int] = (),
) -> Condensation | None:
    """So few stations, beside those to `keep` (by number), that natural frequencies below `up_to` (Hz) are
    met to the tolerance, at speeds up to `speed` (rad/s, by default `2 pi up_to`); `None` where there is
    nothing to leave out. Raises `InputError` under a trace, and where a force has no slope at rest."""
    if not all(is_concrete(x) for x in jax.tree.leaves(machine)):
        raise InputError(
            "which stations follow others cannot be chosen inside jit or vmap: call "
            "`machine = machine.reduced(...)` before; parameters may change inside"
        )
    paths = [path for path in paths_of(structure_of(machine), keep) if len(path) > 1]
    if not paths:
        return None
    fastest = 2 * np.pi * up_to if speed is None else abs(speed)
    shafts = _Shafts(machine, paths)
    counts = shafts.shapes_below(2 * np.pi * _FARTHER * up_to)
    while True:
        trial = _Trial(shafts, counts)
        if not trial.spans:
            return None
        try:
            errors = trial.errors(2 * np.pi * up_to, fastest)
        except np.linalg.LinAlgError:  # a run that buckles between its ends cannot follow them
            return None
        error = float(errors.sum(axis=1).max(initial=0.0))
        if error <= tolerance:
            return Condensation(trial.spans, up_to, tolerance, fastest, error)
        # where most is lost, and nearly so
        worst = errors.max(axis=0)
        for span in np.flatnonzero(worst >= 0.3 * worst.max()):
            counts[trial.of[span]] += 1


class _Rest(NamedTuple):
    """Of the machine at rest with nothing kept, over its n free coordinates: (n, n) K and M, and the
    coordinates of all nodes, (6, nodes, n)."""

    K: Any
    M: Any
    nodes: Any


class _Shafts:
    """What is found of a machine once. Nodes of stations on the `paths` count from `first` on, by the
    stations' numbers."""

    def __init__(self, machine: Built, paths: list[list[int]]):
        self.paths = paths
        bare = condensed_by(machine, Condensation(tuple(Span((), tuple(path)) for path in paths)))
        layout = lay_out(structure_of(bare))
        self.first = layout.n_nodes + layout.n_ground
        followers = [k for path in paths for k in path]
        found, rest = _numbers(bare)
        self.pieces, self.rest = jax.tree.map(np.asarray, (found, rest))
        if not all(np.isfinite(x).all() for x in self.rest):
            raise InputError(
                "the machine cannot be reduced: at rest, undeformed, some force or its slope is not finite; "
                "mend its law, or leave reduce out"
            )
        self.ends = tuple(
            tuple(k if k < self.first else self.first + followers[k - self.first] for k in end)
            for end in found.ends
        )

    def places(self, kept: Sequence[int], followers: Sequence[int]) -> Places:
        return places(
            self.ends, [self.first + k for k in kept], [self.first + k for k in followers]
        )

    def matrices(self, at: Places) -> list[tuple[np.ndarray, np.ndarray, np.ndarray | None]]:
        """K, M and what gyroscopic moments do, in each plane."""
        own = self.pieces
        gyroscopic = circling(turning(np, own.G, own.M, at))
        return [
            (*(in_plane(np, X, at, p, p) for X in (own.K, own.M)), G)  # pyright: ignore
            for p, G in zip(PLANES, gyroscopic)
        ]

    @cached_property
    def others(self) -> list[np.ndarray]:
        """K and M of all else, over the coordinates of the rest."""
        at = self.places([], [k for path in self.paths for k in path])
        matrices = self.matrices(at)
        own = _of_shafts(at, matrices, _follow(at, matrices, 0.0), _maps(self, at))
        return [self.rest.K - own[0], self.rest.M - own[1]]

    @cached_property
    def along(self) -> list[np.ndarray]:
        """Where the stations of each path are, between 0 and 1: by the time that a wave of stretching
        takes."""
        times: dict[int, dict[int, float]] = {}
        each = np.sqrt(self.pieces.M[2, 8] / -self.pieces.K[2, 8])
        for a, b, t in zip(*self.ends, each):
            times.setdefault(a, {})[b] = times.setdefault(b, {})[a] = t
        found = []
        for path in self.paths:
            nodes = [self.first + k for k in path]
            edge = [next(k for k in times[nodes[i]] if k not in nodes) for i in (0, -1)]
            nodes = [edge[0], *nodes, edge[1]]
            at = np.cumsum([times[a][b] for a, b in zip(nodes, nodes[1:])])
            found.append(at[:-1] / at[-1])
        return found

    def shapes_below(self, frequency: float) -> np.ndarray:
        """Of each path, how many stations tell its natural shapes below (rad/s) apart."""
        stations = [k for path in self.paths for k in path]
        at = self.places([], stations)
        stations = [-1] * len(at.solved) + stations
        counts = np.zeros(len(self.paths), int)
        for plane, (K, M, _) in zip(PLANES, self.matrices(at)):
            for _, _, own in at.runs:
                i = np.concatenate([c * at.size + np.array(own) for c in range(len(plane))])
                values, _ = _vibrations(K[np.ix_(i, i)], M[np.ix_(i, i)])
                found = int(np.sum(values < frequency**2))
                path = next(j for j, path in enumerate(self.paths) if stations[own[0]] in path)
                counts[path] = max(counts[path], -(-found // len(plane)))
        return counts


class _Trial:
    """So many stations kept on each path. `of`: the path of each span."""

    def __init__(self, shafts: _Shafts, counts: np.ndarray):
        self.shafts = shafts
        spans, self.of = [], []
        for i, (path, along, count) in enumerate(zip(shafts.paths, shafts.along, counts)):
            if count >= len(path):
                continue  # all are solved for
            kept = tuple(path[k] for k in _spread(along, count))
            spans.append(Span(kept, tuple(k for k in path if k not in kept)))
            self.of.append(i)
        self.spans = tuple(spans)

    def errors(self, frequency: float, speed: float) -> np.ndarray:
        """By what part natural frequencies below are off, at speeds below, (modes, spans); both in rad/s."""
        shafts, spans = self.shafts, self.spans
        kept = [k for span in spans for k in span.kept]
        followers = [k for span in spans for k in span.followers]
        at = shafts.places(kept, followers)
        matrices, solved = shafts.matrices(at), len(at.solved)
        follow = _follow(at, matrices, frequency)
        of = np.repeat(np.arange(len(spans)), [len(span.followers) for span in spans])
        largest = np.zeros(len(spans))
        for T, plane in zip(follow, PLANES):
            each = np.abs(T).max(axis=1).reshape(len(plane), -1).max(axis=0)
            np.maximum.at(largest, of, each)
        if np.any(rough := largest > _ROUGH):
            return np.where(rough, np.inf, 0.0)[None]
        maps = _maps(shafts, at)
        own, n = _of_shafts(at, matrices, follow, maps), shafts.rest.K.shape[0]
        for X, others in zip(own, shafts.others):
            X[:n, :n] += others
        values, shapes = _vibrations(*own)
        below = values < (_FALLING * frequency) ** 2
        values, shapes = values[below], shapes[:, below]
        found = np.zeros((values.size, len(spans)))
        for plane, (K, M, gyroscopic), T, moved in zip(PLANES, matrices, follow, maps):
            width = len(plane)
            T = with_own(np, T, width, solved)
            u = T @ (moved @ shapes)
            left = [K @ u - M @ u * values]
            if gyroscopic is not None:
                left.append(speed * np.sqrt(np.maximum(values, 0.0)) * (gyroscopic @ u))
            for _, keeps, own in at.runs:
                i, k = (
                    np.concatenate([c * count + np.array(nodes, int) for c in range(width)])
                    for nodes, count in ((own, at.size), (keeps, solved))
                )
                Z = T[np.ix_(i, k)]
                lowered = sum(_lacking(K[np.ix_(i, i)], Z, r[i]) for r in left) ** 2
                # the last of a run follows
                last = followers[own[-1] - solved]
                span = next(j for j, span in enumerate(spans) if last in span.followers)
                found[:, span] += lowered / np.maximum(values, (_SLOW * frequency) ** 2)
        return found  # twice of λ, once of ω


def _lacking(K: np.ndarray, Z: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """The size, as the root of energy, of what loads (n, m) move by and Z (n, k) has not."""
    moved = np.linalg.solve(K, loads)
    moved = moved - Z @ np.linalg.solve(Z.T @ K @ Z, Z.T @ loads)
    return np.sqrt(np.sum(moved * (K @ moved), axis=0))


def _spread(along: np.ndarray, count: int) -> list[int]:
    """So many different places, as evenly apart as they can be."""
    found: list[int] = []
    for i, x in enumerate((np.arange(count) + 1) / (count + 1)):
        near = int(np.argmin(np.abs(along - x)))
        least, most = found[-1] + 1 if found else 0, along.size - (count - i)
        found.append(min(max(near, least), most))
    return found


def _maps(shafts: _Shafts, at: Places) -> list[np.ndarray]:
    """In each plane, the coordinates of nodes that are solved for by all free ones: those of the rest, then
    of each station on a path that is solved for."""
    n, first = shafts.rest.K.shape[0], shafts.first
    inner = [node for node in at.solved if node >= first]
    found = []
    for plane in PLANES:
        rows = np.zeros((len(plane), len(at.solved), n + 6 * len(inner)))
        for i, c in enumerate(plane):
            for k, node in enumerate(at.solved):
                if node < first:
                    rows[i, k, :n] = shafts.rest.nodes[c, node]
                else:
                    rows[i, k, n + 6 * inner.index(node) + c] = 1.0
        found.append(rows.reshape(-1, rows.shape[2]))
    return found


def _follow(at: Places, matrices, frequency: float) -> list[np.ndarray]:
    """In each plane."""
    K, M, G = zip(*matrices)
    return list(followings(np, K, M, G, at, frequency))


def _of_shafts(at: Places, matrices, follow, maps) -> list[np.ndarray]:
    """K and M of the condensed shafts over all free coordinates."""
    found = []
    for which in (0, 1):
        X = 0.0
        for plane, pair, T, moved in zip(PLANES, matrices, follow, maps):
            T = with_own(np, T, len(plane), len(at.solved)) @ moved
            X = X + T.T @ pair[which] @ T
        found.append(X)
    return found


def _vibrations(K: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """λ, rising, and shapes u with u' M u = 1, side by side."""
    size = 1.0 / np.sqrt(np.diagonal(M))  # metres and radians differ by orders
    L = np.linalg.cholesky(0.5 * (M + M.T) * size * size[:, None])
    back = np.linalg.inv(L) * size
    values, vectors = np.linalg.eigh(back @ (0.5 * (K + K.T)) @ back.T)
    return values, back.T @ vectors


@quickly_compiled
def _numbers(machine: Any) -> tuple[Any, _Rest]:
    """Of a machine with condensed shafts: their pieces, and what is `_Rest`."""
    lineup = line_up(machine)
    system = assembled(machine, lineup, nominal=True)
    layout, n, zero = system.layout, n_free(system), jnp.zeros(())
    between = zip(joined(lineup, layout), layout.connectors)
    apart = [pair for pair, group in between if group.condensed]
    reference = (system.reference(zero)[0], zero, zero)
    z = initial_states(system)

    def accelerations(both: Array) -> Array:
        y = jnp.concatenate([both[:n], jnp.zeros(n), z])
        return relative_field(zero, y, system, reference, on_nodes(system, both[n:]))[n : 2 * n]

    slopes, _ = columns(accelerations, jnp.zeros(2 * n))
    M = jnp.linalg.inv(slopes[:, n:])

    def nodes(u: Array) -> Array:
        y = jnp.concatenate([u, jnp.zeros(n), z])
        return node_motions(zero, y, system, reference)[0].ravel()

    moved, _ = columns(nodes, jnp.zeros(n))
    return pieces(apart), _Rest(-M @ slopes[:, :n], M, moved.reshape(6, -1, n))
