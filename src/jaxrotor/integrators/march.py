"""Steps a solver of diffrax through given instants, in one scan.

`diffrax.diffeqsolve` runs these solvers as fast (benchmarks/startup.py), but its default adjoint
refuses forward mode and its forward adjoint refuses reverse mode. With the instants known beforehand a
scan takes derivatives in both.
"""

import math
from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .exponential import AbstractExponential
from .progress import PARTS, hand_over
from .step_times import Knots, held_within


def march(
    solver: AbstractExponential,
    terms: diffrax.AbstractTerm,
    knots: Knots,
    y0: Float[Array, " d"],
    args: Any,
    state: Any,
    told: bool = False,
    ticks: tuple[Callable[[Any, Array, Array], Array], Bool[Array, "n clocks"]] | None = None,
    watch: Callable[[Float[Array, " b"], Float[Array, "b d"]], Any] | None = None,
) -> Any:
    """The states at the `knots`, the first being `y0`.

    Where the force jumps the step starts afresh, and no step looks at the force beyond its own side of a
    jump. `state` is what the solver's `init` gave; only its memory is carried, for in reverse mode each
    carried array is kept at every step. Where it holds a `Defect`, those of the intervals are returned with
    the states, (n-1, m). `told`: the samples are handed over, part by part, while they come.
    `ticks`: what changes the state at knots where some clock is due, and when each is; what is returned is
    the state behind it.
    `watch`: what is kept of a block of instants and states, of all of them in turn, in place of the states;
    then only the states between blocks are held, and in reverse mode two levels of them.
    """
    judged = state.memory.defect is not None
    due, times, jumps = None, knots.times, knots.jumps
    if ticks is not None:
        tick, due = ticks
        y0 = tick(times[0], y0, due[0])
        jumps = jumps | jnp.any(due, axis=1)

    @jax.checkpoint
    def body(carry, x):
        y, memory = carry
        t0, t1, jump, which, piece, now = x
        begun = eqx.tree_at(lambda s: s.memory, state, memory)
        seen = terms
        if piece is not None:

            def within(t, y, args):
                return terms.vf(held_within(piece, t), y, args)

            seen = diffrax.ODETerm(within)
        y, memory = solver.advance(seen, t0, t1, y, args, begun, jump, which)
        if ticks is not None:
            y = ticks[0](t1, y, now)
        if not judged:
            return (y, memory), y
        defect, r = memory.defect.told()  # pyright: ignore[reportOptionalMemberAccess]
        return (y, eqx.tree_at(lambda m: m.defect, memory, defect)), (y, r)

    now = None if due is None else due[1:]
    xs = (times[:-1], times[1:], jumps[:-1], knots.which, knots.piece, now)
    begin = (y0, state.memory)
    count = times.size - 1
    if watch is None and not told:
        _, found = jax.lax.scan(body, begin, xs)
        ys, defects = found if judged else (found, None)
        ys = jnp.concatenate([y0[None], ys])
        return (ys, defects) if judged else ys
    # whole blocks: beyond the end the last interval is gone through again and again, and left out
    length = max(1, round(math.sqrt(count))) if watch is not None else -(-count // PARTS)
    rows = -(-count // length)
    at = np.minimum(np.arange(rows * length), count - 1).reshape(rows, length)
    xs = jax.tree.map(lambda x: x[at], xs)

    def joined(start, rest):
        return jnp.concatenate([start, rest.reshape(-1, *rest.shape[2:])[:count]])

    if watch is not None:

        @jax.checkpoint
        def block(carry, xs):
            carry, ys = jax.lax.scan(body, carry, xs)
            return carry, watch(xs[1], ys)

        _, kept = jax.lax.scan(block, begin, xs)
        return jax.tree.map(joined, watch(times[:1], y0[None]), kept)

    sampled = jnp.zeros(times.shape, bool).at[knots.samples].set(True)
    new = sampled[1:][at] & (np.arange(rows * length).reshape(rows, length) < count)

    def part(carry, x):
        xs, new = x
        carry, found = jax.lax.scan(body, carry, xs)
        hand_over(xs[1][-1], found[0] if judged else found, new)
        return carry, found

    hand_over(times[0] - 1.0, y0[None], sampled[:1])
    _, found = jax.lax.scan(part, begin, (xs, new))
    ys = joined(y0[None], found[0] if judged else found)
    if not judged:
        return ys
    return ys, found[1].reshape(-1, *found[1].shape[2:])[:count]
