"""What a balancing instrument shows: the vector that turns with the shaft."""

from collections.abc import Iterator
from typing import Any, Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.arguments import whole
from ..core.kinematics import TURN
from ..core.parameter import parameter
from ..core.part import option
from ..core.units import factor, known_unit
from ..simulation.response import Response
from .channel import AbstractChannel
from .filters import between, places
from .noise import Noise
from .sensor import AbstractSensor, Encoder, Synchronous

# What is shown of an amplitude, by how it is read.
_READINGS = {"0-peak": 1.0, "peak-to-peak": 2.0, "rms": np.sqrt(0.5)}


class TrackingFilter(AbstractChannel):
    """Amplitude and phase of what a sensor sees at `order` times a shaft's turns, as a digital vector filter
    records them: complex, V = (2/window) times the integral of x e^(-i order theta) over whole turns, theta
    the shaft's angle from the keyphasor's mark, counted the way it turns.

    **Arguments:**

    - `sensor`: what it looks at.
    - `shaft`: station whose turns are counted.
    - `order`: per turn, whole: 1 is the "1x".
    - `turns`: whole turns of the window, which lies about the instant that is asked for (at the ends of a
      run the nearest one that it holds whole). A short window follows a quick run-up and lets free vibration
      beat with it; a long one smooths a resonance.
    - `mark`: rad, the shaft's angle phi as the keyphasor fires.
    - `lag`: the phase that is shown is the angle from the pulse to the next peak, which grows as the
      vibration falls behind (x = |V| cos(theta - phase)), as on most instruments. Otherwise it leads
      (x = |V| cos(theta + phase), V as above).
    - `unit`: of the record, by default the sensor's: `"um"`, `"mil"`. `reading`: of the amplitude,
      `"0-peak"`, `"peak-to-peak"` or `"rms"`.
    - `subtracted`: (real, imaginary), the slow-roll vector that the instrument has taken off, as shown.
    - `noise`: of the real and of the imaginary part each, in `unit`.

    Source: Bently & Hatch, Fundamentals of Rotating Machinery Diagnostics (2002), ch. 2 and 7.
    """

    sensor: AbstractSensor
    shaft: str = option()
    order: int = option(whole(1, 20), default=1)
    turns: int = option(whole(1, 1000), default=1)
    mark: Float[Array, ""] = parameter("rad", default=0.0)
    lag: bool = option(default=True)
    unit: str = option(default="")
    reading: Literal["0-peak", "peak-to-peak", "rms"] = option(default="0-peak")
    subtracted: Float[Array, "2"] | None = parameter(
        shapes=((2,),), optional=True, default=None, label="real and imaginary part, as shown"
    )
    noise: Noise | None = None

    def faults(self) -> Iterator[str]:
        fits = not self.unit or known_unit(self.unit) and factor(self.sensor.unit, self.unit)
        if not fits:
            yield f"unit must be a multiple of {self.sensor.unit}, but is {self.unit!r}"

    @property
    def recorded_in(self) -> str:
        return self.unit or self.sensor.unit

    def measure(self, response: Response, times: Any = None) -> Complex[Array, " m"]:
        """Vectors whose windows lie about `times` (s). Raises `InputError` where `shaft` is no station."""
        at = response.t if times is None else jnp.asarray(times, float)
        seen, angle = self.sensor.signal(response), Encoder(self.shaft).signal(response)
        one, nought = jnp.ones(()), jnp.zeros(())
        interval = response.t[1] - response.t[0]
        middle = between(angle, response.t[0], interval, at)
        sense = jnp.where(angle[-1] >= angle[0], 1.0, -1.0)
        steps = max(32, 16 * self.order) * self.turns
        half = 0.5 * TURN * self.turns
        within = 2 * half * ((jnp.arange(steps) + 0.5) / steps - 0.5)
        # at the ends of the run: the nearest whole window
        middle = jnp.clip(sense * middle, sense * angle[0] + half, sense * angle[-1] - half)
        marks = (middle[:, None] + within).ravel()
        there = places(sense * angle, marks, jnp.asarray(angle.shape[0] - 1))
        values = between(seen, nought, one, there)
        theta = marks - sense * self.mark
        vectors = 2 * jnp.mean(
            (values * jnp.exp(-1j * self.order * theta)).reshape(-1, steps), axis=1
        )
        return self._shown(vectors)

    def over_speed(
        self, values: Complex[Array, "n k"], speeds: Float[Array, " n"]
    ) -> Complex[Array, " n"]:
        """What is shown in steady states of order 1, `values` being those of the sensor's `watched` outputs
        (it is a `Synchronous` one)."""
        assert isinstance(self.sensor, Synchronous)
        ahead = jnp.exp(1j * self.mark)  # theta = phi - mark
        vectors = self.sensor.whirl(values, speeds) * ahead
        # counted the way it turns, x = Re(V e^(i phi)) is Re(conj(V) e^(i theta)) where phi falls
        return self._shown(jnp.where(speeds < 0, jnp.conj(vectors), vectors))

    def _shown(self, vectors: Array) -> Array:
        size = factor(self.sensor.unit, self.recorded_in)
        assert size is not None  # `faults`
        shown = size * _READINGS[self.reading] * (jnp.conj(vectors) if self.lag else vectors)
        if self.subtracted is not None:
            shown = shown - (self.subtracted[0] + 1j * self.subtracted[1])
        return shown
