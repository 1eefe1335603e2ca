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

from .blocks import REGULAR, Blocks
from .fitted_weights import FittedWeights
from .ladder import Ladder
from .progress import PARTS, hand_over
from .step_times import held_within

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
    used, which reverse mode does not know."""

    evaluations: int = 1
    probe: bool = False
    lasting: bool = False


_PLAIN = Method()


class Course(eqx.Module):
    """The states at the grid's instants, or what `watch` kept of them; of each instant the gap of N
    there, and by how much it grew in the step before; of each block what the probe found beside those two."""

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
    k, m = ladder.order, ladder.moments.mean.shape[3]
    length = blocks.length

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

        def instant(j):
            t = begin + j * h
            return t if piece is None else held_within(piece, t)

        def one(carry, j):
            y, N = carry
            x, expected = weights.predict @ jnp.concatenate([y, N.ravel()]), weights.ahead @ N
            if method.probe:
                probing = j == length
                x, expected = jnp.where(probing, y, x), jnp.where(probing, N[0], expected)
            t1 = instant(jnp.minimum(j, count - 1) + 1)
            x, gap, first = _corrected(f, A, weights, follow, method.evaluations, t1, x, expected)
            if method.probe:
                first = jnp.where(probing, first, gap)
            is_step = j < count
            y = jnp.where(is_step, x, y)
            N = jnp.where(is_step, jnp.concatenate([(expected + gap)[None], N[:-1]]), N)
            return (y, N), (y, first if method.probe else None)

        one_again = jax.checkpoint(one, prevent_cse=False)

        def kept(carry, j):
            return one_again(checkpoint_name(carry, "steps"), j)

        (y1, N), (ys, gaps) = jax.lax.scan(kept, (y, N), jnp.arange(length + method.probe))
        ys, pushes = ys[:length], opens | ends
        coarse = jnp.where(pushes, jnp.concatenate([N[:1], coarse[:-1]]), coarse)
        states = jnp.where(pushes, jnp.concatenate([y1[None], states[:-1]]), states)
        states = jnp.where(regular, ys[-k:][::-1], states)
        seen = jnp.concatenate([y[None], ys])
        if watch is not None:
            seen = watch(jax.vmap(instant)(jnp.arange(length + 1.0)), seen)
        told_gaps = (None, None) if gaps is None else _gaps(gaps, regular, count)
        return _Carried(y1, N, coarse, states, rung), (seen, *told_gaps)

    zero = jnp.zeros((k, m))
    rung = ladder.nearest(jax.lax.stop_gradient(speed(blocks.begin[0], y0)))
    first = _Carried(y0, zero, zero, jnp.zeros((k, y0.size)), rung)
    policy = jax.checkpoint_policies.save_only_these_names("steps")
    block = jax.checkpoint(block, prevent_cse=False, policy=policy)
    if method.lasting or told:
        found = _while_used(block, first, blocks, told)
    else:
        _, found = jax.lax.scan(block, first, blocks.per_block)
    seen, grown, probed = found

    def at_samples(x):
        return x.reshape(x.shape[0] * x.shape[1], *x.shape[2:])[blocks.samples]

    return Course(
        jax.tree.map(at_samples, seen), None if grown is None else at_samples(grown), probed
    )


def _corrected(
    f: Field, A, weights: FittedWeights, follow, evaluations: int, t1, x: Vector, expected
) -> tuple[Vector, Array, Array]:
    """From what was predicted, and N `expected` there: the corrected state, by how much N there differs from
    that, and by how much N at the predicted state does."""
    rows = x.size - expected.size

    def evaluated(carry, _):
        x, gap = carry
        seen = f(t1, x)[rows:] - A[rows:] @ x - expected
        further = seen - gap
        further = further + follow @ further
        return (x + weights.correct @ further, gap + further), seen

    begin = (x, jnp.zeros(expected.size))
    if evaluations == 1:
        (x, gap), first = evaluated(begin, None)
        return x, gap, first
    (x, gap), seen = jax.lax.scan(evaluated, begin, None, length=evaluations)
    return x, gap, seen[0]


def _gaps(gaps: Float[Array, "l+1 m"], regular, count) -> tuple[Array, Array]:
    """Of a block whose last step is the probe: the gap and its growth at its begin and behind each step,
    where they are known; and what the probe found beside the last of both."""
    gaps, length = jax.lax.stop_gradient(gaps), gaps.shape[0] - 1
    before, last, found = gaps[length - 2 :]
    probed = jnp.stack([found, last, last - before])
    probed = jnp.where(regular & (count == length), probed, 0.0)
    known = regular & (jnp.arange(length) < count)
    own = jnp.where(known[:, None], gaps[:length], 0.0)
    grown = jnp.stack([own[1:], own[1:] - own[:-1]], axis=1)
    return jnp.pad(grown, ((2, 0), (0, 0), (0, 0))), probed


def _rebased(N: Float[Array, "k m"], states: Float[Array, "k d"], change: Float[Array, "d d"]):
    """The history of another linearisation, by how much A is less now: the field `A y + N` was what it
    was."""
    return N + states @ change[states.shape[1] - N.shape[1] :].T


def _while_used(block, first: _Carried, blocks: Blocks, told: bool) -> Any:
    """What a scan gives, part by part, until nothing more happens."""
    n = blocks.begin.size
    size = -(-n // PARTS)
    at = np.arange(-(-n // size) * size).reshape(-1, size)
    among = np.minimum(at, n - 1)
    per_block = jax.tree.map(lambda x: x[among], blocks.per_block)
    # beyond the end the last block is gone through without a step
    per_block = (*per_block[:2], jnp.where(at < n, per_block[2], 0), *per_block[3:])
    sampled = jnp.zeros((n, blocks.length + 1), bool)
    sampled = sampled.ravel().at[blocks.samples].set(True).reshape(n, -1)[among]
    new = sampled & (at < n)[..., None]

    def part(i, carry):
        carried, kept = carry
        own = jax.tree.map(lambda x: x[i], per_block)
        carried, found = jax.lax.scan(block, carried, own)
        if told:
            states = found[0].reshape(size * (blocks.length + 1), found[0].shape[-1])
            hand_over(own[0][-1], states, new[i].ravel())
        return carried, jax.tree.map(lambda a, b: a.at[i].set(b), kept, found)

    one = jax.tree.map(lambda x: x[0], per_block)
    shapes = jax.eval_shape(lambda: jax.lax.scan(block, first, one)[1])
    kept = jax.tree.map(lambda x: jnp.zeros((len(at), *x.shape), x.dtype), shapes)
    _, kept = jax.lax.fori_loop(0, -(-blocks.used // size), part, (first, kept))
    return jax.tree.map(lambda x: x.reshape(len(at) * size, *x.shape[2:])[:n], kept)
