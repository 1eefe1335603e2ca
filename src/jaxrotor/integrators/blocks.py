"""A run as a list of blocks of steps: every block has steps of one length, by one set of weights.

A run's instants are a grid of equal intervals, with `substeps` steps in each, or `span` of them in a step,
and jumps in force between them at instants that may be traced. Between two instants where the history of N is
lost (jumps; clocks that tick) lies a stretch: whole intervals by regular steps, or the part of an interval on
one side of a jump, by as many shorter ones. Each begins with the short steps by which its history fills.
Where steps span intervals, those that a jump cuts go by stretches of single intervals up to its own and on
behind it.
"""

import math
from typing import Any, NamedTuple

import equinox as eqx
import equinox.internal as eqxi
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .fitted_weights import FirstSteps, first_steps

# Steps in a block, inside which the weights stay, and in the longest: to mix weights takes as long as five to
# ten steps, but speeds change.
LENGTH, LONGEST = 24, 96
# Steps that take as long as to mix weights.
_MIXING = 8
# Where clocks tick stretches are short.
_SHORT = 4
# Kinds of weights beside those of the start: of regular steps, and of none, where N is evaluated alone.
REGULAR, ALONE = -2, -1


def between_jumps(order: int, jumps: int, steps: int, span: int = 1) -> int:
    """Steps in a block, at most: each of the stretches beside jumps begins with blocks that use few, and
    where all are gone through, used or not, most of the work is theirs. `span`: samples in a step."""
    stretches = 1 + (3 if span == 1 else 5) * jumps
    filled = stretches * (int(filling(order, order, span).upto[-1]) + 1)
    return max(order, math.isqrt(_MIXING * steps // filled))


class Pattern(NamedTuple):
    """The blocks by which a history of `order` values fills; in steps of the stretch.

    Of each block: `offset` of its begin, the length `step` of its `count` steps, the `kind` of their weights,
    and whether its `end` is that of a regular step. The first evaluates N where the stretch begins. `upto`:
    blocks that are needed for so many steps. `samples`: of each, in which block, and behind how many steps.
    """

    steps: FirstSteps
    offset: np.ndarray
    step: np.ndarray
    count: np.ndarray
    kind: np.ndarray
    end: np.ndarray
    upto: np.ndarray
    samples: np.ndarray


def filling(order: int, longest: int, span: int = 1) -> Pattern:
    """`longest`: steps in a block; `span`: samples in a step."""
    first = first_steps(order, span)
    rows: list[list[Any]] = [[0.0, 0.0, 1, ALONE, False]]
    begin, samples = np.concatenate([[0.0], first.ends[:-1]]), []
    for a, b, kind in zip(begin, first.ends, first.which):
        last = rows[-1]
        if kind == last[3] and last[2] < longest and not last[4]:
            last[2] += 1
        else:
            rows.append([a, b - a, 1, int(kind), False])
        rows[-1][4] = b % 1 == 0
        if b * span % 1 == 0:
            samples.append([len(rows) - 1, rows[-1][2]])
    offset, step, count, kind, end = (np.array(x) for x in zip(*rows))
    upto = np.array([1] + [int(np.sum(offset < p)) for p in range(1, order)])
    return Pattern(first, offset, step, count, kind, end, upto, np.array(samples))


class Blocks(eqx.Module):
    """Of each block: `begin` (s), length `step` (s) and number `count` of its steps; `kind` of the weights:
    `REGULAR`, `ALONE` (N is evaluated where a stretch begins), or of `first_steps`; `odd`: which part of
    an interval beside a jump it belongs to, -1 for whole intervals; `opens`: whether it is a stretch's
    first block, `filled`: its first regular one; `ends`: whether it ends at a regular step while the
    history fills; `piece`, (n, 2), the first and the last instant at which the force may be looked at;
    `ticks`: the clocks that tick at its begin.

    `samples`: where the grid's instants are among the states at each block's begin and at each of the `span`
    samples of each of `length` steps. `used`: blocks that something happens in, the others follow. `lengths`:
    of a step in each part of an interval, s, and beside each jump in a step that it cuts; `starts`: when they
    begin.
    """

    begin: Float[Array, " n"]
    step: Float[Array, " n"]
    count: Int[Array, " n"]
    kind: Int[Array, " n"]
    odd: Int[Array, " n"]
    opens: Bool[Array, " n"]
    filled: Bool[Array, " n"]
    ends: Bool[Array, " n"]
    piece: Float[Array, "n 2"] | None
    ticks: Bool[Array, "n c"] | None
    samples: Int[Array, " g"]
    used: Int[Array, ""]
    lengths: Float[Array, " o"]
    starts: Float[Array, " o"]
    length: int = eqx.field(static=True)
    span: int = eqx.field(static=True, default=1)

    @property
    def width(self) -> int:
        """States of a block."""
        return self.length * self.span + 1

    @property
    def per_block(self) -> tuple:
        """What a block is made by."""
        times = (self.begin, self.step, self.count, self.kind, self.odd)
        return *times, self.opens, self.filled, self.ends, self.piece, self.ticks

    @property
    def single(self) -> bool:
        """Whether there is but one stretch."""
        return self.ticks is None and not self.lengths.size


class _Stretches(NamedTuple):
    """In order of time: `begin` (s), length of a `step` (s), number of `steps`, blocks (`rows`), jumps
    that are `passed`, the grid's instant where it begins, or one beyond all where no instant is looked for in
    it, and which part of an interval it is, or -1."""

    begin: Any
    step: Any
    steps: Any
    rows: Any
    passed: Any
    instant: Any
    odd: Any


def blocks_of(
    interval: Float[Array, ""],
    intervals: int | Array,
    substeps: int | Array,
    order: int,
    jumps: Float[Array, " j"],
    ticks: Bool[np.ndarray, "g c"] | None = None,
    length: int = LENGTH,
    room: tuple[int, int, int] | None = None,
    span: int = 1,
) -> Blocks:
    """From t = 0 through so many intervals (s). `ticks`: which clocks tick at the grid's instants. Jumps
    outside the run are moved to its ends, where they do nothing. `length`: steps in a block. `room`: the most
    intervals, steps in all and in an interval, where their numbers are traced. `span`: intervals in a step, a
    power of two; where it is more than one, `substeps` is one, and nothing ticks."""
    count, n, G = jumps.shape[0], substeps, -(-intervals // span)
    sizes: Any = room or (intervals, G * n, n)
    most, in_all, in_part = sizes
    sample, interval = interval, interval * span
    due = np.zeros(0, int)
    if ticks is not None:
        due = np.flatnonzero(ticks.any(axis=1))
        due, length = due[due > 0], min(length, max(_SHORT, order))
    pattern = filling(order, length, span)
    # without jumps all is known beforehand
    xp: Any = jnp if count or room else np
    last = G * interval
    # chosen, not clipped: at the very end a clip has half a derivative
    inside = jnp.sort(jnp.where(jumps < 0.0, 0.0, jnp.where(jumps > last, last, jumps)))
    cells = xp.zeros(0, int)
    if count:
        at = jax.lax.stop_gradient(inside / interval)
        cells = jnp.clip(jnp.floor(at), 0, G - 1).astype(int)

    def rows_of(steps):
        more = -(-xp.maximum(steps - (order - 1), 0) // length)
        return xp.asarray(pattern.upto)[xp.minimum(steps, order - 1)] + more

    whole = _whole_intervals(xp, due, cells, G, n, interval, rows_of)
    total = int(rows_of_most(pattern, in_all, length, due.size + 1 + count))
    # the stretches that instants are looked for in
    stretches = on_grid = whole._replace(instant=whole.instant * span)
    lengths, starts = jnp.zeros(0), jnp.zeros(0)
    if count:
        fine = cells
        if span > 1:
            fine = jnp.clip(jnp.floor(jax.lax.stop_gradient(inside / sample)), 0, G * span - 1)
            fine = fine.astype(int)
        parts = _parts(inside, fine, G * span, n, sample, rows_of)
        lengths, starts, beside = parts.step, parts.begin, [parts]
        total += 2 * count * rows_of_most(pattern, in_part, length, 1)
        if span > 1:
            singles = _singles(fine, cells, span, sample, rows_of)
            on_grid = _joined([on_grid, singles])
            lengths = jnp.append(lengths, jnp.full(count, sample))
            starts, beside = jnp.append(starts, inside), [singles, parts]
            total += 2 * count * rows_of_most(pattern, span, length, 1)
        stretches = _joined([whole, *beside])
        sequence = jnp.argsort(jax.lax.stop_gradient(stretches.begin), stable=True)
        stretches = _Stretches(*(x[sequence] for x in stretches))
        place = jnp.argsort(sequence)[: on_grid.instant.shape[0]]
    else:
        place = np.arange(on_grid.instant.shape[0])
    behind = xp.cumsum(stretches.rows)
    if xp is np:
        total = int(behind[-1])
    top = (behind - stretches.rows)[place]

    row = np.arange(total)
    mine = xp.minimum(xp.searchsorted(behind, row, side="right"), behind.shape[0] - 1)
    own = _Stretches(*(x[mine] for x in stretches))
    b = row - (behind - stretches.rows)[mine]
    used = row < behind[-1]
    fills = xp.asarray(pattern.upto)[xp.minimum(own.steps, order - 1)]
    regular = b >= fills
    at = xp.minimum(b, len(pattern.kind) - 1)

    def told(those, other):
        return xp.where(regular, other, xp.asarray(those)[at])

    done = order - 1 + (b - fills) * length
    counts = told(pattern.count, xp.clip(own.steps - done, 0, length))
    piece = None
    if count:
        none = jnp.full(1, jnp.inf)
        after = jnp.concatenate([-none, eqxi.nextafter(inside)])
        until = jnp.concatenate([eqxi.prevbefore(inside), none])
        piece = jax.lax.stop_gradient(jnp.stack([after, until], axis=1))[own.passed]
    opens = used & (b == 0)
    own_ticks = None
    if ticks is not None:
        own_ticks = xp.asarray(ticks)[own.instant] & (opens & (own.odd < 0))[:, None]
    instants = xp.minimum(np.arange(most + 1), intervals)
    samples = _samples(xp, pattern, on_grid, top, instants, n, order, length, span)
    return Blocks(
        begin=jnp.asarray(own.begin + told(pattern.offset, done) * own.step),
        step=jnp.asarray(told(pattern.step, 1.0) * own.step),
        count=jnp.asarray(xp.where(used, counts, 0)),
        kind=jnp.asarray(told(pattern.kind, REGULAR)),
        odd=jnp.asarray(own.odd),
        opens=jnp.asarray(opens),
        filled=jnp.asarray(regular & (b == fills)),
        ends=jnp.asarray(told(pattern.end, False)),
        piece=piece,
        ticks=None if own_ticks is None else jnp.asarray(own_ticks),
        samples=jnp.asarray(samples),
        used=jnp.asarray(behind[-1]),
        lengths=lengths,
        starts=starts,
        length=length,
        span=span,
    )


def _joined(several: list[_Stretches]) -> _Stretches:
    return _Stretches(*(jnp.concatenate(x) for x in zip(*several)))


def rows_of_most(pattern: Pattern, steps: int, length: int, stretches: int) -> int:
    """Blocks that so many steps have at most, in so many stretches."""
    return stretches * (int(pattern.upto[-1]) + 1) + -(-steps // length)


def _whole_intervals(xp, due, cells, G, n, interval, rows_of) -> _Stretches:
    """From the start, from each tick, and from behind each interval with a jump."""
    first = xp.sort(xp.concatenate([np.array([0]), due, cells + 1]))
    to_tick = xp.append(xp.asarray(due), G)[xp.searchsorted(due, first, side="right")]
    to_jump = xp.append(cells, G)[xp.searchsorted(cells, first, side="left")]
    again = xp.concatenate([first[:-1] == first[1:], np.array([False])])
    steps = xp.where(again, 0, xp.maximum(xp.minimum(to_tick, to_jump) - first, 0) * n)
    rows = xp.where(again, 0, rows_of(steps))
    passed = xp.searchsorted(cells, first, side="left")
    step = xp.ones(first.shape) * interval / n
    return _Stretches(first * interval, step, steps, rows, passed, first, xp.full(first.shape, -1))


def _parts(inside, cells, G, n, interval, rows_of) -> _Stretches:
    """Of intervals: before each jump, where it is the first in its interval, and behind it."""
    count = cells.shape[0]
    end = jnp.minimum((cells + 1) * interval, G * interval)
    cut = jnp.concatenate([inside[1:], jnp.full(1, jnp.inf)])
    before = jnp.concatenate([jnp.full(1, True), cells[1:] != cells[:-1]])
    # the quotient may round up to a cell that begins behind the jump
    at = cells * interval
    at = at + jax.lax.stop_gradient(jnp.minimum(inside - at, 0.0))
    begin = jnp.stack([jnp.where(before, at, inside), inside], axis=1).ravel()
    ends = jnp.stack([inside, jnp.where(cut < end, cut, end)], axis=1).ravel()
    used = jnp.stack([before, jnp.full(count, True)], axis=1).ravel()
    which = jnp.arange(2 * count)
    steps = jnp.full(2 * count, n)
    rows = jnp.where(used, rows_of(steps), 0)
    none = jnp.zeros(2 * count, int)
    return _Stretches(begin, (ends - begin) / n, steps, rows, (which + 1) // 2, none, which)


def _singles(fine, cells, span: int, sample, rows_of) -> _Stretches:
    """Of steps that a jump cuts: the intervals from their begin, or from behind the jump before, to the
    jump's own, and those behind it to the step's end, where no other jump follows in it. `fine`: the
    intervals that the jumps are in, `cells`: the steps."""
    count = cells.shape[0]
    inner = cells[1:] == cells[:-1]
    no = jnp.zeros(1, bool)
    again, more = jnp.concatenate([no, inner]), jnp.concatenate([inner, no])
    ahead = jnp.where(again, jnp.roll(fine, 1) + 1, cells * span)
    behind, end = fine + 1, (cells + 1) * span
    begin = jnp.concatenate([ahead, behind])
    steps = jnp.concatenate([fine - ahead, end - behind])
    # where the jump's own interval begins with the stretch its state is looked for there
    used = jnp.concatenate([fine >= ahead, ~more & (end > behind)])
    which = jnp.arange(count)
    steps = jnp.where(used, steps, 0)
    return _Stretches(
        begin * sample,
        jnp.full(2 * count, sample),
        steps,
        jnp.where(used, rows_of(steps), 0),
        jnp.concatenate([which, which + 1]),
        jnp.where(used, begin, jnp.iinfo(begin.dtype).max),
        jnp.tile(2 * count + which, 2),
    )


def _samples(
    xp,
    pattern: Pattern,
    stretches: _Stretches,
    top,
    instants,
    n,
    order: int,
    length: int,
    span: int,
):
    """Each instant of the grid lies in the last of the stretches that begins before or at it. `top`: the
    first block of each."""
    first, single = stretches.instant, stretches.odd >= 0
    if span > 1 and xp is not np:
        by = xp.argsort(first, stable=True)
        first, single, top = first[by], single[by], top[by]
    stretch = xp.searchsorted(first, instants, side="right") - 1
    # steps of one interval have no samples within
    width = xp.where(single[stretch], 1, span)
    past = (instants - first[stretch]) * n
    p = -(-past // width)  # the step that ends there, or that it is in
    early = xp.asarray(pattern.samples)[
        xp.clip(past * (span // width) - 1, 0, len(pattern.samples) - 1)
    ]
    late = xp.maximum(p - order, 0)
    block = xp.where(p < order, early[:, 0], int(pattern.upto[-1]) + late // length)
    slot = xp.where(p < order, early[:, 1], late % length + 1)
    row = slot * span - xp.where(p < order, 0, p * width - past)
    at_begin = past == 0
    block, row = xp.where(at_begin, 0, block), xp.where(at_begin, 0, row)
    return (top[stretch] + block) * (length * span + 1) + row
