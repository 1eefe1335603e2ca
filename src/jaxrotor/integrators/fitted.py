"""Exponentially fitted Adams: what N does most is turn with the shaft, so the weights know its speed.

N, the part of `dy/dt = A y + N(t, y)` that A leaves, is taken through its last k values as a mix of
`1, s, ..., s^(k-3), cos(θ s), sin(θ s)`, θ the angle that the shaft turns by in a step (s in steps), and
that mix is integrated exactly with exp(hA). Literature: Gautschi, Numer. Math. 3 (1961) 381; Ixaru &
Vanden Berghe, Exponential Fitting (2004).

A step predicts, evaluates and corrects (PEC): ONE evaluation, at the predicted point, serves the corrector
and the history. That is stable while A is near the machine's own Jacobian, to within what `follow` knows of
it: so A goes with the speed, and the fit too, on a ladder that is climbed at the ends of blocks of steps.
Where N has a rate λ of its own that neither knows, h λ must stay below 0.16, 0.08, 0.04 at orders 4, 5, 6:
there a step may evaluate and correct twice.

All that a run does stands in one loop body, its start and its restarts behind jumps too, so that a program
holds the field once.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.ad_checkpoint import checkpoint_name
from jaxtyping import Array, Float

from .abreast import scanned_abreast
from .blocks import REGULAR, Blocks
from .dense_output import samples_within
from .fitted_weights import FittedWeights
from .ladder import Ladder
from .progress import PARTS, hand_over
from .step_times import held_within
from .tangents import tangents_in_turn

Vector = Float[Array, " d"]
Field = Callable[[Array, Vector], Vector]


class _Carried(NamedTuple):
    """Between blocks. `N` at the last k points, newest first, and `coarse`, at the ends of regular steps
    while the history fills; `states` where either stands; `rung` of the ladder."""

    y: Vector
    N: Float[Array, "k m"]
    coarse: Float[Array, "k m"]
    states: Float[Array, "k d"]
    rung: Array


class Method(NamedTuple):
    """`evaluations` of the field in a step. `probe`: whether each block ends with one more, at its last
    state, by which the run's error is known. `lasting`: whether only as many blocks are gone through as are
    used, which reverse mode does not know. `forward`: whether it is derived by forward mode, if at all.
    `abreast`: whether it is not, and members of a batch are to go side by side."""

    evaluations: int = 1
    probe: bool = False
    lasting: bool = False
    forward: bool = False
    abreast: bool = False


_PLAIN = Method()


class Course(eqx.Module):
    """The states at the grid's instants, or what `watch` kept of them; of each that a step ends at, unless
    jumps are in it, the gap of N there, and by how much it grew in the step before; of each block what the
    probe found beside those two."""

    kept: Any
    gaps: Float[Array, "g 2 m"] | None
    probes: Float[Array, "n 3 m"] | None


def run_through(
    f: Field,
    ladder: Ladder,
    blocks: Blocks,
    speed: Callable[[Array, Vector], Array],
    y0: Vector,
    method: Method = _PLAIN,
    tick: Callable[[Array, Vector, Array], Vector] | None = None,
    watch: Callable[[Float[Array, " b"], Float[Array, "b d"]], Any] | None = None,
    told: bool = False,
) -> Course:
    """`speed(t, y)`: rad/s. `tick(t, y, due)`: what changes the state where clocks tick; what is returned is
    the state behind it. `watch`: what is kept of a block's instants and states. `told`: what is at the
    samples is handed over, part by part, while it comes.
    """
    k, m, span = ladder.order, ladder.with_N, ladder.span
    length, exact = blocks.length, (method.lasting or told) and watch is None

    def block(carried: _Carried, x):
        begin, h, count, kind, odd, opens, filled, ends, piece, due = x
        y, N, coarse, states, before = carried
        if tick is not None:
            y = tick(begin, y, due)
        # a history is of one linearisation while it fills
        regular = kind == REGULAR
        middle = begin + 0.5 * jnp.where(regular, length * h, 0.0)
        own = jax.lax.stop_gradient(speed(middle, y))
        rung = jnp.where(opens | regular, ladder.nearest(own), before)
        at = ladder.linearisation(rung, odd)
        A, weights = ladder.A[at], ladder.weights(rung, odd, kind, own)
        follow = ladder.follow(at, rung, odd, own, weights)
        N = jnp.where(filled, coarse, N)
        N = _rebased(N, states, ladder.A[ladder.linearisation(before, odd)] - A)
        lower = ladder.lower(A[y0.size - m :])

        # the probe stands behind the last step
        last = count if exact else length

        def instant(j):
            t = begin + j * h
            return t if piece is None else held_within(piece, t)

        def one(carry, j):
            y, N = carry
            x, expected = weights.predict @ jnp.concatenate([y, N.ravel()]), weights.ahead @ N
            if method.probe:
                probing = j == last
                x, expected = jnp.where(probing, y, x), jnp.where(probing, N[0], expected)
            t1 = instant(jnp.minimum(j, count - 1) + 1)
            x, gap, first = _corrected(
                f, lower, weights, follow, method.evaluations, t1, x, expected
            )
            if method.probe:
                first = jnp.where(probing, first, gap)
            is_step = j < count
            y = jnp.where(is_step, x, y)
            N = jnp.where(is_step, jnp.concatenate([(expected + gap)[None], N[:-1]]), N)
            return (y, N), (y, N[0] if span > 1 else None, first if method.probe else None)

        begun = N
        if exact:
            (y1, N), kept = _as_many(one, (y, N), last + method.probe, length + method.probe)
        elif method.abreast:
            (y1, N), kept = scanned_abreast(one, (y, N), length + method.probe)
        else:
            ready = tangents_in_turn(one) if method.forward else _made_again(one)
            steps = jnp.arange(length + method.probe)
            (y1, N), kept = jax.lax.scan(ready, (y, N), steps)
        ys, Ns, gaps = kept
        ys, pushes = ys[:length], opens | ends
        coarse = jnp.where(pushes, jnp.concatenate([N[:1], coarse[:-1]]), coarse)
        states = jnp.where(pushes, jnp.concatenate([y1[None], states[:-1]]), states)
        states = jnp.where(regular, ys[-k:][::-1], states)
        seen = jnp.concatenate([y[None], ys])
        if span > 1:
            history = jnp.concatenate([begun[::-1], Ns[:length]])
            own_steps = regular & (odd < 0)
            more = _with_samples(ladder, rung, own, seen, history, own_steps)
            seen = jnp.concatenate([y[None], more])
        if watch is not None:
            seen = watch(jax.vmap(instant)(jnp.arange(blocks.width) / span), seen)
        probed = None
        if gaps is not None:
            probed = _probed(gaps, last, regular & (count == length))
        return _Carried(y1, N, coarse, states, rung), (seen, gaps, probed)

    zero = jnp.zeros((k, m))
    rung = ladder.nearest(jax.lax.stop_gradient(speed(blocks.begin[0], y0)))
    first = _Carried(y0, zero, zero, jnp.zeros((k, y0.size)), rung)
    policy = jax.checkpoint_policies.save_only_these_names("steps")
    block = jax.checkpoint(block, prevent_cse=False, policy=policy)
    if exact:
        return _while_used(block, first, blocks, m, method.probe, told)
    _, (seen, gaps, probed) = jax.lax.scan(block, first, blocks.per_block)

    def at_samples(x):
        return x.reshape(x.shape[0] * x.shape[1], *x.shape[2:])[blocks.samples]

    grown = None
    if gaps is not None:
        own, step = jnp.divmod(blocks.samples[::span], blocks.width)
        step = step // span
        known = (step >= 2) & (blocks.kind[own] == REGULAR) & (step <= blocks.count[own])
        step = jnp.maximum(step, 2)
        grown = jax.vmap(_grown)(known, gaps[own, step - 1], gaps[own, step - 2])
    return Course(jax.tree.map(at_samples, seen), grown, probed)


def _as_many(one: Callable, carry: Any, count: Array | int, most: int) -> Any:
    """`one` so many times; what it gives as `scan` does, zeros beyond."""
    shapes = jax.eval_shape(one, carry, jnp.asarray(0))[1]
    kept = jax.tree.map(lambda x: jnp.zeros((most, *x.shape), x.dtype), shapes)

    def step(j, both):
        carry, kept = both
        carry, found = one(carry, j)
        place = jax.lax.dynamic_update_index_in_dim
        return carry, jax.tree.map(lambda a, b: place(a, b, j, 0), kept, found)

    return jax.lax.fori_loop(0, count, step, (carry, kept))


def _with_samples(
    ladder: Ladder, rung, speed, seen: Float[Array, "l+1 d"], history: Float[Array, "l+k m"], whole
) -> Float[Array, "ln d"]:
    """The states at each sample of a block, of those at the ends of its steps, with where it begins; the same
    again within steps that are not `whole`."""
    begin, ys = seen[:-1], seen[1:]
    own, coefficients = ladder.between_samples(rung, speed)
    within = samples_within(own, ladder.parts, coefficients, begin, history)
    within = jnp.where(whole, within, ys[:, None])
    return jnp.concatenate([within, ys[:, None]], axis=1).reshape(-1, ys.shape[1])


def _made_again(one: Callable) -> Callable:
    """Backwards, of each step what it began with is kept, and the rest is made once more."""
    again = jax.checkpoint(one, prevent_cse=False)
    return lambda carry, j: again(checkpoint_name(carry, "steps"), j)


def _corrected(
    f: Field, lower, weights: FittedWeights, follow, evaluations: int, t1, x: Vector, expected
) -> tuple[Vector, Array, Array]:
    """From what was predicted, and N `expected` there: the corrected state, by how much N there differs from
    that, and by how much N at the predicted state does. `lower`: A's rows that have an N."""
    rows = x.size - expected.size

    def evaluated(carry, _):
        x, gap = carry
        seen = f(t1, x)[rows:] - lower @ x - expected
        further = seen - gap
        further = further + follow @ further
        return (x + weights.correct @ further, gap + further), seen

    begin = (x, jnp.zeros(expected.size))
    if evaluations == 1:
        (x, gap), first = evaluated(begin, None)
        return x, gap, first
    (x, gap), seen = jax.lax.scan(evaluated, begin, None, length=evaluations)
    return x, gap, seen[0]


