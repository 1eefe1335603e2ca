"""A measurement channel: a sensor and the chain behind it."""

import abc
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from ..core.arguments import whole
from ..core.errors import InputError
from ..core.parameter import known, parameter
from ..core.part import Part, option
from ..core.units import factor, known_unit
from ..simulation.response import Response
from .filters import between, low_pass
from .noise import Noise
from .sensor import AbstractSensor


class AbstractChannel(Part):
    """What stands in a record of what a `sensor` sees, with the `noise` of the record.

    One of your own needs `sensor`, `noise`, `recorded_in` (its unit) and `measure`.
    """

    sensor: eqx.AbstractVar[AbstractSensor]
    noise: eqx.AbstractVar[Noise | None]

    @property
    @abc.abstractmethod
    def recorded_in(self) -> str:
        """The unit of the record."""

    @abc.abstractmethod
    def measure(self, response: Response, times: Any = None) -> Array:
        """The record without noise at `times` (s), by default the samples of the run: (m,), real, or complex
        where vectors are recorded. NaN where the run does not reach."""

    def recorded(self, response: Response, key: PRNGKeyArray, times: Any = None) -> Array:
        """As `measure`, with the channel's noise (of a vector's real and imaginary part each); `times` evenly
        spaced."""
        clean = self.measure(response, times)
        if self.noise is None:
            return clean
        at = response.t if times is None else jnp.asarray(times, float)
        interval = at[1] - at[0]
        if not jnp.iscomplexobj(clean):
            return self.noise.added(key, clean, interval)
        one, other = jax.random.split(key)
        return jax.lax.complex(
            self.noise.added(one, clean.real, interval),
            self.noise.added(other, clean.imag, interval),
        )


class Channel(AbstractChannel):
    """What is recorded of a sensor: `sensitivity` times what it sees, filtered, later by `delay`, plus
    `bias`.

    **Arguments:**

    - `sensor`: what it sees.
    - `unit`: of the record, such as `"V"`; by default the sensor's own.
    - `sensitivity`: `unit` per unit of the sensor: 8000 V/m for 8 V/mm.
    - `bias`: what is recorded of zero, in `unit`: the gap voltage of a probe.
    - `delay`: s. What is recorded at t happened at t - delay; an unknown offset of a clock is a delay too.
    - `cutoff`: Hz, of a Butterworth low-pass of `order` in the chain; none by default.
    - `noise`: of the record. It makes synthetic records and weighs measured ones.

    All of them are parameters: they can be identified like those of the machine.
    """

    sensor: AbstractSensor
    unit: str = option(default="")
    sensitivity: Float[Array, ""] = parameter(default=1.0, label="unit per unit of the sensor")
    bias: Float[Array, ""] = parameter(default=0.0, label="what is recorded of zero")
    delay: Float[Array, ""] = parameter("s", default=0.0)
    cutoff: Float[Array, ""] | None = parameter("Hz", positive=True, optional=True, default=None)
    order: int = option(whole(1, 20), default=2)
    noise: Noise | None = None

    @property
    def recorded_in(self) -> str:
        return self.unit or self.sensor.unit

    def measure(self, response: Response, times: Any = None) -> Float[Array, " m"]:
        interval = response.t[1] - response.t[0]
        seen = self.sensor.signal(response)
        if self.cutoff is not None:
            seen = low_pass(seen, interval, self.cutoff, self.order)
        at = response.t if times is None else jnp.asarray(times, float)
        return self.bias + self.sensitivity * between(
            seen, response.t[0], interval, at - self.delay
        )

    def faults(self) -> Iterator[str]:
        if isinstance(self.order, bool) or self.order not in range(1, 9):
            yield f"order must be a whole number from 1 to 8, but is {self.order!r}"
        size = factor(self.sensor.unit, self.unit) if known_unit(self.unit or " ") else None
        given = known(self.sensitivity)
        if size is not None and size != 1 and given is not None and given == 1:
            yield (
                f"sensitivity must be {size:g} {self.unit} per {self.sensor.unit}, as the unit says, but is "
                "1: write it, or leave the unit out"
            )


def as_channels(given: dict[str, Any]) -> dict[str, AbstractChannel]:
    """Sensors and channels by name; a bare sensor becomes a channel of its own unit."""
    found = {}
    for name, one in given.items():
        if isinstance(one, AbstractSensor):
            one = Channel(one)
        if not isinstance(one, AbstractChannel):
            raise InputError(
                f"`{name}`: must be a sensor or a Channel, but is {one!r} ({type(one).__name__})"
            )
        found[name] = one
    return found
