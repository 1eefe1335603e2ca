"""Newton's method for equilibria and periodic motions, with exact derivatives of the root."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.columns import columns

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
    across = (size / rows[:, None]).max(0)
    across = jnp.where(across > 0, across, 1.0)
    inverse = jnp.linalg.pinv(matrix / rows[:, None] / across[None, :], rtol=FREE_MOTION)
    return inverse @ (right / rows) / across


class Root(NamedTuple):
    """`left`: what is left of the residual. It has no derivative."""

    x: Float[Array, " d"]
    left: Float[Array, " d"]


class _Search(NamedTuple):
    """`value` of the residual at x; `step` from there; `share` of it that is tried next, and `tries` of it so
    far."""

    x: Array
    value: Array
    step: Array
    left: Array
    share: Array
    tries: Array
    steps: Array


def newton_root(
    residual: Callable[[Array], Array],
    start: Float[Array, " d"],
    iterations: int,
    rtol: float,
    farther: Float[Array, "d d"] | None = None,
) -> Root:
    """A root near `start`, differentiable in both modes by the implicit function theorem.

    It stops when the step no longer changes the solution by more than `rtol` of its size, or after
    `iterations`; the caller checks what is left. A step that leads out of the finite numbers (through the
    wall of a bearing) is halved until it does not. (Other steps are not: an unbalanced line that spins freely
    gets to its lowest place by wide detours alone.) Where the Jacobian is singular (free motions) the least
    step is taken, so a free coordinate stays where it started; where that leaves some of the residual, the
    step is taken with `farther`, what the Jacobian has more at some distance (the face across a play).
    """
    # what the residual closes over is what the root is differentiated by
    given, f = eqx.partition(eqx.filter_closure_convert(residual, start), eqx.is_array)

    def changes(now: _Search):
        return jnp.max(jnp.abs(now.step)) > rtol * jnp.max(jnp.abs(now.x))

    def going(now: _Search):
        first = now.steps + now.tries == 0
        return first | ((now.steps < iterations) & changes(now))

    def once(now: _Search, given, farther) -> _Search:
        """Where a step ends, if f is finite there, the next one begins: so f stands here once."""
        x = now.x - now.share * now.step
        jacobian, value = columns(eqx.combine(given, f), x)
        step = solve_linear(jacobian, value)
        left = value - jacobian @ step
        if farther is not None:
            more = solve_linear(jacobian + farther, value)
            reached = jnp.max(jnp.abs(left)) <= _UNREACHED * jnp.max(jnp.abs(value))
            step = jnp.where(reached, step, more)
            left = jnp.where(reached, left, value - jacobian @ more)
        whole, none = jnp.ones(()), jnp.array(0)
        further = _Search(x, value, step, left, whole, none, now.steps + 1)
        # where no part of the step stays inside, this is as far as it gets
        last = now.tries >= _HALVINGS
        back = now._replace(
            step=jnp.where(last, 0.0, now.step),
            left=jnp.where(last, now.value, now.left),
            share=0.5 * now.share,
            tries=now.tries + 1,
        )
        inside = jnp.all(jnp.isfinite(value))
        return jax.tree.map(lambda a, b: jnp.where(inside, a, b), further, back)

    @jax.custom_jvp
    def root(given, start, farther) -> tuple[Array, Array]:
        unknown, none = jnp.full_like(start, jnp.nan), jnp.array(0)
        began = _Search(start, unknown, jnp.zeros_like(start), unknown, jnp.ones(()), none, none)
        found = jax.lax.while_loop(going, lambda now: once(now, given, farther), began)
        return found.x - found.step, jnp.where(changes(found), found.value, found.left)

    @root.defjvp
    def _(known, by):
        given, by = known[0], by[0]
        x, left = root(*known)
        values, fixed = eqx.partition(given, eqx.is_inexact_array)
        by = eqx.filter(by, jax.tree.map(eqx.is_inexact_array, given))

        def at_root(values):
            return eqx.combine(values, fixed, f)(x)

        change = jax.jvp(at_root, (values,), (by,))[1]
        dx = -solve_linear(columns(eqx.combine(given, f), x)[0], change)
        return (x, left), (dx, jnp.zeros_like(left))

    return Root(*root(given, start, farther))
