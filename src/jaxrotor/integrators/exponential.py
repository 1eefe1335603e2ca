"""Exponential integrators: exact for the stiff linear part, explicit for the smooth rest.

Light bearing stations under Rayleigh damping have eigenvalues near -4e7 1/s beside a rotation at
1e3 rad/s. That stiffness is linear and constant: with `A` the Jacobian of the balanced machine,
`dy/dt = A y + N(t, y)` with a smooth `N`, and only N limits the step.
"""

import abc
from collections.abc import Callable
from typing import Any, ClassVar

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.arguments import whole
from ..core.gate import takes
from .defect import Defect
from .weights import STAGES, AdamsWeights, adams_weights, extrapolation, runge_kutta_weights

# Sub-steps of ETD4RK in each step of the multistep method while its history fills.
START_REFINEMENT = 4
# States of which short inner loops are written out.
_SMALL = 64
# Step lengths agree when they differ by less than this part of the longest one prepared.
_LENGTH_TOLERANCE = 1e-7

Scalar = Float[Array, ""]
Vector = Float[Array, " d"]
Terms = diffrax.AbstractTerm[Any, Any]


class Memory(eqx.Module):
    """What a step hands on to the next: `history` holds N, newest first, `filled` of it; `defect` where the
    run is judged."""

    history: Float[Array, " mk"] | None = None
    filled: Any = None
    defect: Defect | None = None


class _State(eqx.Module):
    """`lengths` are the prepared ones, the regular first; the weights stay as they are."""

    A: Float[Array, "d d"]
    lengths: Float[Array, " m"]
    starting: Float[Array, "m 5 d d4m"]
    adams: AdamsWeights | None
    memory: Memory


def _linear_part(linear_part, terms, t0, y0, args) -> Float[Array, "d d"]:
    if linear_part is not None:
        return linear_part
    return jax.jacfwd(lambda y: terms.vf(t0, y, args))(y0)


def _prepare(A, lengths, substeps: int, exact_rows: int) -> Array:
    return jax.vmap(lambda length: runge_kutta_weights(A, length / substeps, exact_rows))(lengths)


def _remainder(terms, A, args, exact_rows: int) -> Callable:
    """N in the rows where it is not zero. A function of its own within the program: a step evaluates it at
    several places, and traces it once."""

    @jax.jit
    def N(t, y):
        return terms.vf(t, y, args)[exact_rows:] - A[exact_rows:] @ y

    return N


def _nearest(lengths, length) -> tuple[Array, Array]:
    """Which of the prepared lengths is nearest, and whether it is that length."""
    gap = jnp.abs(lengths - length)
    i = jnp.argmin(gap)
    fits = gap[i] <= _LENGTH_TOLERANCE * jnp.max(jnp.abs(lengths)) + 1e-14
    return i, fits


def _runge_kutta(N: Callable, weights, t, h, y: Vector) -> tuple[Vector, Float[Array, "4 m"]]:
    """The state after one step of ETD4RK, and N at its stages."""

    m = (weights.shape[2] - y.size) // 4

    def stage(values, i):
        x = weights[i] @ values
        value = N(t + h * jnp.asarray(STAGES)[i], x)
        return jax.lax.dynamic_update_slice(values, value, (y.size + i * m,)), None

    values, _ = jax.lax.scan(stage, jnp.concatenate([y, jnp.zeros(4 * m)]), jnp.arange(4))
    return weights[4] @ values, values[y.size :].reshape(4, m)


