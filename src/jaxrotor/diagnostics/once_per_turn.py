"""Once a turn, inside a compiled run: the Poincaré section as an output of sweeps."""

from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.arguments import whole
from ..core.kinematics import TURN
from ..core.parameter import parameter
from ..core.part import option
from ..objectives.measure import AbstractSignalMeasure, see, window_faults, within
from ..sensors.filters import between, places
from ..sensors.sensor import Encoder


class PoincareSamples(AbstractSignalMeasure):
    """What a sensor sees as a shaft passes the angle 2 pi k + `phase`: the last `keep` of those passages
    before `stop`, in the order of time; NaN for those that the window does not have. An output of `jr.sweep`
    with `keep` numbers for each run, which keeps no series.

    **Arguments:** `shaft`: the station whose angle counts; it turns one way throughout. `phase`: rad.

    Between samples angle and signal are polynomials of degree 7: with 10 samples a period of the fastest
    component right to 1e-6. Differentiable, the time of each passage included.
    """

    shaft: str = eqx.field(static=True)  # pyright: ignore[reportGeneralTypeIssues]
    keep: int = option(whole(1))  # pyright: ignore[reportGeneralTypeIssues]
    phase: Float[Array, ""] = parameter("rad", default=0.0)

    def faults(self) -> Iterator[str]:
        yield from window_faults(self)

    @property
    def unit(self) -> str:
        return self.sensor.unit

    def sensors(self) -> tuple[Any, ...]:
        return self.sensor, Encoder(self.shaft)

    def __call__(self, response: Any) -> Float[Array, " keep"]:
        angle, values = see(response, Encoder(self.shaft)), see(response, self.sensor)
        inside = within(self, response)
        first = jnp.argmax(inside)
        last = angle.shape[0] - 1 - jnp.argmax(inside[::-1])
        sense = jnp.where(angle[last] >= angle[first], 1.0, -1.0)
        turned, shift = sense * angle, sense * self.phase
        # a mark on the very last sample, within rounding, counts
        latest = jnp.floor((turned[last] - shift) / TURN + 1e-9)
        marks = TURN * (latest - jnp.arange(self.keep)[::-1]) + shift
        place = places(turned, jax.lax.stop_gradient(marks), last)
        found = between(values, jnp.zeros(()), jnp.ones(()), place)
        return jnp.where(marks >= turned[first] - 1e-9, found, jnp.nan)
