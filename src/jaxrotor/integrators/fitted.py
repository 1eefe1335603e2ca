"""Exponentially fitted Adams: what N does most is turn with the shaft, so the weights know its speed.

N, the part of `dy/dt = A y + N(t, y)` that A leaves, is taken through its last k values as a mix of
`1, s, ..., s^(k-3), cos(θ s), sin(θ s)`, θ the angle that the shaft turns by in a step (s in steps), and
that mix is integrated exactly with exp(hA). Literature: Gautschi, Numer. Math. 3 (1961) 381; Ixaru &
Vanden Berghe, Exponential Fitting (2004).

A step predicts, evaluates and corrects (PEC): ONE evaluation, at the predicted point, serves the corrector
and the history. That is stable while A is near the machine's own Jacobian, so A goes with the speed: a
ladder of linearisations, each with weights of its own, changed at the ends of blocks of steps (`ladder`).
"""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .phi import balance, phi_functions, turning_powers

# rad: with so much to a step the past values tell the pair apart well; at half a turn they cannot at all.
LARGEST_TURN = 2.0

Vector = Float[Array, " d"]


class FittedWeights(eqx.Module):
    """Of one step, or stacked in front. m of the d rows have an N.

    `predict` acts on (y, N of the last k points, newest first); `ahead` extrapolates N to the step's end;
    `correct` acts on what the evaluation there differs from that.
    """

    predict: Float[Array, "d dkm"]
    correct: Float[Array, "d m"]
    ahead: Float[Array, " k"]


def turn_of(speed: Float[Array, ""], h: Float[Array, ""]) -> Float[Array, ""]:
    """The angle that a step is fitted to."""
    return jnp.clip(jnp.abs(speed * h), 0.0, LARGEST_TURN)


def fitted_weights(
    A: Float[Array, "d d"],
    h: Float[Array, ""],
    turn: Float[Array, ""],
    order: int,
    exact_rows: int = 0,
    past: Sequence[Sequence[float]] | None = None,
) -> FittedWeights:
    """Weights of a step of length h (s) in which the shaft turns by `turn` (rad, below π), by `order` past
    values (3 to 7).

    `exact_rows`: in how many leading rows the vector field is A's alone. `past`: the points that the past
    values are at, in steps, the newest first, `((0, -1, ..., 1 - order),)` unless given; a row for each
    set of points that weights are wanted for, stacked. A row of fewer points has a mix of fewer terms, and
    columns of zeros behind them.
    """
    rows = past if past is not None else [-np.arange(order, dtype=float)]
    d = balance(A)
    _, phi = phi_functions(h * A * d[None, :] / d[:, None], order + 1, turn)
    phi = phi * (d[:, None] / d[None, :])
    first = phi[0] + jnp.eye(A.shape[0])
    found = [_mixes(np.asarray(row, float), turn, order) for row in rows]
    past_mix, next_mix, ahead = (jnp.stack(x) for x in zip(*found))
    moments = h * phi[1:, :, exact_rows:]
    predict = jnp.einsum("rjq,qab->rajb", past_mix, moments)
    predict = predict.reshape(len(rows), A.shape[0], -1)
    first = jnp.broadcast_to(first, (len(rows), *first.shape))
    correct = jnp.einsum("rq,qab->rab", next_mix, moments)
    weights = FittedWeights(jnp.concatenate([first, predict], axis=2), correct, ahead)
    return weights if past is not None else jax.tree.map(lambda x: x[0], weights)


