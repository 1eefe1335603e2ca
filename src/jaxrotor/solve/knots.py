"""The instants a run stops at: samples, and both sides of every jump in force."""

from typing import NamedTuple

import equinox.internal as eqxi
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int


class Knots(NamedTuple):
    """`times` in order; `jumps` marks those just behind a jump; `samples` finds the samples among
    them; `lengths` are those of all intervals that touch a jump."""

    times: Float[Array, " n"]
    jumps: Bool[Array, " n"]
    samples: Int[Array, " nt"]
    lengths: Float[Array, " m"]


def knots(samples: Float[Array, " nt"], jumps: Float[Array, " j"]) -> Knots:
    """Each jump becomes the float just before it and the one just after: no evaluation falls on the
    jump itself, where a force law has no one value. Works with traced times; jumps outside the run
    are moved to its ends, where they do nothing."""
    nt, count = samples.shape[0], jumps.shape[0]
    if count == 0:
        none = jnp.zeros(nt, bool)
        return Knots(samples, none, jnp.arange(nt), jnp.zeros(0))
    inside = jnp.sort(jnp.clip(jumps, samples[0], samples[-1]))
    before, after = eqxi.prevbefore(inside), eqxi.nextafter(inside)
    times = jnp.concatenate([samples, before, after])
    order = jnp.argsort(jax.lax.stop_gradient(times), stable=True)
    marks = jnp.arange(nt + 2 * count) >= nt + count
    times = jnp.clip(times[order], samples[0], samples[-1])
    place = jnp.zeros(order.shape, int).at[order].set(jnp.arange(order.shape[0]))
    touching = jnp.concatenate([place[nt:] - 1, place[nt:]])
    gaps = jnp.diff(times)
    lengths = gaps[jnp.clip(touching, 0, gaps.shape[0] - 1)]
    return Knots(times, marks[order], place[:nt], lengths)
