"""The weights of a run: linearisations at rising speeds, and of each what weights are mixed from.

A goes with the speed, so that one evaluation a step is stable; what is left of its change follows a
correction (`Rung.follow`). The pair that weights are fitted to goes with the speed in finer steps than A:
it costs little, and accuracy hangs on it.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.block_matrix import BlockMatrix, sub_block
from .blocks import ALONE, REGULAR, Blocks
from .dense_output import Within, powers_between
from .fitted_weights import (
    FIRST_HALVINGS,
    FittedWeights,
    Moments,
    Parts,
    first_steps,
    fitted_mix,
    moments,
    polynomial_mix,
    turn_of,
    weights_of_parts,
)

# Linearisations over the range of speeds, and fits about each of them.
RUNGS, _FITS = 4, 16
# Part of a speed over which rungs are spread at least.
_NARROW = 0.02


def rung_speeds(top: Any, slowest: Any = 0.0, rungs: int = RUNGS, xp: Any = jnp) -> Any:
    """The speeds at which a machine is linearised that turns up to `top` (rad/s; signed) and never slower
    than `slowest` (rad/s); (s,), in `xp`'s arrays."""
    # at a standstill the slopes still need a distance, and where all is at one speed
    top = xp.where(top == 0.0, 1.0, top)
    half = 0.5 * xp.maximum(1.0 - slowest / xp.abs(top), _NARROW)
    middle = 0.5 * (1.0 + xp.minimum(slowest / xp.abs(top), 1.0))
    return top * (middle + half * ((2 * np.arange(rungs) + 1.0) / rungs - 1.0))


def nearest_rungs(speeds: Any, wanted: Any, xp: Any = jnp) -> Any:
    """Which of the `speeds` is nearest to each that is wanted."""
    return xp.argmin(xp.abs(speeds[:, None] - wanted), axis=0)


