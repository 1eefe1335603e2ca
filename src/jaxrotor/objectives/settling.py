"""How long until a signal has settled."""

from collections.abc import Iterator

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.parameter import parameter
from ..sensors.sensor import AbstractSensor
from ..simulation.response import Response
from .integral import mean
from .measure import AbstractSignalMeasure, or_nan, see, span, window_faults, within

_END = 0.1  # of the window, whose mean is the final level


class SettlingTime(AbstractSignalMeasure):
    """Seconds from `start` until |signal - level| exceeds `band` for the last time; 0 where it never
    does, and the whole window where it still does at `stop`.

    **Arguments:**

    - `band`: in the sensor's unit.
    - `level`: the final one; left out, the mean over the last tenth of the window.

    The crossing is found on the straight line between its two samples, and derivatives pass through it, the
    level and the band. It jumps by half a period where one more crest comes to exceed the band, and
    its derivative knows nothing of that: a trend to follow is that of an envelope. A crest that exceeds the
    band between samples alone is not seen. Where it never settles its derivative is zero.
    """

    band: Float[Array, ""] = parameter(positive=True, label="in the sensor's unit")
    level: Float[Array, ""] | None = parameter(
        optional=True, default=None, label="in the sensor's unit"
    )

    def faults(self) -> Iterator[str]:
        yield from window_faults(self)

    @property
    def unit(self) -> str:
        return "s"

    def sensors(self) -> tuple[AbstractSensor, ...]:
        return (self.sensor,)

    def __call__(self, response: Response) -> Float[Array, ""]:
        inside = within(self, response)
        start, stop = span(self, response)
        t, seen = response.t, see(response, self.sensor)
        level = self.level
        if level is None:
            level = mean(t, seen, stop - _END * (stop - start), stop)
        off = seen - level
        rank = jnp.arange(t.shape[0])
        outside = jnp.max(jnp.where(inside & (jnp.abs(off) > self.band), rank, -1))
        last = jnp.max(jnp.where(inside, rank, -1))
        k = jnp.clip(outside, 0, t.shape[0] - 2)
        sign = jnp.where(off[k] > 0, 1.0, -1.0)
        fall = sign * (off[k] - off[k + 1])
        settles = (outside >= 0) & (outside < last)
        part = (sign * off[k] - self.band) / jnp.where(settles, fall, 1.0)
        crossed = t[k] + part * (t[k + 1] - t[k])
        found = jnp.where(settles, crossed - start, jnp.where(outside < 0, 0.0, stop - start))
        return or_nan(seen, inside, found)
