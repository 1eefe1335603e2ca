"""Fatigue: rainflow cycles, and Miner's sum over them."""

from collections.abc import Iterator
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.custom_batching import sequential_vmap
from jaxtyping import Array, Bool, Float, Int

from ..core.parameter import parameter
from ..sensors.sensor import AbstractSensor
from ..simulation.response import Response
from .measure import AbstractSignalMeasure, or_nan, see, window_faults, within


class Cycles(NamedTuple):
    """Cycles by the samples where they turn: `first` and `last`, and their `count`: 1, a half, or 0 for an
    entry that is not used. In the order in which they close; the residue stands at the end."""

    first: Int[Array, " m"]
    last: Int[Array, " m"]
    count: Float[Array, " m"]


def rainflow(values: Float[Array, " n"], inside: Bool[Array, " n"] | None = None) -> Cycles:
    """Rainflow cycles of a history by the three-point rule; what is left over counts as half cycles.

    `inside`: which samples belong to it. Values at turning points count as they were sampled. Nothing here
    has a derivative: it is the ranges between the samples found that have one. Shapes are fixed, so it may
    be traced. Source: ASTM E1049-85, sec. 5.4.4.
    """
    inside = jnp.ones(values.shape, bool) if inside is None else inside
    return Cycles(*_count(jax.lax.stop_gradient(values), inside))


@sequential_vmap  # a batch of stacks would be copied at every event: one after the other is 25 times faster
def _count(v: Array, inside: Array) -> tuple[Array, Array, Array]:
    n = v.shape[0]

    # One event at a time: a range is counted, or the next sample is read. At most n of either. A sample that
    # goes on in the same direction takes the place of the last; a range that it closes on its way would have
    # been closed by the turning point too, in the same order.
    def event(state, _):
        at, bottom, top, stack, (a, b, c) = state
        closes = (top - bottom >= 3) & (jnp.abs(v[c] - v[b]) >= jnp.abs(v[b] - v[a]))
        half = closes & (top - bottom == 3)  # it contains the start
        whole = closes & ~half
        i = jnp.minimum(at, n - 1)
        reads = ~closes & (at < n)
        takes = reads & inside[i]
        onward = ((top - bottom >= 2) & ((v[c] - v[b]) * (v[i] - v[c]) >= 0)) | (
            (top - bottom == 1) & (v[i] == v[c])
        )
        place = jnp.where(onward, top - 1, top)
        # written first and read after, and where nothing changes as it is: so the stack is never copied
        slot = jnp.where(whole, top - 3, jnp.where(takes, place, jnp.maximum(top - 1, 0)))
        entry = jnp.where(takes, i, c)
        stack = jax.lax.dynamic_update_index_in_dim(stack, entry, slot, 0)
        top = jnp.where(whole, top - 2, jnp.where(takes, place + 1, top))
        count = jnp.where(half, 0.5, jnp.where(whole, 1.0, 0.0))
        ends = tuple(stack[jnp.maximum(top - k, 0)] for k in (3, 2, 1))
        return (at + reads, bottom + half, top, stack, ends), (a, b, count)

    zero = jnp.zeros((), int)
    state = (zero, zero, zero, jnp.zeros(n, int), (zero, zero, zero))
    (_, bottom, top, stack, _), closed = jax.lax.scan(event, state, length=2 * n)
    k = jnp.arange(n - 1)
    left = stack[:-1], stack[1:], jnp.where((k >= bottom) & (k < top - 1), 0.5, 0.0)
    first, last, count = (jnp.concatenate(pair) for pair in zip(closed, left))
    return first, last, count


class FatigueDamage(AbstractSignalMeasure):
    """Miner's sum over rainflow cycles, `Σ n (range/(2 reference))^exponent`, a pure number; 1 is failure.

    **Arguments:**

    - `exponent`: of the S-N line, `N = (amplitude/reference)^-exponent`: 3 to 5 for welds, 8 to 12 for
      smooth shafts.
    - `reference`: in the sensor's unit, the amplitude that fails in one cycle. From a point (S1, N1) of
      the line: `S1 N1^(1/exponent)`.

    No mean-stress correction, no endurance limit. Its derivative is that of the ranges as counted: exact but
    where the counting changes, where the sum has a kink and no jump. Crests count as sampled: 20 samples a
    period see ranges short by 1.2 % at worst.
    """

    exponent: Float[Array, ""] = parameter(positive=True)
    reference: Float[Array, ""] = parameter(
        positive=True, label="amplitude that fails in one cycle, in the sensor's unit"
    )

    def faults(self) -> Iterator[str]:
        yield from window_faults(self)

    @property
    def unit(self) -> str:
        return ""

    def sensors(self) -> tuple[AbstractSensor, ...]:
        return (self.sensor,)

    def __call__(self, response: Response) -> Float[Array, ""]:
        inside = within(self, response)
        seen = see(response, self.sensor)
        cycles = rainflow(seen, inside)
        ranges = jnp.abs(seen[cycles.first] - seen[cycles.last])
        amplitudes = 0.5 * jnp.where(
            cycles.count > 0, ranges, 1.0
        )  # powers of 0 have no derivative
        found = jnp.sum(cycles.count * (amplitudes / self.reference) ** self.exponent)
        return or_nan(seen, inside, found)