class Ladder(eqx.Module):
    """`speeds` (rad/s) of the linearisations `A`, whose change for each rad/s is `slopes`; then those of
    the parts of intervals beside jumps, `A` and `slopes` alike.

    `moments`: of regular steps at each A, of the short steps of the start, and of no step at all.
    `mixes`: for the fits of each rung, at `turns` (rad), of the start, none, and the fits of the parts of
    intervals. A does not mix `parts` of the state: each has `moments` of its own.

    `excitation`: rad/s, of a load (`turn_of`). Where a step spans several samples, `within`: of each A at the
    speeds what carries the state from one to the next, and `powers` (`powers_between`).
    """

    speeds: Float[Array, " s"]
    turns: Float[Array, "s f"]
    h: Float[Array, ""]
    A: Float[Array, "a d d"]
    slopes: Float[Array, "a m d"]
    moments: tuple[Moments, ...]
    mixes: tuple[Array, ...]
    order: int = eqx.field(static=True)
    chains: int = eqx.field(static=True)
    parts: Parts = eqx.field(static=True)
    within: Within | None = None
    powers: Float[Array, "s n p q"] | None = None
    span: int = eqx.field(static=True, default=1)
    excitation: Float[Array, ""] | float = 0.0

    @property
    def with_N(self) -> int:
        """How many rows have an N."""
        return self.parts.size - self.parts.exact_rows

    def nearest(self, speed: Float[Array, ""]) -> Array:
        return jnp.argmin(jnp.abs(self.speeds - speed))

    def linearisation(self, rung, odd) -> Array:
        """Which A a block goes by."""
        return jnp.where(odd < 0, rung, self.speeds.size + odd)

    def weights(self, rung, odd, kind, speed) -> FittedWeights:
        steps = first_steps(self.order, self.span)
        levels = _levels(steps)
        rungs, fits = self.turns.shape
        regular = self.A.shape[0]
        at = self.linearisation(rung, odd)
        chain = jnp.where(odd < 0, jnp.minimum(rung, self.chains - 1), self.chains + odd)
        start = jnp.maximum(kind, 0)
        which = jnp.where(
            kind == REGULAR,
            at,
            regular + chain * max(levels) + max(levels) - jnp.asarray(levels)[start],
        )
        which = jnp.where(kind == ALONE, self.moments[0].flow.shape[0] - 1, which)
        fit, first = self._fit(rung, speed), rungs * fits
        mix = jnp.where(odd < 0, fit, first + len(levels) + 1 + odd)
        mix = jnp.where(
            kind == REGULAR, mix, jnp.where(kind == ALONE, first + len(levels), first + start)
        )
        own = jax.tree.map(lambda x: x[which], self.moments)
        return weights_of_parts(own, self.parts, *(x[mix] for x in self.mixes))

    def _fit(self, rung, speed) -> Array:
        own = self.turns[rung]
        return rung * own.size + jnp.argmin(jnp.abs(own - turn_of(speed, self.h, self.excitation)))

    def between_samples(self, rung, speed) -> tuple[Within, Float[Array, "n p k+1"]]:
        """What `samples_within` a regular step are found by, and the coefficients."""
        fit = self._fit(rung, speed)
        past, after, ahead = (x[fit] for x in self.mixes)
        assert self.within is not None and self.powers is not None
        # the correction is by what the value at the end differs from what was expected there
        of_values = jnp.concatenate([after[None], past - ahead[:, None] * after])
        coefficients = jnp.einsum("npq,kq->npk", self.powers[rung], of_values)
        return jax.tree.map(lambda x: x[rung], self.within), coefficients

    def lower(self, matrix: Float[Array, "m d"]) -> Float[Array, "m d"] | BlockMatrix:
        """Of what is like A's rows that have an N, for products with it."""
        if self.parts.single:
            return matrix
        rows, columns = self.parts.with_N, self.parts.rows
        own = tuple(sub_block(matrix, *both) for both in zip(rows, columns))
        return BlockMatrix(own, rows, columns)

    def flow(self, at) -> tuple[Float[Array, "d d"], Float[Array, "d m"]]:
        """`e^(hA)` and `h φ_1(hA)` of a regular step at one of the linearisations."""
        if self.parts.single:
            return self.moments[0].flow[at], self.moments[0].mean[at, 0]
        rows, with_N = self.parts.rows, self.parts.with_N
        through = BlockMatrix(tuple(own.flow[at] for own in self.moments), rows, rows)
        push = BlockMatrix(tuple(own.mean[at, 0] for own in self.moments), rows, with_N)
        return through.dense, push.dense

    def follow(
        self, at, rung, odd, speed, weights: FittedWeights
    ) -> Float[Array, "m m"] | BlockMatrix:
        """By how much a gap of N grows while it is corrected: N changes by `F gap` with a correction, that is
        corrected too, and so on."""
        off = jnp.where(odd < 0, speed - self.speeds[rung], 1.0)
        slopes, correct = self.lower(off * self.slopes[at]), weights.correct
        if isinstance(slopes, BlockMatrix) and isinstance(correct, BlockMatrix):
            own = tuple(_followed(*both) for both in zip(slopes.blocks, correct.blocks))
            return BlockMatrix(own, correct.columns, correct.columns)
        return _followed(slopes, correct)


def _followed(slopes: Any, correct: Any) -> Array:
    F = slopes @ correct
    twice = F @ F
    once = F + twice
    return once + once @ twice


def _levels(steps) -> list[int]:
    """By how many halvings of a regular step each kind of first step is as short as it is."""
    return [round(-np.log2(length)) for length, _ in steps.kinds]


class Chains(NamedTuple):
    """Moments of regular steps and of the ever shorter ones that a start has, (s, ...)."""

    regular: Moments
    starting: Moments


def chains_of(
    A: Float[Array, "s d d"],
    h: Float[Array, " s"],
    near: Float[Array, " s"],
    order: int,
    exact_rows: int,
) -> Chains:
    """`h`: of regular steps, s; `near`: the angles that they turn by."""
    levels = max(_levels(first_steps(order)))

    def chain(x):
        own = moments(x[0], x[1], x[2], order, exact_rows, levels)
        return Chains(jax.tree.map(lambda x: x[-1], own), jax.tree.map(lambda x: x[:-1], own))

    return jax.lax.map(chain, (A, h, near))


