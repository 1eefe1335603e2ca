"""Newton's method for equilibria and periodic motions, with exact derivatives of the root."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

# A step is halved at most so often.
_HALVINGS = 30
# Singular values below this part of the largest count as a free motion, along which nothing moves.
FREE_MOTION = 1e-11
# A step that leaves more than this part of the residual has not reached it.
_UNREACHED = 1e-6


def solve_linear(matrix: Float[Array, "d d"], right: Float[Array, " d"]) -> Float[Array, " d"]:
    """Least-norm solution of a system with metres, radians and free motions in it.

    Rows and columns are scaled to a like size first, so that 'least' and 'singular' mean something.
    """
    size = jnp.abs(jax.lax.stop_gradient(matrix))
    rows = size.max(1)
    rows = jnp.where(rows > 0, rows, 1.0)
    columns = (size / rows[:, None]).max(0)
    columns = jnp.where(columns > 0, columns, 1.0)
    inverse = jnp.linalg.pinv(matrix / rows[:, None] / columns[None, :], rtol=FREE_MOTION)
    return inverse @ (right / rows) / columns


def newton_root(
    residual: Callable[[Array], Array],
    start: Float[Array, " d"],
    iterations: int,
    rtol: float,
    farther: Float[Array, "d d"] | None = None,
) -> Float[Array, " d"]:
    """A root near `start`, differentiable in both modes by the implicit function theorem.

    It stops when the step no longer changes the solution by more than `rtol` of its size, or after
    `iterations`; the caller checks the residual. A step that leads out of the finite numbers (through the
    wall of a bearing) is halved until it does not. (Other steps are not: an unbalanced line that spins freely
    gets to its lowest place by wide detours alone.) Where the Jacobian is singular (free motions) the least
    step is taken, so a free coordinate stays where it started; where that leaves some of the residual, the
    step is taken with `farther`, what the Jacobian has more at some distance (the face across a play).
    """

    def solve(f, x):
        def going(carry):
            x, step, i = carry
            return (i < iterations) & (jnp.max(jnp.abs(step)) > rtol * jnp.max(jnp.abs(x)))

        def once(carry):
            x, _, i = carry
            jacobian, value = jax.jacfwd(lambda x: (f(x),) * 2, has_aux=True)(x)
            step = solve_linear(jacobian, value)
            if farther is not None:
                left = jnp.max(jnp.abs(value - jacobian @ step))
                reached = left <= _UNREACHED * jnp.max(jnp.abs(value))
                step = jnp.where(reached, step, solve_linear(jacobian + farther, value))

            def outside(carry):
                _, finite, k = carry
                return ~finite & (k <= _HALVINGS)

            def halve(carry):
                share, _, k = carry
                share = 0.5 * share
                return share, jnp.all(jnp.isfinite(f(x - share * step))), k + 1

            # the whole step is the first half of two: the program of f stands here once
            share, inside, _ = jax.lax.while_loop(outside, halve, (2.0, jnp.array(False), 0))
            # where no part of the step stays inside, this is as far as it gets
            step = jnp.where(inside, share * step, 0.0)
            return x - step, step, i + 1

        x, _, _ = jax.lax.while_loop(going, once, (x, jnp.full_like(x, jnp.inf), 0))
        return x

    def tangent_solve(g, right):
        return solve_linear(jax.jacfwd(g)(jnp.zeros_like(right)), right)

    return jax.lax.custom_root(residual, start, solve, tangent_solve)
