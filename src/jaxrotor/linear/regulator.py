"""Optimal linear feedback: the quadratic regulator, with and without measuring every state."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.arguments import matrix
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.result_text import shows
from ..elements.control.controller import Compensator
from .matrix_equations import fit, lyapunov, riccati, shape_of, stable

_UNREACHED = (
    "let an input reach the one that does not, or weigh it in Q where it neither grows nor dies out"
)
_UNSEEN = "measure the one that does not, or let noise drive it where it neither grows nor dies out"


@shows()
class Regulator(NamedTuple):
    """`gain` (m, d): u = -gain x. `cost_matrix` X (d, d): from the state x0 it costs x0' X x0."""

    gain: Float[Array, "m d"]
    cost_matrix: Float[Array, "d d"]


@shows()
class LQG(NamedTuple):
    """`compensator`: `z' = A z + B y, u = C z`, y the measurement (p,) and u what the actuators do (m,); of
    one actuator, a control loop takes it as it is. `cost`: the mean of x' Q x + u' R u in the long run."""

    compensator: Compensator
    cost: Float[Array, ""]


@takes(A=matrix, B=matrix, Q=matrix, R=matrix)
def lqr(A: Any, B: Any, Q: Any, R: Any) -> Regulator:
    """The feedback u = -gain x of x' = A x + B u with the least integral of x' Q x + u' R u.

    Q (d, d) symmetric and not negative, R (m, m) positive definite. With a `LinearModel`, A is `model.A`, B
    the columns of `model.B` where actuators act (N, N·m). Exact derivatives in both modes; `jit` and `vmap`
    work. Raises `InputError` where no feedback stabilises the system (not finite under `jit`). Source:
    Anderson & Moore, Optimal Control: Linear Quadratic Methods (1990), ch. 2-3.
    """
    A, B, Q, R = _arrays(A, B, Q, R)
    d, m = shape_of(B, "B", (A.shape[0], None))
    fit(A=(A, (d, d)), Q=(Q, (d, d)), R=(R, (m, m)))
    _positive(R, "R")
    found = _regulator(A, B, Q, R)
    _check(A - B @ found.gain, "(A, B)", _UNREACHED)
    return found


@takes(
    A=matrix, B=matrix, C=matrix, Q=matrix, R=matrix, process_noise=matrix, measurement_noise=matrix
)
def lqg(A: Any, B: Any, C: Any, Q: Any, R: Any, process_noise: Any, measurement_noise: Any) -> LQG:
    """The compensator of x' = A x + B u + w, y = C x + v with the least mean of x' Q x + u' R u: `lqr`'s gain
    upon the state that a Kalman-Bucy filter estimates.

    `process_noise` (d, d), `measurement_noise` (p, p), positive definite: intensities (two-sided densities
    per Hz) of the white noises w and v. For a force of intensity S on one coordinate it is S b b', b that
    column of `model.B`. All else as for `lqr`, also of the filter. Source: Anderson & Moore (1990), ch.
    7-8. Raises `InputError` for a weight or an intensity that is not positive definite, and where no
    feedback makes every motion die out.
    """
    A, B, C, Q, R, W, V = _arrays(A, B, C, Q, R, process_noise, measurement_noise)
    d, m = shape_of(B, "B", (A.shape[0], None))
    p, _ = shape_of(C, "C", (None, d))
    fit(A=(A, (d, d)), Q=(Q, (d, d)), R=(R, (m, m)))
    fit(process_noise=(W, (d, d)), measurement_noise=(V, (p, p)))
    _positive(R, "R")
    _positive(V, "measurement_noise")
    K, X = _regulator(A, B, Q, R)
    L, S = _regulator(A.T, C.T, W, V)
    L = L.T
    _check(A - B @ K, "(A, B)", _UNREACHED)
    _check(A - L @ C, "(A, C)", _UNSEEN)
    cost = jnp.sum(X * W) + jnp.sum(S * (K.T @ R @ K))
    return LQG(Compensator(A - B @ K - L @ C, L, -K), cost)


@takes(A=matrix, B=matrix, K=matrix, Q=matrix, R=matrix, X0=matrix)
def closed_loop_cost(A: Any, B: Any, K: Any, Q: Any, R: Any, X0: Any) -> Float[Array, ""]:
    """What the feedback u = -K x costs: the integral of x' Q x + u' R u, from initial states with mean
    square X0 = E[x0 x0'] (d, d): trace(P X0), P by a Lyapunov equation. With X0 the intensity of white noise
    it is the mean cost in the long run. Infinite where the loop is not stable. Exact derivatives in both
    modes, by K too. Raises `InputError` for what is no matrix of finite numbers."""
    A, B, K, Q, R, X0 = _arrays(A, B, K, Q, R, X0)
    d, m = shape_of(B, "B", (A.shape[0], None))
    fit(A=(A, (d, d)), K=(K, (m, d)), Q=(Q, (d, d)), R=(R, (m, m)), X0=(X0, (d, d)))
    return _cost(A, B, K, Q, R, X0)


@jax.jit
def _regulator(A, B, Q, R) -> Regulator:
    X = riccati(A, B, Q, R)
    return Regulator(jnp.linalg.solve(R, B.T @ X), X)


@jax.jit
def _cost(A, B, K, Q, R, X0) -> Array:
    loop = A - B @ K
    dies = stable(loop)
    # where the cost is infinite, derivatives must still be numbers
    P = lyapunov(jnp.where(dies, loop, -jnp.eye(len(A))).T, Q + K.T @ R @ K)
    return jnp.where(dies, jnp.sum(P * X0), jnp.inf)


def _arrays(*given: Any) -> tuple[Array, ...]:
    return tuple(jnp.asarray(x, float) for x in given)


def _positive(x: Array, name: str) -> None:
    numbers = known(jnp.linalg.eigvalsh(0.5 * (x + x.T)))
    if numbers is not None and not numbers.min() > 0:
        raise InputError(
            f"{name} must be positive definite, but its least eigenvalue is {numbers.min():.3g}: "
            "weigh every entry"
        )


def _check(loop: Array, pair: str, remedy: str) -> None:
    dies = known(stable(loop))
    if dies is not None and not dies:
        raise InputError(f"{pair}: no feedback makes every motion die out: {remedy}")