def _each(parts: Parts, A, h, near, order: int) -> tuple[Chains, ...]:
    """Of each of the parts; those of one size by one loop, which takes long to compile."""
    sizes = [(len(rows), len(rows) - len(own)) for rows, own in zip(parts.rows, parts.with_N)]
    found: dict[int, Chains] = {}
    for size in dict.fromkeys(sizes):
        alike = [i for i, own in enumerate(sizes) if own == size]
        blocks = [A if parts.single else sub_block(A, *[parts.rows[i]] * 2) for i in alike]
        n = len(alike)
        chains = chains_of(
            jnp.concatenate(blocks), jnp.tile(h, n), jnp.tile(near, n), order, size[1]
        )
        for k, i in enumerate(alike):
            found[i] = jax.tree.map(lambda x, k=k, n=n: jnp.split(x, n)[k], chains)
    return tuple(found[i] for i in range(len(sizes)))


def ladder_of(
    speeds: Float[Array, " s"],
    A: Float[Array, "s d d"],
    h: Float[Array, ""],
    order: int,
    exact_rows: int,
    blocks: Blocks | None = None,
    speeds_of_parts: Float[Array, " o"] | None = None,
    start: Float[Array, ""] | float = 0.0,
    chains: Sequence[Chains] | None = None,
    beside: Sequence[Chains] | None = None,
    mixed: "Mixed | None" = None,
    parts: Parts | None = None,
    xp: Any = jnp,
    span: int = 1,
    excitation: Any = 0.0,
) -> Ladder:
    """A at the `speeds` (rad/s). `h`: a regular step, s. `blocks`: with parts of intervals, which turn at
    `speeds_of_parts`. `start`: the speed at the start, which is all there is of a start where nothing
    jumps. `chains` of the speeds, those `beside` jumps, of the parts of intervals, and what is `mixed` of
    both, where they are known: all of them, of each of the state's `parts` that no A mixes, and it may be in
    NumPy's arrays, `xp`. `span`: samples in a step, a power of two up to 64. `excitation`: rad/s, of a load
    (`turn_of`)."""
    s, d, _ = A.shape
    single = blocks is None or blocks.single
    parts = Parts.whole(d, exact_rows) if parts is None else parts
    if not parts.single:
        A = A * _within(parts)  # what is left out becomes N's
    slopes = _slopes(speeds, A, xp)[:, exact_rows:]

    if chains is None:
        near = turn_of(speeds, h, excitation)
        chains = _each(parts, A, jnp.broadcast_to(h, speeds.shape), near, order)
    count, first = s, None
    if single:
        count, first = 1, xp.argmin(xp.abs(speeds - start))
    lengths, wanted = jnp.zeros(0), jnp.zeros(0)
    if blocks is not None and speeds_of_parts is not None and blocks.lengths.size:
        lengths, wanted = blocks.lengths, speeds_of_parts
        at = nearest_rungs(speeds, wanted, xp)
        if beside is None:
            turned = jax.lax.stop_gradient(turn_of(wanted, lengths, excitation))
            beside = _each(parts, A[at], lengths, turned, order)
        off = (wanted - speeds[at])[:, None, None]
        A, slopes = xp.concatenate([A, A[at]]), xp.concatenate([slopes, off * slopes[at]])
    moments = tuple(
        _all_moments(own, first, more, xp)
        for own, more in zip(chains, beside or [None] * len(chains))
    )
    if mixed is None:
        mixed = mixed_for(speeds, h, order, wanted, lengths, span, excitation)
    within = None
    if span > 1:
        level = FIRST_HALVINGS - span.bit_length() + 1
        within = Within.of([jax.tree.map(lambda x: x[:, level], c.starting) for c in chains])
    of_speeds = speeds, mixed.turns, h, A, slopes
    of_steps = order, count, parts, within, mixed.powers, span, xp.asarray(excitation)
    return Ladder(*of_speeds, moments, mixed.mixes, *of_steps)


