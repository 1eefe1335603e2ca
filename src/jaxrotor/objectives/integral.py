"""Integrals and means over time, of signals that are straight between samples."""

from collections.abc import Callable, Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..sensors.sensor import AbstractSensor
from ..simulation.response import Response
from .measure import AbstractSignalMeasure, see, span, window_faults


def antiderivative(t: Float[Array, " nt"], values: Float[Array, " nt"]) -> Callable[[Array], Array]:
    """The integral from `t[0]` to any instants within the run (s), exact for a signal that is straight
    between samples: the trapezoidal rule where they are samples, and smooth in between."""
    steps = jnp.diff(t)
    pieces = 0.5 * steps * (values[1:] + values[:-1])
    whole = jnp.concatenate([jnp.zeros(1), jnp.cumsum(pieces)])
    slopes = jnp.diff(values) / steps

    def until(at: Array) -> Array:
        place = jnp.searchsorted(t, jax.lax.stop_gradient(at), side="right") - 1
        k = jnp.clip(place, 0, t.shape[0] - 2)
        u = at - t[k]
        return whole[k] + values[k] * u + 0.5 * slopes[k] * u**2

    return until


def mean(t: Float[Array, " nt"], values: Float[Array, " nt"], start: Array, stop: Array) -> Array:
    """Over time, from `start` to `stop`."""
    until = antiderivative(t, values)
    return (until(stop) - until(start)) / (stop - start)


def moving_mean(
    t: Float[Array, " nt"], values: Float[Array, " nt"], length: Array
) -> Float[Array, " nt"]:
    """Mean over `length` s around each sample. At the ends of the run the window shrinks on both sides
    alike, to nothing on the last sample: so a straight trend is followed exactly all along."""
    half = jnp.minimum(0.5 * length, jnp.minimum(t - t[0], t[-1] - t))
    wide = half > 0
    middle = jnp.mean(values)  # keeps the running sum small
    until = antiderivative(t, values - middle)
    found = (until(t + half) - until(t - half)) / (2 * jnp.where(wide, half, 1.0))
    return jnp.where(wide, middle + found, values)


class Integral(AbstractSignalMeasure):
    """∫ signal^power dt, `power` 1 or 2, or ∫ |signal| dt where `absolute`.

    By the trapezoidal rule: a signal needs some ten samples a period. Effort is
    `Integral(Signal("damper", "torque"), power=2)`, energy (J) the integral of a power.
    """

    power: int = eqx.field(static=True, default=1)
    absolute: bool = eqx.field(static=True, default=False)

    def faults(self) -> Iterator[str]:
        yield from window_faults(self)
        if self.power not in (1, 2):
            yield f"power must be 1 or 2, but is {self.power!r}"

    @property
    def unit(self) -> str:
        own = self.sensor.unit
        if not own:
            return "s"
        return f"({own})**2*s" if self.power == 2 else f"({own})*s"

    def sensors(self) -> tuple[AbstractSensor, ...]:
        return (self.sensor,)

    def __call__(self, response: Response) -> Float[Array, ""]:
        start, stop = span(self, response)
        seen = see(response, self.sensor)
        seen = seen**2 if self.power == 2 else jnp.abs(seen) if self.absolute else seen
        until = antiderivative(response.t, seen)
        return until(stop) - until(start)