def _mixes(points: np.ndarray, turn: Float[Array, ""], order: int) -> tuple[Array, Array, Array]:
    """In terms of the order + 1 functions that `phi_functions` integrates: the mix that is one at each of
    the points and zero at the others, (order, order + 1); the one that is zero at all and one at the
    step's end, (order + 1,); and the former's values there, (order,)."""
    n = points.size
    at = jnp.asarray(np.append(points, 1.0))

    def basis(count):
        values, terms = zip(*(_function(i, i >= count - 2, at, turn, order) for i in range(count)))
        return jnp.stack(values, axis=1), jnp.stack(terms)

    values, terms = basis(n)
    mix = jnp.linalg.inv(values[:n])
    values_next, terms_next = basis(n + 1)
    omega = jnp.linalg.inv(values_next)[:, n]
    missing = order - n
    return (
        jnp.pad(mix.T @ terms, ((0, missing), (0, 0))),
        omega @ terms_next,
        jnp.pad(values[n] @ mix, (0, missing)),
    )


def _function(i: int, turning: bool, at: Array, turn, order: int) -> tuple[Array, Array]:
    """The i-th function of a basis at the points `at`, and its terms in those of `phi_functions`, of which
    the last two turn."""
    unit = np.eye(order + 1)
    if not turning or i == 0:  # alone in its basis, or beside s alone: constant and straight
        return at**i / float(np.prod(np.arange(1.0, i + 1))), jnp.asarray(unit[i])
    terms, factor = jnp.zeros(order + 1), 1.0
    for n in range(i, order + 1, 2):  # u_n = s^n/n! - turn² u_(n+2)
        terms = terms + factor * unit[n]
        factor = -factor * turn**2
    return turning_powers(at, turn, i, 1)[0], terms


def first_steps(order: int, halvings: int = 6) -> tuple[np.ndarray, list[np.ndarray]]:
    """How a history fills, from one value at the start: lengths of the steps, in regular ones, and the
    points that each has behind it, in its own length.

    The first is shorter by 2^halvings, since it knows two values of N alone; each next one doubles what has
    been done and knows one value more, until they are regular steps that know regular points. They end
    after `order` regular steps.
    """
    times = [0.0, *(2.0**-i for i in range(halvings, -1, -1)), *range(2, order + 1)]
    lengths = np.diff(times)
    known = [np.array(times[max(0, i + 1 - order) : i + 1][::-1]) for i in range(lengths.size)]
    return lengths, [(t - t[0]) / h for t, h in zip(known, lengths)]


def start_weights(
    A: Float[Array, "d d"], h: Float[Array, ""], speed, order: int, exact_rows: int = 0
) -> FittedWeights:
    """Of all `first_steps`, stacked."""
    lengths, points = first_steps(order)
    parts = []
    for length in np.unique(lengths):
        rows = [p for p, own in zip(points, lengths) if own == length]
        part = h * float(length)
        parts.append(fitted_weights(A, part, turn_of(speed, part), order, exact_rows, rows))
    # the lengths never fall, so that sorted by length is as they come
    return jax.tree.map(lambda *x: jnp.concatenate(x), *parts)


class History(eqx.Module):
    """`N` at the last k points, newest first, and the predicted states that it was evaluated at."""

    N: Float[Array, "k m"]
    states: Float[Array, "k d"]


def step(
    f: Callable[[Array, Vector], Vector],
    A: Float[Array, "d d"],
    weights: FittedWeights,
    t1: Float[Array, ""],
    y: Vector,
    history: Float[Array, "k m"],
) -> tuple[Vector, Array, Vector, Array]:
    """From y to the state at `t1`: that state, N at the last k points up to it, the predicted state, and
    by how much N there differs from what was extrapolated."""
    exact_rows = y.size - history.shape[1]
    predicted = weights.predict @ jnp.concatenate([y, history.ravel()])
    value = f(t1, predicted)[exact_rows:] - A[exact_rows:] @ predicted
    gap = value - weights.ahead @ history
    history = jnp.concatenate([value[None], history[:-1]])
    return predicted + weights.correct @ gap, history, predicted, gap


def rebased(history: History, A_from: Float[Array, "d d"], A_to: Float[Array, "d d"]) -> History:
    """The history of another linearisation: the field `A y + N` was what it was."""
    exact_rows = A_from.shape[0] - history.N.shape[1]
    change = (A_from - A_to)[exact_rows:]
    return History(history.N + history.states @ change.T, history.states)


