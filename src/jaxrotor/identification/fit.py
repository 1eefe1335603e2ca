"""Levenberg-Marquardt on the residuals, from one start or a batch of them."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float
from tqdm import tqdm

from ..core.quick import lightly_compiled
from .problem import Problem, residual_and_slopes, with_data
from .simulated import records, records_and_slopes, slopes_come_along, slopes_were_spare

_SOLVER = optx.LevenbergMarquardt(rtol=1e-9, atol=1e-9)
_TAGS: frozenset[object] = frozenset()
# A search has come to rest where a whole Gauss-Newton step promises no more than this part of the mean
# squared residual (1e-5 standard deviations of a parameter), or after so many iterations that gained nothing:
# then the step has been cut to a ten-thousandth.
_PROMISE, _PATIENCE, _GAIN = 1e-10, 8, 1e-6
# The same of a search whose residuals only weigh the next one: what is left moves no parameter further than
# its standard deviation.
_NEARLY = 1.0
# Directions (squared singular values of the slopes, columns scaled to one length) that are not seen.
_UNSEEN = 1e-12
# Residuals of this part of the standard deviations are rounding.
_ROUNDING = 1e-11


class Fit(NamedTuple):
    """Where a search ended. `costs`: half the sum of squares at each iteration. `stopped`: it came to rest
    before the iterations ran out. `interrupted`: by Ctrl-C, which keeps the best place so far."""

    u: Float[Array, " n"]
    costs: np.ndarray
    stopped: bool
    interrupted: bool = False


def _given(r: Array, J: Array):
    """A residual that is known already, as optimistix asks for it: the simulation stays outside its step,
    and so is compiled once for all stages."""

    @jax.custom_jvp
    def residual(u):
        return r

    @residual.defjvp
    def _(primals, tangents):
        return r, J @ tangents[0]

    return lambda u, _: (residual(u), None)


def _begin(problem: Problem, u: Array, m: int) -> Any:
    fn = _given(jnp.zeros(m), jnp.zeros((m, u.shape[0])))
    shape, aux = jax.eval_shape(lambda: fn(u, None))
    return _SOLVER.init(fn, u, None, {}, shape, aux, _TAGS)


@lightly_compiled
def _begin_all(problem: Problem, u: Array, m: int) -> Any:
    return eqx.filter_vmap(lambda u: _begin(problem, u, m))(u)


@lightly_compiled
def _step_all(problem: Problem, u: Array, state: Any, found, slopes, data, free):
    """Each member moves on by what was simulated at its `state.y_eval`. Also the cost it has reached, and
    cost, slope and curvature where it looked."""

    def one(u, state, found, slopes, data, free):
        r, J = residual_and_slopes(with_data(problem, data), state.y_eval, found, slopes)
        J = J * free  # a column of zeros: damped least squares leaves that unknown where it is
        u, state, _ = _SOLVER.step(_given(r, J), u, None, {}, state, _TAGS)
        return u, state, 0.5 * jnp.sum(state.f_info.residual**2), (0.5 * r @ r, r @ J, J.T @ J)

    each = eqx.if_array(0)
    return eqx.filter_vmap(one, in_axes=(0, each, each, each, each, 0))(
        u, state, found, slopes, data, free
    )


def _promised(slope: Array, curvature: Array) -> np.ndarray:
    """By how much a whole Gauss-Newton step would lower the cost, were the residual linear: each member."""
    found = []
    for g, H in zip(np.asarray(slope), np.asarray(curvature)):
        size = np.sqrt(np.diagonal(H))
        scale = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
        if not (np.isfinite(scale).all() and np.isfinite(H).all() and np.isfinite(g).all()):
            found.append(np.inf)
            continue
        values, vectors = np.linalg.eigh(scale[:, None] * H * scale)
        along = (vectors.T @ (scale * g))[values > _UNSEEN]
        found.append(0.5 * np.sum(along**2 / values[values > _UNSEEN]))
    return np.array(found)


def _looked_at(problem: Problem, u: Array, least: np.ndarray, data) -> tuple[Any, Any]:
    """Records and their slopes at `u`. A lone search whose cost would rise there takes the step back and
    never uses the slopes: they are spared, for each costs as much as a simulation."""
    if not (len(u) == 1 and np.isfinite(least[0])):
        return records_and_slopes(problem.simulated, u)
    along = slopes_come_along(problem.simulated)
    if along:
        found, slopes = records_and_slopes(problem.simulated, u)
    else:
        found = tuple(x[None] for x in records(problem.simulated, u[0]))
        slopes = tuple(jnp.zeros((*x.shape, u.shape[1])) for x in found)
    own = with_data(problem, jax.tree.map(lambda x: x[0], data))
    if _cost(own, u[0], tuple(x[0] for x in found)) < least[0]:
        return (found, slopes) if along else records_and_slopes(problem.simulated, u)
    if along:
        slopes_were_spare(problem.simulated)
    return found, slopes


@lightly_compiled
def _cost(problem: Problem, u: Array, found: tuple[Array, ...]) -> Array:
    return 0.5 * jnp.sum(problem.residual_of(u, found) ** 2)


def search(
    problem: Problem,
    starts: Float[Array, "b n"],
    iterations: int,
    bar: tqdm | None = None,
    data: tuple[Float[Array, "b nt"], ...] | None = None,
    free: Float[Array, "b n"] | None = None,
    nearly: bool = False,
) -> list[Fit]:
    """A search from each of `starts`, all in one batch; `data`: what was measured, if each member has its
    own; `free`: 0 for unknowns that stay at their start, else 1; `nearly`: it need not come to rest, another
    search follows. Where a run leaves the finite numbers the
    step is taken back and a shorter one tried."""
    u = starts
    free = jnp.ones_like(u) if free is None else free
    count = sum(s.compared.spread.shape[0] for s in problem.signals) + len(problem.space.with_prior)
    state = _begin_all(problem, u, count)
    history: list[np.ndarray] = []
    rested = np.zeros(len(starts), bool)
    interrupted = False
    for i in range(iterations):
        least = history[-1] if history else np.full(len(starts), np.inf)
        try:
            found, slopes = _looked_at(problem, state.y_eval, least, data)
            moved = _step_all(problem, u, state, found, slopes, data, free)
            reached = np.asarray(moved[2])
        except KeyboardInterrupt:
            if not history:  # nothing has been found yet
                raise
            interrupted = True
            break
        u, state, _, seen = moved
        history.append(reached)
        here, promised = np.asarray(seen[0]), _promised(*seen[1:])
        at_best = here <= (1 + _GAIN) * history[-1]
        rested |= np.asarray(state.terminate) | (history[-1] < 0.5 * count * _ROUNDING**2)
        rested |= at_best & (
            promised <= (_NEARLY if nearly else _PROMISE) * 2 * history[-1] / count
        )
        if i >= _PATIENCE:
            rested |= history[-1 - _PATIENCE] - history[-1] <= _GAIN * history[-1]
        if bar is not None:
            bar.set_postfix_str(f"cost {np.nanmin(history[-1]):.4g}")
            bar.update(1)
        if rested.all():
            break
    costs = np.stack(history, axis=1)
    return [Fit(u[k], costs[k], bool(rested[k]), interrupted) for k in range(len(starts))]
