"""Exponentially fitted Adams: what N does most is turn with the shaft, so the weights know its speed.

N, the part of `dy/dt = A y + N(t, y)` that A leaves, is taken through its last k values as a mix of
`1, s, ..., s^(k-3), cos(θ s), sin(θ s)`, θ the angle that the shaft turns by in a step (s in steps), and
that mix is integrated exactly with exp(hA). Literature: Gautschi, Numer. Math. 3 (1961) 381; Ixaru &
Vanden Berghe, Exponential Fitting (2004).

A step predicts, evaluates and corrects (PEC): ONE evaluation, at the predicted point, serves the corrector
and the history. That is stable while A is near the machine's own Jacobian, to within what `follow` knows of
it: so A goes with the speed, and the fit too, on a ladder that is climbed at the ends of blocks of steps.
Where N has a rate λ of its own that neither knows, h λ must stay below 0.16, 0.08, 0.04 at orders 4, 5, 6
(with a second evaluation it might be 1.4, 1.0, 0.8).
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .fitted_weights import (
    FittedWeights,
    first_steps,
    fitted_mix,
    moments,
    polynomial_mix,
    turn_of,
    weights_of,
)

Vector = Float[Array, " d"]


class History(eqx.Module):
    """`N` at the last k points, newest first, and the states there."""

    N: Float[Array, "k m"]
    states: Float[Array, "k d"]


def step(
    f: Callable[[Array, Vector], Vector],
    A: Float[Array, "d d"],
    weights: FittedWeights,
    t1: Float[Array, ""],
    y: Vector,
    history: Float[Array, "k m"],
    follow: Float[Array, "m m"] | None = None,
) -> tuple[Vector, Array, Array]:
    """From y to the state at `t1`: that state, N at the last k points up to it, and by how much N at the
    predicted state differs from what was extrapolated.

    `follow`: by how much N changes from the predicted to the corrected state, for each unit of that
    difference, as far as it is known: what is remembered is N at the corrected state.
    """
    exact_rows = y.size - history.shape[1]
    predicted = weights.predict @ jnp.concatenate([y, history.ravel()])
    value = f(t1, predicted)[exact_rows:] - A[exact_rows:] @ predicted
    gap = value - weights.ahead @ history
    remembered = value if follow is None else value + follow @ gap
    history = jnp.concatenate([remembered[None], history[:-1]])
    return predicted + weights.correct @ gap, history, gap


def rebased(history: History, A_from: Float[Array, "d d"], A_to: Float[Array, "d d"]) -> History:
    """The history of another linearisation: the field `A y + N` was what it was."""
    exact_rows = A_from.shape[0] - history.N.shape[1]
    change = (A_from - A_to)[exact_rows:]
    return History(history.N + history.states @ change.T, history.states)


class Ladder(eqx.Module):
    """Linearisations A at rising speeds, and at rising `speeds` (rad/s, as many or more) weights for the
    regular step of h seconds, of the linearisation `of_A`; and the weights of all `first_steps` by the
    linearisation of the rung `start`.

    `follow`: by how much N changes with a correction at the rung's own speed, and what each rad/s adds (see
    `step`). That keeps one evaluation a step stable on few linearisations.
    """

    h: Float[Array, ""]
    speeds: Float[Array, " r"]
    A: Float[Array, "s d d"]
    of_A: Int[Array, " r"]
    weights: FittedWeights
    follow: tuple[Float[Array, "r m m"], Float[Array, "r m m"]]
    start: Any
    starting: FittedWeights

    @classmethod
    def of(
        cls,
        at: Float[Array, " s"],
        A: Float[Array, "s d d"],
        h: Float[Array, ""],
        order: int,
        exact_rows: int = 0,
        start: Any = 0.0,
        fit: Any = 1.0,
        speeds: Float[Array, " r"] | None = None,
    ) -> "Ladder":
        """`at`: speeds of the A. `start`: speed at the start. `fit` times the angle of a step is what the
        weights are fitted to: 0 leaves powers of s alone. `speeds`: at which, if not at those of the A."""
        speeds = at if speeds is None else speeds
        of_A = jnp.argmin(jnp.abs(speeds[:, None] - at), axis=1)
        near, turns = fit * turn_of(at, h), fit * turn_of(speeds, h)
        rung = jnp.argmin(jnp.abs(speeds - start))
        kinds = first_steps(order).kinds
        different, which = np.unique([length for length, _ in kinds], return_inverse=True)
        # the start is by polynomials, for it is short
        first = jnp.broadcast_to(A[of_A[rung]], (different.size, *A.shape[1:]))
        every = (
            jnp.concatenate([A, first]),
            jnp.concatenate([jnp.broadcast_to(h, at.shape), h * different]),
            jnp.concatenate([near, jnp.zeros(different.size)]),
        )
        found = jax.lax.map(lambda x: moments(x[0], x[1], x[2], order, exact_rows), every)

        def own(i):
            return jax.tree.map(lambda x: x[i], found)

        weights = jax.lax.map(
            lambda x: weights_of(own(x[0]), *fitted_mix(x[1], order, near[x[0]])), (of_A, turns)
        )
        mixes = [polynomial_mix(np.array(points), order) for _, points in kinds]
        starting = jax.lax.map(
            lambda x: weights_of(own(x[0]), *x[1:]),
            (at.size + which, *(np.stack(x) for x in zip(*mixes))),
        )
        per_speed = _slopes(at, A)[of_A][:, exact_rows:] @ weights.correct
        follow = ((speeds - at[of_A])[:, None, None] * per_speed, per_speed)
        return cls(h, speeds, A, of_A, weights, follow, rung, starting)

    def nearest(self, speed: Float[Array, ""]) -> Array:
        return jnp.argmin(jnp.abs(self.speeds - jax.lax.stop_gradient(speed)))

    def at(self, i, speed: Float[Array, ""]) -> tuple[Array, FittedWeights, Array]:
        """A, the weights and what N follows a correction by (see `step`) of a rung, at a speed."""
        off = jax.lax.stop_gradient(speed) - self.speeds[i]
        follow = self.follow[0][i] + off * self.follow[1][i]
        return self.A[self.of_A[i]], jax.tree.map(lambda x: x[i], self.weights), follow


def _slopes(speeds: Float[Array, " s"], A: Float[Array, "s d d"]) -> Float[Array, "s d d"]:
    """dA/dw at each of the speeds, by those beside it."""
    n = speeds.size
    if n == 1:
        return jnp.zeros_like(A)
    above, below = np.minimum(np.arange(n) + 1, n - 1), np.maximum(np.arange(n) - 1, 0)
    apart = speeds[above] - speeds[below]
    apart = jnp.where(apart == 0.0, jnp.inf, apart)
    return (A[above] - A[below]) / apart[:, None, None]


def begin(
    f: Callable, ladder: Ladder, t0: Float[Array, ""], y0: Vector
) -> tuple[Float[Array, "k d"], History]:
    """The states at t0 + h, ..., t0 + (order - 1) h, and the history there, of the linearisation
    `ladder.start`."""
    A, order = ladder.A[ladder.of_A[ladder.start]], ladder.starting.ahead.shape[1]
    exact_rows = y0.size - ladder.starting.correct.shape[2]
    steps = first_steps(order)
    value = f(t0, y0)[exact_rows:] - A[exact_rows:] @ y0
    N = jnp.concatenate([value[None], jnp.zeros((order - 1, value.size))])

    def one(carry, x):
        t1, kind = x
        weights = jax.tree.map(lambda w: w[kind], ladder.starting)
        y, N, _ = step(f, A, weights, t1, *carry)
        return (y, N), (y, N[0])

    ends = t0 + ladder.h * steps.ends
    _, found = jax.lax.scan(one, (y0, N), (ends, steps.which))
    ys, N = (x[steps.regular] for x in found)
    newest = (jnp.concatenate([x[::-1], first[None]]) for x, first in ((N, value), (ys, y0)))
    return ys, History(*newest)


def run_blocks(
    f: Callable[[Array, Vector], Vector],
    ladder: Ladder,
    speed: Callable[[Array, Vector], Array],
    t0: Float[Array, ""],
    blocks: int,
    length: int,
    y0: Vector,
    history: History,
    keep: Callable[[Vector], Any] = lambda y: y,
    unroll: int = 1,
) -> tuple[Any, Any]:
    """`blocks` blocks of `length` steps from the state `y0` at t0, begun by `begin`.

    Each block takes the rung nearest to `speed(t, y)` at its start. Returns what `keep` leaves of the state
    after each step, and of each block the largest gap of N. In reverse mode the states at the blocks'
    starts are kept, and a block is run again.
    """
    k, h = history.N.shape[0], ladder.h
    if length < k:
        raise ValueError(f"a block must be at least {k} steps long, but is {length}")

    @jax.checkpoint
    def block(carry, i):
        y, history, before = carry
        t = t0 + i * length * h
        own = speed(t, y)
        now = ladder.nearest(own)
        A, weights, follow = ladder.at(now, own)
        history = rebased(history, ladder.A[ladder.of_A[before]], A)

        def one(carry, j):
            y, N, most = carry
            y, N, gap = step(f, A, weights, t + (j + 1) * h, y, N, follow)
            most = jnp.maximum(most, jnp.abs(jax.lax.stop_gradient(gap)))
            return (y, N, most), y

        begin = (y, history.N, jnp.zeros_like(history.N[0]))
        (y, N, most), ys = jax.lax.scan(one, begin, jnp.arange(length), unroll=unroll)
        return (y, History(N, ys[-k:][::-1]), now), (jax.vmap(keep)(ys), most)

    _, (kept, most) = jax.lax.scan(block, (y0, history, ladder.start), jnp.arange(blocks))
    return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), kept), most