def begin(
    f: Callable,
    A: Float[Array, "d d"],
    weights: FittedWeights,
    t0: Float[Array, ""],
    h: Float[Array, ""],
    y0: Vector,
    exact_rows: int = 0,
) -> tuple[Float[Array, "k d"], History]:
    """By `start_weights`: the states at t0 + h, ..., t0 + order h, and the history there."""
    order = weights.ahead.shape[1]
    lengths, _ = first_steps(order)
    value = f(t0, y0)[exact_rows:] - A[exact_rows:] @ y0
    N = jnp.zeros((order, value.size)).at[0].set(value)

    def one(carry, x):
        t1, own = x
        y, N, predicted, _ = step(f, A, own, t1, *carry)
        return (y, N), (y, predicted)

    ends = t0 + h * jnp.cumsum(lengths)
    (_, N), (ys, predicted) = jax.lax.scan(one, (y0, N), (ends, weights))
    return ys[-order:], History(N, predicted[-order:][::-1])


class Ladder(eqx.Module):
    """Linearisations at rising `speeds` (rad/s), each with its weights for the regular step."""

    speeds: Float[Array, " s"]
    A: Float[Array, "s d d"]
    weights: FittedWeights

    @classmethod
    def of(
        cls,
        linearise: Callable[[Array], Array],
        speeds: Float[Array, " s"],
        h: Float[Array, ""],
        order: int,
        exact_rows: int = 0,
        fit: Any = True,
    ) -> "Ladder":
        """`linearise`: A at a speed. `fit` (0 or 1): whether the weights know the speed, or powers of s
        alone."""

        def rung(w):
            A = linearise(w)
            return A, fitted_weights(A, h, fit * turn_of(w, h), order, exact_rows)

        return cls(speeds, *jax.lax.map(rung, speeds))

    def nearest(self, speed: Float[Array, ""]) -> Array:
        return jnp.argmin(jnp.abs(self.speeds - jax.lax.stop_gradient(speed)))

    def at(self, i) -> tuple[Array, FittedWeights]:
        return self.A[i], jax.tree.map(lambda x: x[i], self.weights)


def run_blocks(
    f: Callable[[Array, Vector], Vector],
    ladder: Ladder,
    speed: Callable[[Array, Vector], Array],
    t0: Float[Array, ""],
    h: Float[Array, ""],
    blocks: int,
    length: int,
    y0: Vector,
    history: History,
    which: Any,
    keep: Callable[[Vector], Any] = lambda y: y,
    unroll: int = 1,
) -> tuple[Any, Any]:
    """`blocks` blocks of `length` steps from the state `y0` at t0, whose history belongs to rung `which`.

    Each block takes the rung nearest to `speed(t, y)` at its start. Returns what `keep` leaves of the state
    after each step, and of each block the largest gap of N. In reverse mode the states at the blocks'
    starts are kept, and a block is run again.
    """
    k = history.N.shape[0]
    if length < k:
        raise ValueError(f"a block must be at least {k} steps long, but is {length}")

    @jax.checkpoint
    def block(carry, i):
        y, history, before = carry
        t = t0 + i * length * h
        now = ladder.nearest(speed(t, y))
        A, weights = ladder.at(now)
        history = rebased(history, ladder.A[before], A)

        def one(carry, j):
            y, N, most = carry
            y, N, predicted, gap = step(f, A, weights, t + (j + 1) * h, y, N)
            most = jnp.maximum(most, jnp.abs(jax.lax.stop_gradient(gap)))
            return (y, N, most), (keep(y), predicted)

        begin = (y, history.N, jnp.zeros_like(history.N[0]))
        steps = jnp.arange(length)
        (y, N, most), (kept, predicted) = jax.lax.scan(one, begin, steps, unroll=unroll)
        return (y, History(N, predicted[-k:][::-1]), now), (kept, most)

    _, (kept, most) = jax.lax.scan(block, (y0, history, which), jnp.arange(blocks))
    return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), kept), most
