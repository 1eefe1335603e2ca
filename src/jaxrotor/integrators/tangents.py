"""Several tangents of a step, one after another: side by side its products of a matrix and a vector become
products of matrices, which XLA hands to a library whose calls cost more than the step."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax.custom_batching import custom_vmap
from jax.custom_derivatives import SymbolicZero


def tangents_in_turn(step: Callable) -> Callable:
    """`step(carry, j)` as it is, but for forward mode alone: reverse mode does not know it. What it closes
    over may be derived by."""

    def call(carry: Any, j: Any) -> Any:
        closed = eqx.filter_closure_convert(step, carry, j)
        consts, static = eqx.partition(closed, eqx.is_array)
        leaves, tree = jax.tree.flatten((consts, carry, j))

        def of(leaves):
            consts, carry, j = jax.tree.unflatten(tree, leaves)
            return eqx.combine(consts, static)(carry, j)

        run = jax.custom_jvp(lambda *leaves: of(leaves))

        def derived(leaves, tangents):
            moves = [not isinstance(x, SymbolicZero) for x in tangents]

            def of_moving(*moving):
                own = iter(moving)
                found = of([next(own) if m else x for x, m in zip(leaves, moves)])
                return eqx.partition(found, eqx.is_inexact_array)

            moving = [x for x, m in zip(leaves, moves) if m]
            value, along, rest = jax.linearize(of_moving, *moving, has_aux=True)
            tangents = tuple(x for x, m in zip(tangents, moves) if m)
            slopes = _in_turn(lambda along, tangents: along(*tangents))(along, tangents)
            none = jax.tree.map(lambda x: np.zeros(x.shape, jax.dtypes.float0), rest)
            return eqx.combine(value, rest), eqx.combine(slopes, none)

        run.defjvp(derived, symbolic_zeros=True)
        return run(*leaves)

    return call


def _in_turn(linear: Callable) -> Callable:
    """`linear(known, tangents)`, which vmap by the tangents makes a loop."""
    apply = custom_vmap(linear)

    @apply.def_vmap
    def rule(size, batched, known, tangents):  # pyright: ignore[reportUnusedFunction]
        if any(jax.tree.leaves(batched[0])):  # members of a batch, each with tangents of its own
            axes = jax.tree.map(lambda b: 0 if b else None, batched)
            members = jax.vmap(linear, in_axes=axes, axis_size=size)
            found = _in_turn(members)(known, tangents)
        else:
            moving, rest = eqx.partition(tangents, batched[1])
            found = jax.lax.map(lambda own: linear(known, eqx.combine(own, rest)), moving)
        return found, jax.tree.map(lambda _: True, found)

    return apply
