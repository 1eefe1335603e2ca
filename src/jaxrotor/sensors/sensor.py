"""What instruments see of a run: one signal each, at the samples of the run, without their electronics
(those are the `Channel`'s)."""

import abc
from collections.abc import Iterator
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from ..core.errors import InputError
from ..core.parameter import parameter
from ..core.part import Part
from ..simulation.response import ConnectorResponse, Response, StationResponse


class AbstractSensor(Part):
    """An instrument. One of your own needs `unit` and `signal`."""

    unit: eqx.AbstractClassVar[str]

    @abc.abstractmethod
    def signal(self, response: Response) -> Float[Array, " nt"]:
        """What it sees at the samples of the run, in `unit`. Raises `InputError` where the machine has
        no such part, or nothing there to be seen."""


class Synchronous(abc.ABC):
    """A sensor that knows what it sees of a steady whirl, and so can be met by `unbalance_response`."""

    @abc.abstractmethod
    def watched(self) -> tuple[str, ...]:
        """The outputs of `unbalance_response` that it looks at."""

    @abc.abstractmethod
    def whirl(
        self, values: Complex[Array, "n k"], speeds: Float[Array, " n"]
    ) -> Complex[Array, " n"]:
        """Its vector at each speed (rad/s): it sees Re(vector e^(i phi)), phi the shaft's angle, where the
        outputs do Re(values e^(i phi))."""


def _station(response: Response, name: str) -> StationResponse:
    found = response[name]
    if not isinstance(found, StationResponse):
        raise InputError(f"`{name}`: is no station, this sensor cannot be mounted there")
    return found


class ProximityProbe(AbstractSensor, Synchronous):
    """Distance of a shaft's surface from a probe that looks at it radially, m: positive where the shaft
    has moved away from the design position along `angle`.

    **Arguments:**

    - `station`: whose geometric centre it sees.
    - `angle`: rad, of the direction along which it measures, from x towards y.
    - `runout`: (k, 2), m: cosine and sine amplitude of order 1, 2, ..., k of what the surface shows though
      the shaft stands still; it turns with the shaft.
    """

    station: str = eqx.field(static=True)
    angle: Float[Array, ""] = parameter("rad", label="direction in which it measures")
    runout: Float[Array, "k 2"] | None = parameter(
        "m", shapes=((None, 2),), optional=True, default=None, label="by order, cosine and sine"
    )
    unit: ClassVar[str] = "m"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        at = _station(response, self.station)
        seen = at.x * jnp.cos(self.angle) + at.y * jnp.sin(self.angle)
        if self.runout is not None:
            orders = jnp.arange(1, self.runout.shape[0] + 1)
            angle = orders * (at.phi - self.angle)[:, None]
            seen = seen + jnp.cos(angle) @ self.runout[:, 0] + jnp.sin(angle) @ self.runout[:, 1]
        return seen

    def watched(self) -> tuple[str, ...]:
        return f"{self.station}.x", f"{self.station}.y"

    def whirl(
        self, values: Complex[Array, "n k"], speeds: Float[Array, " n"]
    ) -> Complex[Array, " n"]:
        seen = values[:, 0] * jnp.cos(self.angle) + values[:, 1] * jnp.sin(self.angle)
        if self.runout is not None:
            first = jax.lax.complex(self.runout[0, 0], -self.runout[0, 1])
            seen = seen + first * jnp.exp(-1j * self.angle)
        return seen


class Accelerometer(AbstractSensor, Synchronous):
    """Acceleration of a station along a fixed direction, m/s²; of a `SelfAligningBearing` its housing's.

    `direction`: a vector of any length: `(0, 1, 0)` is vertical. It knows no gravity.
    """

    station: str = eqx.field(static=True)
    direction: Float[Array, "3"] = parameter(shapes=((3,),), label="along which it measures")
    unit: ClassVar[str] = "m/s^2"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        along = self.direction / jnp.linalg.norm(self.direction)
        return _station(response, self.station).acceleration[:, :3] @ along

    def watched(self) -> tuple[str, ...]:
        return tuple(f"{self.station}.{axis}" for axis in "xyz")

    def whirl(
        self, values: Complex[Array, "n k"], speeds: Float[Array, " n"]
    ) -> Complex[Array, " n"]:
        return -(speeds**2) * (values @ (self.direction / jnp.linalg.norm(self.direction)))

    def faults(self) -> Iterator[str]:
        if not abs(self.direction).max() > 0:
            yield "direction must not be zero: give a vector such as (0, 1, 0)"


class Tachometer(AbstractSensor):
    """Speed of a station about the shaft's own axis, rad/s."""

    station: str = eqx.field(static=True)
    unit: ClassVar[str] = "rad/s"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        return _station(response, self.station).speed


class Encoder(AbstractSensor):
    """Angle of a station, rad. What an encoder delivers are instants: `pulses.angle_of` turns recorded ones
    into angles, `pulses.pulse_times` makes them from a run."""

    station: str = eqx.field(static=True)
    unit: ClassVar[str] = "rad"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        return _station(response, self.station).phi


class TorqueSensor(AbstractSensor):
    """Torque in a shaft or a coupling, N·m: the element's own signal `torque`."""

    element: str = eqx.field(static=True)
    unit: ClassVar[str] = "N*m"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        part = response[self.element]
        if not isinstance(part, ConnectorResponse) or "torque" not in part.signals():
            raise InputError(f"`{self.element}`: has no torque to be measured: name a shaft")
        return part.torque  # pyright: ignore[reportAttributeAccessIssue]