def _probed(gaps: Float[Array, "l m"], last, whole) -> Float[Array, "3 m"]:
    """Of a block whose probe is its row `last`: what it found, the gap before it, and by how much that had
    grown. Zero where the block is not `whole`."""
    found = jax.lax.dynamic_slice_in_dim(gaps, last - 2, 3)
    before, gap, probe = jax.lax.stop_gradient(found)
    return jnp.where(whole, jnp.stack([probe, gap, gap - before]), 0.0)


def _grown(known, gap: Float[Array, " m"], before: Float[Array, " m"]) -> Float[Array, "2 m"]:
    """The gap, and by how much it grew in a step, where both are known."""
    gap, before = jax.lax.stop_gradient((gap, before))
    return jnp.where(known, jnp.stack([gap, gap - before]), 0.0)


def _rebased(N: Float[Array, "k m"], states: Float[Array, "k d"], change: Float[Array, "d d"]):
    """The history of another linearisation, by how much A is less now: the field `A y + N` was what it
    was."""
    return N + states @ change[states.shape[1] - N.shape[1] :].T


def _while_used(block, first: _Carried, blocks: Blocks, m: int, probe: bool, told: bool) -> Course:
    """Through the blocks that are used; of their steps only those at samples are kept."""
    n, width, span = blocks.begin.size, blocks.width, blocks.span
    samples, d = blocks.samples, first.y.size
    place = jax.lax.dynamic_update_index_in_dim
    # they are in the order of the blocks; behind the end the last one is repeated
    edges = jnp.searchsorted(samples, np.arange(n + 1) * width)
    fresh = jnp.concatenate([jnp.ones(1, bool), samples[1:] > samples[:-1]])

    def one(b, carry):
        carried, course = carry
        own = jax.tree.map(lambda x: x[b], blocks.per_block)
        carried, (seen, gaps, probed) = block(carried, own)

        def sample(i, course):
            step = samples[i] - b * width
            kept, grown = place(course.kept, seen[step], i, 0), None
            if probe:
                # the last sample in a step is where it ends
                step = -(-step // span)
                known = (step >= 2) & (own[3] == REGULAR) & (step <= own[2])
                grown = _grown(known, gaps[step - 1], gaps[step - 2])
                grown = place(course.gaps, grown, -(-i // span), 0)
            return Course(kept, grown, course.probes)

        course = jax.lax.fori_loop(edges[b], edges[b + 1], sample, course)
        if probe:
            course = Course(course.kept, course.gaps, place(course.probes, probed, b, 0))
        return carried, course

    found = Course(jnp.zeros((samples.size, d)), None, None)
    if probe:
        ends = -(-(samples.size - 1) // span) + 1
        found = Course(found.kept, jnp.zeros((ends, 2, m)), jnp.zeros((n, 3, m)))
    if not told:
        return jax.lax.fori_loop(0, blocks.used, one, (first, found))[1]
    size = -(-n // PARTS)
    most = min(size * width, samples.size)

    def part(i, carry):
        end = jnp.minimum((i + 1) * size, blocks.used)
        carry = jax.lax.fori_loop(i * size, end, one, carry)
        begin = jnp.minimum(edges[i * size], samples.size - most)
        states = jax.lax.dynamic_slice_in_dim(carry[1].kept, begin, most)
        at = begin + np.arange(most)
        hand_over(
            blocks.begin[end - 1], states, fresh[at] & (at >= edges[i * size]) & (at < edges[end])
        )
        return carry

    return jax.lax.fori_loop(0, -(-blocks.used // size), part, (first, found))[1]
