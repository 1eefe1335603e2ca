"""Steps a solver of diffrax through given instants, in one scan.

`diffrax.diffeqsolve` runs these solvers as fast (benchmarks/startup.py), but its default adjoint
refuses forward mode and its forward adjoint refuses reverse mode. With the instants known beforehand a
scan takes derivatives in both.
"""

from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .progress import report


def march(
    solver: diffrax.AbstractSolver,
    terms: diffrax.AbstractTerm,
    knots: Float[Array, " n"],
    jumps: Bool[Array, " n"],
    y0: Float[Array, " d"],
    args: Any,
    state: Any,
    every: int = 0,
) -> Float[Array, "n d"]:
    """The states at the `knots`, the first being `y0`.

    `jumps[i]` says that the force jumps at `knots[i]`, so that the step from there starts afresh.
    `state` is what the solver's `init` gave. A progress bar is told of `every` so many steps.
    """
    leaves, tree = jax.tree.flatten(state)

    def step(y, leaves, t0, t1, jump):
        old = jax.tree.unflatten(tree, leaves)
        y, _, _, new, _ = solver.step(terms, t0, t1, y, args, old, jump)
        return y, jax.tree.leaves(new)

    constant = _unchanged(step, y0, leaves, knots[0], knots[1], jumps[0])

    @jax.checkpoint
    def body(carry, x):
        y, changing = carry
        t0, t1, jump, i = x
        if every:
            report(i, every)
        rest = iter(changing)
        y, new = step(
            y, [c if same else next(rest) for c, same in zip(leaves, constant)], t0, t1, jump
        )
        return (y, [leaf for leaf, same in zip(new, constant) if not same]), y

    changing = [leaf for leaf, same in zip(leaves, constant) if not same]
    xs = (knots[:-1], knots[1:], jumps[:-1], jnp.arange(knots.shape[0] - 1))
    _, ys = jax.lax.scan(body, (y0, changing), xs)
    return jnp.concatenate([y0[None], ys])


def _unchanged(step, y, leaves, t0, t1, jump) -> list[bool]:
    """Which leaves of the solver's state a step hands on untouched: those need not be carried (in
    reverse mode each carried array is kept at every step)."""
    jaxpr, _ = eqx.filter_make_jaxpr(step)(y, leaves, t0, t1, jump)[:2]
    n = len(leaves)
    before, after = jaxpr.jaxpr.invars[1 : 1 + n], jaxpr.jaxpr.outvars[1 : 1 + n]
    return [a is b for a, b in zip(before, after)]
