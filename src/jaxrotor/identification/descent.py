"""Gradient descent by any optimiser of optax: where parameters are too many for forward sensitivities."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float
from tqdm import tqdm

from ..core.quick import lightly_compiled
from .fit import Fit
from .problem import Problem


def _cost(problem: Problem, u: Float[Array, " n"]) -> Float[Array, ""]:
    return 0.5 * jnp.sum(problem.residual(u) ** 2)


@lightly_compiled
def _step_all(problem: Problem, optimiser, u: Array, state: Any, best: Array, least: Array):
    """One update of each member. Reverse mode: its price does not grow with the number of parameters."""
    optimiser = optax.with_extra_args_support(optimiser)

    def one(u, state, best, least):
        value_fn = lambda u: _cost(problem, u)  # noqa: E731
        cost, slope = jax.value_and_grad(value_fn)(u)
        good = jnp.isfinite(cost) & jnp.isfinite(slope).all()
        updates, moved = optimiser.update(
            jnp.where(good, slope, 0.0), state, u, value=cost, grad=slope, value_fn=value_fn
        )
        better = good & (cost < least)
        best, least = jnp.where(better, u, best), jnp.where(better, cost, least)
        # from where a run leaves the finite numbers, half the way back
        u = jnp.where(good, u + jnp.asarray(updates), 0.5 * (u + best))
        return u, jax.tree.map(lambda a, b: jnp.where(good, a, b), moved, state), best, least

    return jax.vmap(one)(u, state, best, least)


def descend(
    problem: Problem,
    starts: Float[Array, "b n"],
    optimiser: optax.GradientTransformation,
    iterations: int,
    bar: tqdm | None = None,
) -> list[Fit]:
    """From each of `starts`, all in one batch; the best that each one met. `costs`: the least until then.
    Ctrl-C after the first iteration keeps them."""
    u, best = starts, starts
    # weak types, of Python's numbers, would make the second iteration another program
    strong = lambda x: jax.lax.convert_element_type(x, x.dtype)  # noqa: E731
    state = jax.tree.map(strong, jax.vmap(optimiser.init)(u))
    least = strong(jnp.full(len(starts), jnp.inf))
    history: list[np.ndarray] = []
    interrupted = False
    for _ in range(iterations):
        try:
            moved = _step_all(problem, optimiser, u, state, best, least)
            reached = np.asarray(moved[3])
        except KeyboardInterrupt:
            if not history:  # nothing has been found yet
                raise
            interrupted = True
            break
        u, state, best, least = moved
        history.append(reached)
        if bar is not None:
            bar.set_postfix_str(f"cost {np.min(history[-1]):.4g}")
            bar.update(1)
    costs = np.stack(history, axis=1)
    rests = [not interrupted and _rests(own) for own in costs]
    return [Fit(best[k], costs[k], rests[k], interrupted) for k in range(len(starts))]


def _rests(costs: np.ndarray) -> bool:
    """Whether the last tenth of the iterations gained less than a thousandth."""
    before = costs[-1 - max(1, len(costs) // 10)] if len(costs) > 1 else np.inf
    return bool(before - costs[-1] <= 1e-3 * costs[-1])
