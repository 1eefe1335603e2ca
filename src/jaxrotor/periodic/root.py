"""Newton's method on the balance of all orders, at a given speed or along a branch, with exact
derivatives."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ..machine.field import n_free
from ..machine.system import System
from .balance import balance, left_over
from .waves import Waves

# A step that changes the motion by less than this part of its size is the last, after which the square of it
# is left; and by less than this, m or rad.
_SETTLED, _NOTHING = 1e-7, 1e-14
# A step is halved so often where the next one would be longer; and where no number comes out.
_HALVINGS, _LAST = 5, 30


class Found(NamedTuple):
    """`x`: (size + 1,), the coefficients, row after row, and the speed (rad/s) behind them. `tangent`:
    (size + 1,), along the branch, by 1 across the plane that was given. `settled`: whether a motion was
    found, in so many `steps`. The last three have no derivatives."""

    x: Float[Array, " s1"]
    tangent: Float[Array, " s1"]
    settled: Bool[Array, ""]
    steps: Int[Array, ""]


class _Search(NamedTuple):
    """A share of `step` from `x` is tried next, halved `tries` times; `length` of that step. `first`: what
    was left of the balance at the start."""

    x: Array
    step: Array
    tangent: Array
    length: Array
    tries: Array
    steps: Array
    settled: Array
    first: Array


def find(
    system: System,
    start: Float[Array, " s1"],
    plane: Float[Array, " s1"],
    waves: Waves,
    most: Int[Array, ""] | int,
    again: Int[Array, ""] | int,
) -> Found:
    """The periodic motion near `start` (coefficients, row after row, and the speed behind) in the plane
    through it whose normal is `plane`, by at most so many steps. After `again` of them it begins anew, the
    mean held by springs that get weaker as the balance is met, for starts where nothing holds it (in a
    clearance). Exact derivatives by the system and by `start` in both modes, to any order (the implicit
    function theorem)."""
    still = jax.lax.stop_gradient((system, start, plane))
    last = _search(*still, waves, most, again)
    dynamic, static = eqx.partition(system, eqx.is_array)
    m = (start.size - 1) // waves.count

    # what a rule for derivatives needs must be handed to it
    @jax.custom_jvp
    def root(dynamic, start, plane, found):
        return found

    @root.defjvp
    def _(known, by):
        x, plane = root(*known), known[2]
        values, fixed = eqx.partition(known[0], eqx.is_inexact_array)
        by_values = eqx.filter(by[0], jax.tree.map(eqx.is_inexact_array, known[0]))

        def left(values):
            whole = eqx.combine(values, fixed, static)
            return left_over(whole, x[:-1].reshape(-1, m), x[-1], waves)

        change = jax.jvp(left, (values,), (by_values,))[1]
        at = balance(eqx.combine(known[0], static), x[:-1].reshape(-1, m), x[-1], waves)
        right = jnp.append(-change.ravel(), plane @ by[1])
        return x, _solve(at.slope, at.by_speed, plane, right[:, None])[:, 0]

    x = root(dynamic, start, still[2], last.x + last.step)
    return Found(x, last.tangent, last.settled, last.steps)


def _search(system: System, start: Array, plane: Array, waves: Waves, most, again) -> _Search:
    m = (start.size - 1) // waves.count
    kinds = kinds_of(system, m, waves)

    def sizes(x: Array) -> Array:
        """The largest of each kind, where it belongs."""
        return jax.ops.segment_max(jnp.abs(x), kinds, num_segments=4)[kinds]

    def once(now: _Search) -> _Search:
        anew = (now.steps == again) & (now.tries == 0)
        begins = anew | (now.steps == 0)
        x = jnp.where(anew, start, now.x + 0.5**now.tries * now.step)
        at = balance(system, x[:-1].reshape(-1, m), x[-1], waves)
        right = jnp.stack(
            [jnp.append(-at.left, plane @ (start - x)), jnp.zeros(x.size).at[-1].set(1.0)], axis=1
        )
        size = jnp.max(jnp.abs(at.left))
        first = jnp.where(begins, size, now.first)
        held = (now.steps >= again) * x[-1] ** 2 * size / jnp.where(first > 0, first, 1.0)
        mean = np.arange(m) < n_free(system)
        slope = at.slope.at[np.arange(m), np.arange(m)].add(held * mean)
        step, tangent = _solve(slope, at.by_speed, plane, right).T
        before = jnp.where(begins, step, now.step)
        length = jnp.max(jnp.abs(step) / (jnp.maximum(sizes(now.x), sizes(before)) + _NOTHING))
        settled = jnp.all(jnp.abs(step) <= _SETTLED * sizes(x) + _NOTHING)
        none = jnp.zeros((), int)
        further = _Search(x, step, tangent, length, none, now.steps + 1, settled, first)
        # where no part of the step stays among the numbers, this is as far as it gets
        stuck = now.tries >= _LAST
        skipped = jnp.where(now.steps < again, jnp.minimum(again, most), most)
        back = now._replace(
            tries=jnp.where(stuck, 0, now.tries + 1), steps=jnp.where(stuck, skipped, now.steps)
        )
        shorter = begins | (length <= now.length)
        good = jnp.isfinite(length) & (shorter | (now.tries >= _HALVINGS))
        return jax.tree.map(lambda a, b: jnp.where(good, a, b), further, back)

    def going(now: _Search):
        return ~now.settled & (now.steps < most)

    none = jnp.zeros((), int)
    length = jnp.array(jnp.inf)
    still = jnp.zeros_like(start)
    began = _Search(start, still, still, length, none, none, jnp.array(False), length)
    return jax.lax.while_loop(going, once, began)


def kinds_of(system: System, m: int, waves: Waves) -> np.ndarray:
    """Of each unknown: 0 a distance, 1 an angle, 2 an internal state, 3 the speed."""
    layout, n = system.layout, n_free(system)
    turns = np.array(layout.free, int) // layout.n_mass >= 3
    kinds = np.concatenate([turns.astype(int), np.full(m - n, 2)])
    return np.append(np.tile(kinds, waves.count), 3)


def _solve(
    slope: Array, by_speed: Array, plane: Array, right: Float[Array, "s1 r"]
) -> Float[Array, "s1 r"]:
    """[[slope, by_speed], [plane]] x = right; rows and columns scaled to a like size."""
    top = jnp.concatenate([slope, by_speed[:, None]], axis=1)
    matrix = jnp.concatenate([top, plane[None]], axis=0)
    rows = jax.lax.stop_gradient(jnp.max(jnp.abs(matrix), axis=1))
    scaled = matrix / rows[:, None]
    columns = jax.lax.stop_gradient(jnp.max(jnp.abs(scaled), axis=0))
    return jnp.linalg.solve(scaled / columns, right / rows[:, None]) / columns[:, None]