def _all_moments(chains: Chains, first: Any, beside: Chains | None, xp: Any) -> Moments:
    """Of a part of the state, as `Ladder` has them. `first`: the one whose start is all there is."""
    regular, starting = chains
    if first is not None:
        starting = jax.tree.map(lambda x: x[first][None], starting)
    if beside is not None:
        regular, starting = jax.tree.map(
            lambda a, b: xp.concatenate([a, b]), Chains(regular, starting), beside
        )
    none = Moments(xp.eye(regular.flow.shape[-1])[None], xp.zeros((1, *regular.mean.shape[1:])))
    flat = jax.tree.map(lambda x: x.reshape(x.shape[0] * x.shape[1], *x.shape[2:]), starting)
    return jax.tree.map(lambda *x: xp.concatenate(x), regular, flat, none)


def _within(parts: Parts) -> Float[np.ndarray, "d d"]:
    pattern = np.zeros((parts.size, parts.size))
    for rows in parts.rows:
        pattern[np.ix_(rows, rows)] = 1.0
    return pattern


class Mixed(NamedTuple):
    """`turns`, `mixes` and `powers` of a `Ladder`: of the machine they know no more than its speeds."""

    turns: Float[Array, "s f"]
    mixes: tuple[Array, ...]
    powers: Float[Array, "s n p q"] | None = None


def mixed_for(
    speeds: Float[Array, " s"],
    h: Float[Array, ""],
    order: int,
    speeds_of_parts: Float[Array, " o"],
    lengths: Float[Array, " o"],
    span: int = 1,
    excitation: Float[Array, ""] | float = 0.0,
) -> Mixed:
    """`lengths` of the parts of intervals, s."""
    steps, near = first_steps(order, span), turn_of(speeds, h, excitation)
    turned = jax.lax.stop_gradient(turn_of(speeds_of_parts, lengths, excitation))
    turns = turn_of(_about(speeds), h, excitation)
    fits = jax.vmap(lambda turn, near: fitted_mix(turn, order, near), in_axes=(0, 0))(
        turns.ravel(), jnp.repeat(near, turns.shape[1])
    )
    known = [polynomial_mix(np.array(points), order) for _, points in steps.kinds]
    known.append(jax.tree.map(np.zeros_like, known[-1]))
    mixes = tuple(jnp.concatenate([a, np.stack(b)]) for a, b in zip(fits, zip(*known)))
    if turned.size:
        of_parts = jax.vmap(lambda turn: fitted_mix(turn, order, turn))(turned)
        mixes = tuple(jnp.concatenate(pair) for pair in zip(mixes, of_parts))
    powers = None
    if span > 1:
        powers = jax.lax.stop_gradient(jax.vmap(lambda w: powers_between(w, order, span))(near))
    return Mixed(turns, jax.lax.stop_gradient(mixes), powers)


def _about(speeds: Float[Array, " s"]) -> Float[Array, "s f"]:
    """Speeds about each of them, as far as the next ones, and from the last as far again."""
    apart = speeds[-1] - speeds[-2] if speeds.size > 1 else 2 * speeds[0]
    return jnp.abs(speeds[:, None] + apart * (np.arange(_FITS) / (_FITS - 1) * 1.5 - 0.75))


def _slopes(speeds: Float[Array, " s"], A: Float[Array, "s d d"], xp: Any) -> Float[Array, "s d d"]:
    """dA/dw at each of the speeds, by those beside it."""
    n = speeds.size
    if n == 1:
        return xp.zeros_like(A)
    above, below = np.minimum(np.arange(n) + 1, n - 1), np.maximum(np.arange(n) - 1, 0)
    return (A[above] - A[below]) / (speeds[above] - speeds[below])[:, None, None]
