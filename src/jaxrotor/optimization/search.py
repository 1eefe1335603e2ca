"""The search: quasi-Newton (optimistix) or any optimiser of optax, inside an augmented Lagrangian."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
import optimistix as optx
from jaxtyping import Array
from tqdm import tqdm

from ..core.quick import lightly_compiled
from .augmented_lagrangian import Layout, Terms, Told, tell
from .problem import Problem

_BFGS = optx.BFGS(rtol=0.0, atol=0.0)  # it never stops by itself
_TAGS: frozenset[object] = frozenset()
# The first step of a search changes no coordinate by more than this.
_FIRST = 0.2
# An inner search has come to rest where so many accepted steps together gained less than this part.
_PATIENCE, _GAIN, _SHORTEST = 4, 1e-13, 1e-13
# The penalty grows where a round of the multipliers did not bring the violation down to this part of it.
_GROWTH, _ENOUGH = 4.0, 0.25
# Rounds of the multipliers, with an optimiser of optax.
_ROUNDS = 8


class Step(NamedTuple):
    """One evaluation: what was judged there, how far it is beyond bounds (scaled), the place."""

    vector: np.ndarray
    violation: float
    u: np.ndarray


class Found(NamedTuple):
    """`u`: the place, `prices`: multipliers (scaled), `history`: every evaluation, `stopped`: why."""

    u: np.ndarray
    vector: np.ndarray
    violation: float
    prices: np.ndarray
    history: list[Step]
    stopped: str
    converged: bool
    interrupted: bool = False


def _known(merit: Array, slope: Array):
    """A merit that has been evaluated already, as optimistix asks for it."""

    @jax.custom_jvp
    def value(x):
        return merit

    @value.defjvp
    def _(primals, tangents):
        return merit, slope @ tangents[0]

    return lambda x, _: (value(x), None)


@lightly_compiled
def _begin(x: Array) -> Any:
    fn = _known(jnp.zeros(()), jnp.zeros_like(x))
    shape, aux = jax.eval_shape(lambda: fn(x, None))
    return _BFGS.init(fn, x, None, {}, shape, aux, _TAGS)


@lightly_compiled
def _quasi_newton(x: Array, state: Any, merit: Array, slope: Array):
    """The place, the state, the next place to look at, and whether this one was accepted."""
    count = state.num_accepted_steps
    x, state, _ = _BFGS.step(_known(merit, slope), x, None, {}, state, _TAGS)
    return x, state, state.y_eval, state.num_accepted_steps > count


@lightly_compiled
def _descend(optimiser, x: Array, state: Any, slope: Array):
    updates, state = optimiser.update(slope, state, x)
    return optax.apply_updates(x, updates), state


class Search:
    """Searches of one problem, one start after the other."""

    def __init__(
        self, problem: Problem, layout: Layout, terms: Terms, tolerance: float, bar: tqdm | None
    ):
        self.problem, self.layout, self.terms = problem, layout, terms
        self.tolerance, self.bar = tolerance, bar
        self.history: list[Step] = []
        self.left = 0

    def look(self, x: Array, terms: Terms) -> Told:
        told = tell(self.problem, self.layout, x, terms)
        vector, n = np.asarray(told.vector), len(self.problem.space)
        violation = self.layout.violation(told.vector, self._level(x), terms)
        self.history.append(Step(vector, violation, np.asarray(x[:n])))
        self.left -= 1
        if self.bar is not None:
            self.bar.set_postfix_str(f"{vector[: self.layout.sizes[0]].max():.5g}")
            self.bar.update(1)
        return told

    def _level(self, x: Array) -> Any:
        return x[-1] if self.layout.minimax else 0.0

    def run(
        self, x: Array, iterations: int, optimiser: optax.GradientTransformation | None
    ) -> Found:
        """From `x`, with the level of a minimax as its last entry: at most so many evaluations (of optax: so
        many in each round of the multipliers). Ctrl-C after the first keeps the best of them."""
        self.left, self.history = iterations, []
        try:
            return self._run(x, iterations, optimiser)
        except KeyboardInterrupt:
            if not self.history:
                raise
            return self._so_far()

    def _so_far(self) -> Found:
        """The best place that was looked at: first of all one within bounds."""

        def missed(step: Step) -> tuple[float, float]:
            top = np.max(step.vector[: self.layout.sizes[0]])
            # a minimax's level is where its largest entry is
            level = top / self.terms.scales[0]
            return self.layout.violation(jnp.asarray(step.vector), level, self.terms), top

        def badness(step: Step):
            beyond, top = missed(step)
            return (max(beyond, self.tolerance) if np.isfinite(top) else np.inf, top)

        best = min(self.history, key=badness)
        beyond, _ = missed(best)
        return Found(
            best.u, best.vector, beyond, np.asarray(self.terms.prices), self.history,
            "it was interrupted before it came to rest", False, True,
        )  # fmt: skip

    def _run(
        self, x: Array, iterations: int, optimiser: optax.GradientTransformation | None
    ) -> Found:
        layout, terms, n = self.layout, self.terms, len(self.problem.space)
        before, rest, metric, converged = np.inf, 1e-2, None, False
        while True:
            rest = max(self.tolerance, 0.1 * rest) if layout.held else self.tolerance
            if optimiser is None:
                x, told, rested, metric = self._newton(x, terms, rest, metric)
            else:
                x, told = self._optax(x, terms, optimiser, iterations)
                rested = True
            level = self._level(x)
            beyond = layout.violation(told.vector, level, terms)
            prices = layout.pushed(told.vector, level, terms) if layout.held else terms.prices
            small = beyond <= self.tolerance and rest <= self.tolerance
            if rested and (small or not layout.held):
                converged = True
                break
            rounds = len(self.history) // iterations
            if self.left <= 0 if optimiser is None else rounds >= _ROUNDS:
                break
            penalty = terms.penalty * (1.0 if beyond <= _ENOUGH * before else _GROWTH)
            before = min(before, beyond)
            terms = Terms(terms.limits, terms.scales, prices, penalty)
        stopped = (
            "it came to rest" if converged else "the evaluations ran out before it came to rest"
        )
        return Found(
            np.asarray(x[:n]), np.asarray(told.vector), beyond, np.asarray(prices),
            self.history, stopped, converged,
        )  # fmt: skip

    def _newton(
        self, x: Array, terms: Terms, rest: float, metric: Any
    ) -> tuple[Array, Told, bool, Any]:
        """Until no slope exceeds `rest`, or nothing is gained any more. `metric`: the inverse curvature that
        an earlier round has learnt."""
        told = self.look(x, terms)
        size = float(np.max(np.abs(told.slope)))
        if not np.isfinite(size) or size <= rest:
            return x, told, np.isfinite(size), metric
        state, trial, here = _begin(x), told, told
        # without one, the first step is one along the slope
        operator = state.f_info.hessian_inv
        start = (_FIRST / size) * jnp.eye(x.size) if metric is None else metric
        state = eqx.tree_at(
            lambda s: s.f_info.hessian_inv.pytree, state, start.reshape(operator.pytree.shape)
        )
        best, gains, first = np.inf, [], True
        while True:
            new, state, ahead, accepted = _quasi_newton(x, state, trial.merit, trial.slope)
            if bool(accepted) or first:
                gains.append(best - float(trial.merit))
                best, x, here, first = float(trial.merit), new, trial, False
                metric = state.f_info.hessian_inv.pytree
                done = float(np.max(np.abs(here.slope))) <= rest
                small = len(gains) > _PATIENCE and sum(gains[-_PATIENCE:]) <= _GAIN * max(
                    1.0, abs(best)
                )
                if done or small:
                    return x, here, True, metric
            # no step is short enough to gain anything: rounding is reached
            if float(np.max(np.abs(ahead - x))) <= _SHORTEST:
                return x, here, True, metric
            if self.left <= 0:
                return x, here, False, metric
            # what was learnt of the curvature has overflowed: anew, without it
            if not bool(jnp.all(jnp.isfinite(ahead))):
                return x, here, False, None
            trial = self.look(ahead, terms)

    def _optax(self, x: Array, terms: Terms, optimiser, iterations: int) -> tuple[Array, Told]:
        """The best place on the way. From where a run leaves the finite numbers half the way back."""
        state = optimiser.init(x)
        best: tuple[Array, Told] | None = None
        for _ in range(iterations):
            told = self.look(x, terms)
            good = bool(np.isfinite(told.merit)) and bool(np.all(np.isfinite(told.slope)))
            if not good:
                if best is None:
                    return x, told
                x = 0.5 * (x + best[0])
                continue
            if best is None or told.merit < best[1].merit:
                best = x, told
            x, state = _descend(optimiser, x, state, told.slope)  # pyright: ignore
        assert best is not None
        return best
