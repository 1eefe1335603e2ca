"""Members of a batch abreast: the steps of all are one, with their numbers side by side in memory."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_batching import custom_vmap

from ..core.batch_last import Value, batch_last, wide

# Numbers of an array that a member has of its own. Products of larger matrices read more than they reckon,
# and a matrix of each member is read in order where the batch stands first.
_LARGE = 512


def scanned_abreast(step: Callable, carry: Any, count: int) -> Any:
    """`jax.lax.scan` of `step(carry, j)`, `count` times, as it is; under `jax.vmap` with the batch along the
    last axis. Derivatives it does not know."""
    closed = eqx.filter_closure_convert(step, carry, jnp.asarray(0))
    consts, static = eqx.partition(closed, eqx.is_array)
    steps = np.arange(count)

    def alone(consts, carry):
        # (not the closed function itself, which has no hash)
        return jax.lax.scan(lambda c, j: eqx.combine(consts, static)(c, j), carry, steps)

    run = custom_vmap(alone)

    @run.def_vmap
    def rule(size, batched, consts, carry):  # pyright: ignore[reportUnusedFunction]
        own = jax.tree.leaves(
            jax.tree.map(lambda x, b: x.size // size if b else 0, consts, batched[0])
        )
        if max(own, default=0) > _LARGE:
            axes = jax.tree.map(lambda b: 0 if b else None, batched)
            found = jax.vmap(alone, in_axes=axes, axis_size=size)(consts, carry)
        else:
            found = _together(static, size, batched, consts, carry, steps)
        return found, jax.tree.map(lambda _: True, found)

    return run(consts, carry)


def _together(
    static: Any, size: int, batched: Any, consts: Any, carry: Any, steps: np.ndarray
) -> Any:
    def last(x, b):
        return Value(jnp.moveaxis(x, 0, -1), True) if b else Value(x, False)

    consts, begin = (
        [last(x, b) for x, b in zip(jax.tree.leaves(tree), jax.tree.leaves(flags), strict=True)]
        for tree, flags in zip((consts, carry), batched, strict=True)
    )
    held, shape = jax.tree.structure(batched[0]), jax.tree.structure(carry)

    def step(consts, carry, j):
        function = eqx.combine(jax.tree.unflatten(held, consts), static)
        return function(jax.tree.unflatten(shape, carry), j)

    def alone(value):
        return value.array[..., 0] if value.batched else value.array

    traced, outcome = jax.make_jaxpr(step, return_shape=True)(
        [alone(x) for x in consts], [alone(x) for x in begin], jnp.asarray(0)
    )

    def body(carry, j):
        given = [*consts, *(Value(x, True) for x in carry), Value(j, False)]
        found = [wide(value, size) for value in batch_last(traced, given, size)]
        return found[: len(carry)], found[len(carry) :]

    ends, kept = jax.lax.scan(body, [wide(x, size) for x in begin], steps)
    first = [jnp.moveaxis(x, -1, 0) for x in (*ends, *kept)]
    return jax.tree.unflatten(jax.tree.structure(outcome), first)
