"""How strong a signal is, over all of its time: root mean square, and what it stays below."""

from collections.abc import Iterator
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.parameter import parameter
from ..sensors.sensor import AbstractSensor
from ..simulation.response import Response
from .integral import mean, moving_mean
from .measure import AbstractSignalMeasure, or_nan, see, span, window_faults, within


class RootMeanSquare(AbstractSignalMeasure):
    """`sqrt(mean of (signal - centre)²)` over time.

    **Arguments:**

    - `moving`: s; the centre is the signal's moving mean over so long: what vibrates faster counts, what
      drifts does not. A vibration of f Hz is halved at `moving` = 0.6/f. The window is centred; towards the
      ends of the run (not of `start` to `stop`) it shrinks on both sides alike, so that trends are taken
      out there too, and with them some of the vibration.
    - `about`: without `moving`, the centre: zero, or the mean from `start` to `stop`.

    The derivative at a signal that is zero throughout is zero.
    """

    moving: Float[Array, ""] | None = parameter("s", positive=True, optional=True, default=None)
    about: Literal["zero", "mean"] = eqx.field(static=True, default="zero")

    def faults(self) -> Iterator[str]:
        yield from window_faults(self)

    @property
    def unit(self) -> str:
        return self.sensor.unit

    def sensors(self) -> tuple[AbstractSensor, ...]:
        return (self.sensor,)

    def __call__(self, response: Response) -> Float[Array, ""]:
        start, stop = span(self, response)
        t, seen = response.t, see(response, self.sensor)
        if self.moving is not None:
            seen = seen - moving_mean(t, seen, self.moving)
        elif self.about == "mean":
            seen = seen - mean(t, seen, start, stop)
        square = mean(t, seen**2, start, stop)
        return jnp.sqrt(jnp.where(square == 0, 1.0, square)) * (square != 0)


class Percentile(AbstractSignalMeasure):
    """What |signal| stays below for a `share` of the samples: 0.95 leaves out the highest twentieth.

    Interpolated linearly between the two samples of that rank, as NumPy's `quantile`; its derivative is
    theirs, and exact but where ranks change.
    """

    share: Float[Array, ""] = parameter(nonnegative=True, default=0.95)

    def faults(self) -> Iterator[str]:
        yield from window_faults(self)
        if self.share > 1:
            yield f"share must be 1 at most, but is {self.share:g}: give 0.95 for 95 %"

    @property
    def unit(self) -> str:
        return self.sensor.unit

    def sensors(self) -> tuple[AbstractSensor, ...]:
        return (self.sensor,)

    def __call__(self, response: Response) -> Float[Array, ""]:
        inside = within(self, response)
        seen = see(response, self.sensor)
        rising = jnp.sort(jnp.where(inside, jnp.abs(seen), jnp.inf))
        last = jnp.maximum(jnp.sum(inside) - 1, 0)
        place = self.share * last
        below = jnp.clip(jnp.floor(place).astype(int), 0, last)
        low, high = rising[below], rising[jnp.minimum(below + 1, last)]
        return or_nan(seen, inside, low + (place - below) * (high - low))
