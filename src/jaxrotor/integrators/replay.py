"""Reverse mode through a loop of unknown length: what it went through is computed again, and kept."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

# Passes whose states are kept at a time. A longer loop is gone through from its beginning for each such
# part of it.
_KEPT = 64


def replayed_while_loop(
    going: Callable[[Any], Any], body: Callable[[Any], Any], start: Any, kept: int = _KEPT
) -> Any:
    """`jax.lax.while_loop` that can be differentiated in reverse mode, but not in forward mode. Of `going`
    nothing is differentiated."""
    # everything that they hold becomes an argument: it may be traced
    body, going = eqx.filter_closure_convert(body, start), eqx.filter_closure_convert(going, start)
    given, static = eqx.partition((body, going, start), eqx.is_array)

    @jax.custom_vjp
    def run(given):
        body, going, at = eqx.combine(given, static)
        return lax.while_loop(lambda c: going(c), lambda c: body(c), at)

    def forward(given):
        body, going, at = eqx.combine(given, static)
        end, passes = lax.while_loop(
            lambda c: going(c[0]), lambda c: (body(c[0]), c[1] + 1), (at, jnp.zeros((), int))
        )
        return end, (given, passes)

    def backward(seen, pulled):
        given, passes = seen
        body, going, start = eqx.combine(given, static)
        smooth_body, rest_body = eqx.partition(body, eqx.is_inexact_array)
        smooth_start, rest_start = eqx.partition(start, eqx.is_inexact_array)
        pulled = jax.tree.map(
            lambda x, p: None if x is None else p, smooth_start, pulled, is_leaf=_none
        )

        def part(carry):
            """The passes from `first` on, at most `kept`, the last part of the loop first."""
            first, pulled, by_body = carry
            stop = jnp.minimum(first + kept, passes)

            def keep(c):
                i, at, states = c
                place = jnp.maximum(i - first, 0)
                states = jax.tree.map(
                    lambda all, x: lax.dynamic_update_index_in_dim(all, x, place, 0), states, at
                )
                return i + 1, body(at), states

            states = jax.tree.map(lambda x: jnp.zeros((kept, *x.shape), x.dtype), start)
            zero = jnp.zeros((), int)
            *_, states = lax.while_loop(lambda c: c[0] < stop, keep, (zero, start, states))

            def back(c):
                i, pulled, by_body = c
                at = jax.tree.map(
                    lambda x: lax.dynamic_index_in_dim(x, i - first, 0, False), states
                )
                smooth, rest = eqx.partition(at, eqx.is_inexact_array)

                def smoothly(smooth, body):
                    after = eqx.combine(body, rest_body)(eqx.combine(smooth, rest))
                    return eqx.filter(after, eqx.is_inexact_array)

                _, pull = jax.vjp(smoothly, smooth, smooth_body)
                pulled, more = pull(pulled)
                return i - 1, pulled, jax.tree.map(jnp.add, by_body, more)

            back_to = lax.while_loop(lambda c: c[0] >= first, back, (stop - 1, pulled, by_body))
            return first - kept, *back_to[1:]

        none = jax.tree.map(jnp.zeros_like, smooth_body)
        last = jnp.maximum(passes - 1, 0) // kept * kept
        _, pulled, by_body = lax.while_loop(lambda c: c[0] >= 0, part, (last, pulled, none))
        zeros = jax.tree.map(_no_slope, given)
        filled = jax.tree.map(
            lambda own, zero: zero if own is None else own,
            (by_body, jax.tree.map(lambda x: None, given[1]), pulled),
            zeros,
            is_leaf=_none,
        )
        return (filled,)

    run.defvjp(forward, backward)
    return run(given)


def _none(x: Any) -> bool:
    return x is None


def _no_slope(x: Any) -> Any:
    if jnp.issubdtype(x.dtype, jnp.inexact):
        return jnp.zeros_like(x)
    return np.zeros(x.shape, jax.dtypes.float0)
