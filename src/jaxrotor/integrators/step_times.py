"""The instants a run stops at: samples and jumps in force, and the smooth pieces between jumps."""

from typing import Any, NamedTuple

import equinox.internal as eqxi
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int


class Knots(NamedTuple):
    """`times` in order; `jumps` marks those that are jumps; `samples` finds the samples among them.

    Of each of the n-1 intervals: `which` of the prepared weights is its own, 0 for those from sample to
    sample, the others in the order of `lengths`; `piece`, (n-1, 2), the first and the last instant at which
    the force may be looked at, infinite where no jump is.
    """

    times: Float[Array, " n"]
    jumps: Bool[Array, " n"]
    samples: Int[Array, " nt"]
    lengths: Float[Array, " m"]
    which: Int[Array, " n-1"]
    piece: Float[Array, "n-1 2"] | None


def knots(samples: Float[Array, " nt"], jumps: Float[Array, " j"]) -> Knots:
    """Works with traced times. Jumps outside the run are moved to its ends, where they do nothing.

    An interval beside a jump has weights of its own even where its length is the regular one: its length
    moves with the jump, and derivatives follow it.
    """
    nt, count = samples.shape[0], jumps.shape[0]
    if count == 0:
        none = jnp.zeros(nt, bool)
        return Knots(samples, none, jnp.arange(nt), jnp.zeros(0), jnp.zeros(nt - 1, int), None)
    first, last = samples[0], samples[-1]
    # chosen, not clipped: at the very end a clip has half a derivative
    inside = jnp.where(jumps < first, first, jnp.where(jumps > last, last, jumps))
    inside = jnp.sort(inside)
    times = jnp.concatenate([samples, inside])
    order = jnp.argsort(jax.lax.stop_gradient(times), stable=True)  # a sample before its jump
    times, marks = times[order], order >= nt
    place = jnp.zeros(order.shape, int).at[order].set(jnp.arange(order.shape[0]))
    touching = jnp.concatenate([place[nt:] - 1, place[nt:]])
    gaps = jnp.diff(times)
    lengths = gaps[jnp.clip(touching, 0, gaps.shape[0] - 1)]
    which = jnp.zeros(gaps.shape, int).at[touching].set(1 + jnp.arange(2 * count), mode="drop")
    end = jnp.full(1, jnp.inf)
    after = jnp.concatenate([-end, eqxi.nextafter(inside)])
    before = jnp.concatenate([eqxi.prevbefore(inside), end])
    passed = jnp.cumsum(marks)[:-1]
    piece = jnp.stack([after[passed], before[passed]], axis=1)
    return Knots(times, marks, place[:nt], lengths, which, jax.lax.stop_gradient(piece))


def held_within(piece: Float[Array, "2"], t: Float[Array, ""]) -> Float[Array, ""]:
    """`t`, or the nearest instant of the piece: on a jump a force has no one value, and `t0 + h` may round
    onto it. The derivative is that of `t`."""
    t0: Any = jax.lax.stop_gradient(t)
    return jnp.clip(t0, piece[0], piece[1]) + (t - t0)