def _flow(weights: Float[Array, "d dkm"], k: int) -> tuple[Array, Array]:
    """From weights of (y, N, ..., N): those of all k together are what a constant N has."""
    d = weights.shape[0]
    return weights[:, :d], weights[:, d:].reshape(d, k, (weights.shape[1] - d) // k).sum(axis=1)


def _result(ok) -> diffrax.RESULTS:
    return diffrax.RESULTS.where(ok, diffrax.RESULTS.successful, diffrax.RESULTS.internal_error)


def _dense(t0, t1, y0, y1, terms, args) -> dict[str, Array]:
    dt = t1 - t0
    return dict(y0=y0, y1=y1, k0=dt * terms.vf(t0, y0, args), k1=dt * terms.vf(t1, y1, args))


class AbstractExponential(diffrax.AbstractSolver[_State]):
    """What both methods share: a step as diffrax wants it, around the bare one."""

    @abc.abstractmethod
    def flow(self, state: _State) -> tuple[Float[Array, "d d"], Float[Array, "d m"]]:
        """`e^(hA)` and `h φ_1(hA)` of a regular step."""

    @abc.abstractmethod
    def advance(
        self,
        terms: Terms,
        t0: Scalar,
        t1: Scalar,
        y0: Vector,
        args: Any,
        state: _State,
        made_jump: Any,
        which: Array | int,
    ) -> tuple[Vector, Memory]:
        """The state at t1 and what to remember. `which` of the prepared lengths the step has: two of one
        length may follow different parameters, so the length itself does not say."""

    def step(
        self,
        terms: Terms,
        t0: Scalar,
        t1: Scalar,
        y0: Vector,
        args: Any,
        solver_state: _State,
        made_jump: Any,
    ) -> tuple[Vector, None, dict[str, Array], _State, diffrax.RESULTS]:
        which, fits = _nearest(solver_state.lengths, t1 - t0)
        y1, memory = self.advance(terms, t0, t1, y0, args, solver_state, made_jump, which)
        state = eqx.tree_at(lambda s: s.memory, solver_state, memory)
        return y1, None, _dense(t0, t1, y0, y1, terms, args), state, _result(fits)

    def func(self, terms: Terms, t0: Scalar, y0: Vector, args: Any) -> Any:
        return terms.vf(t0, y0, args)


@takes(substeps=whole(0), linear_part=None, lengths=None)
class ETD4RK(AbstractExponential):
    """Krogstad's fourth-order exponential Runge-Kutta method, at constant steps.

    **Arguments:**

    - `substeps`: steps of the method inside one step of diffrax.
    - `linear_part`: A, (d, d); by default the Jacobian of the vector field at the start.
    - `lengths`: step lengths other than the first one's that will occur, s. The weights hold for the
      lengths they were made for; a step of another length ends with `RESULTS.internal_error`, so use
      `diffrax.ConstantStepSize` (or `jaxrotor.simulate`, which prepares what it needs).
    - `exact_rows`: in how many leading rows the vector field is A's alone (the rates of coordinates): half
      of all products are saved.

    Order four, but two where stiff forcing (a damper driven by a given motion) changes within a step.
    Source: Krogstad, J. Comput. Phys. 203 (2005) 72.
    """

    substeps: int = eqx.field(static=True, default=1)
    linear_part: Float[Array, "d d"] | None = None
    lengths: Float[Array, " m"] | None = None
    exact_rows: int = eqx.field(static=True, default=0)

    term_structure: ClassVar[type[Terms]] = diffrax.AbstractTerm
    interpolation_cls: ClassVar[type] = diffrax.ThirdOrderHermitePolynomialInterpolation

    def order(self, terms: Terms) -> int:
        return 4

    def init(
        self,
        terms: Terms,
        t0: Scalar,
        t1: Scalar,
        y0: Vector,
        args: Any,
    ) -> _State:
        A = _linear_part(self.linear_part, terms, t0, y0, args)
        extra = jnp.zeros(0) if self.lengths is None else self.lengths
        lengths = jnp.concatenate([jnp.asarray(t1 - t0, float)[None], extra])
        starting = _prepare(A, lengths, self.substeps, self.exact_rows)
        return _State(A, lengths, starting, None, Memory())

    def flow(self, state: _State) -> tuple[Float[Array, "d d"], Float[Array, "d m"]]:
        return _flow(state.starting[0, 4], 4)

    def advance(
        self,
        terms: Terms,
        t0: Scalar,
        t1: Scalar,
        y0: Vector,
        args: Any,
        state: _State,
        made_jump: Any,
        which: Array | int,
    ) -> tuple[Vector, Memory]:
        weights = state.starting[which]
        h = (t1 - t0) / self.substeps

        N = _remainder(terms, state.A, args, self.exact_rows)

        defect = state.memory.defect
        if defect is not None:
            defect = defect.afresh(made_jump | (which != 0))

        def one(carry, i):
            y, defect = carry
            y, stages = _runge_kutta(N, weights, t0 + i * h, h, y)
            return (y, None if defect is None else defect.runge_kutta(stages)), None

        (y1, defect), _ = jax.lax.scan(one, (y0, defect), jnp.arange(self.substeps))
        return y1, Memory(defect=defect)


class ExponentialAdams(AbstractExponential):
    """Exponential Adams method, predict-evaluate-correct-evaluate, at constant steps.

    Integrates the linear part exactly and the polynomial through the last `order` values of the
    rest; two evaluations a step at any order. It starts, and restarts after a jump in force, by short
    steps of `ETD4RK`.

    **Arguments:**

    - `order`: number of past values, 2 to 7.
    - `substeps`, `linear_part`, `lengths`, `exact_rows`: as for `ETD4RK`; a step of another than the regular
      length is made by ETD4RK too, and the history starts anew behind it.

    Source: Hochbruck & Ostermann, BIT 51 (2011) 889; the paper's own solver, ode113, is the classical
    Adams PECE method.
    """

    order_: int = eqx.field(static=True, default=6)
    substeps: int = eqx.field(static=True, default=1)
    linear_part: Float[Array, "d d"] | None = None
    lengths: Float[Array, " m"] | None = None
    exact_rows: int = eqx.field(static=True, default=0)
    evaluations: int = eqx.field(static=True, default=1)

    term_structure: ClassVar[type[Terms]] = diffrax.AbstractTerm
    interpolation_cls: ClassVar[type] = diffrax.ThirdOrderHermitePolynomialInterpolation

    @takes(linear_part=None, lengths=None)
    def __init__(
        self,
        order: int = 6,
        substeps: int = 1,
        linear_part: Float[Array, "d d"] | None = None,
        lengths: Float[Array, " m"] | None = None,
        exact_rows: int = 0,
        evaluations: int = 1,
    ):
        self.order_ = whole(2, 7)(order, "order")
        self.evaluations = whole(0)(evaluations, "evaluations")
        self.substeps = whole(0)(substeps, "substeps")
        self.linear_part, self.lengths, self.exact_rows = linear_part, lengths, exact_rows

    def order(self, terms: Terms) -> int:
        return self.order_

    def init(
        self,
        terms: Terms,
        t0: Scalar,
        t1: Scalar,
        y0: Vector,
        args: Any,
    ) -> _State:
        A = _linear_part(self.linear_part, terms, t0, y0, args)
        extra = jnp.zeros(0) if self.lengths is None else self.lengths
        lengths = jnp.concatenate([jnp.asarray(t1 - t0, float)[None], extra])
        return _State(
            A,
            lengths,
            _prepare(A, lengths, self.substeps * START_REFINEMENT, self.exact_rows),
            adams_weights(A, lengths[0] / self.substeps, self.order_, self.exact_rows),
            Memory(
                jnp.zeros(self.order_ * (y0.size - self.exact_rows)),
                jnp.zeros((), int),
            ),
        )

    def flow(self, state: _State) -> tuple[Float[Array, "d d"], Float[Array, "d m"]]:
        return _flow(state.adams.predict, self.order_)  # pyright: ignore

    def advance(
        self,
        terms: Terms,
        t0: Scalar,
        t1: Scalar,
        y0: Vector,
        args: Any,
        state: _State,
        made_jump: Any,
        which: Array | int,
    ) -> tuple[Vector, Memory]:
        h = (t1 - t0) / self.substeps
        m = y0.size - self.exact_rows
        N = _remainder(terms, state.A, args, self.exact_rows)

        def push(history, value):
            return jnp.concatenate([value, history[:-m]])

        filled = jnp.where(made_jump, 0, state.memory.filled)
        regular = which == 0

        # `history` holds N at the steps before t0, newest first; each step adds its own start
        def multistep(y, history):
            ahead = extrapolation(self.order_)
            # a loop costs a small machine a fifth of its time; in a large one it hides behind the products
            unroll = self.substeps <= 4 and y0.size <= _SMALL

            def one(carry, i):
                y, history = carry
                t = t0 + i * h
                value = N(t, y)
                history = push(history, value)
                predicted = state.adams.predict @ jnp.concatenate([y, history])  # pyright: ignore
                expected = ahead @ history.reshape(self.order_, m)
                ahead_of = N(t + h, predicted)
                y = predicted + state.adams.correct @ (ahead_of - expected)  # pyright: ignore
                return (y, history), None

            (y, history), _ = jax.lax.scan(
                one, (y, history), jnp.arange(self.substeps), unroll=unroll
            )
            return y, history, filled

        def start(y, history):
            weights = state.starting[which]
            short = h / START_REFINEMENT

            def fine(carry, i):
                y, history = carry
                t = t0 + i * short
                new, stages = _runge_kutta(N, weights, t, short, y)
                history = jnp.where(i % START_REFINEMENT == 0, push(history, stages[0]), history)
                return (new, history), None

            (y, history), _ = jax.lax.scan(
                fine, (y, history), jnp.arange(self.substeps * START_REFINEMENT)
            )
            return y, history, jnp.where(regular, filled + self.substeps, 0)

        y1, *memory = jax.lax.cond(
            (filled >= self.order_ - 1) & regular,
            multistep,
            start,
            y0,
            state.memory.history,
        )
        return y1, Memory(*memory)
