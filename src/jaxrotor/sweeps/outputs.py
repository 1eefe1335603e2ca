"""What is kept of each machine of a sweep: numbers, rows over speed, or series."""

from collections.abc import Iterator, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import whole
from ..core.errors import InputError, refuse
from ..core.parameter import parameter, problems
from ..core.part import Part, option
from ..machine.machine import Machine
from ..objectives.machine_measures import AbstractMachineMeasure
from ..objectives.measure import AbstractMeasure, AbstractSignalMeasure, Seen, see
from ..sensors.quantities import Signal
from ..sensors.sensor import AbstractSensor, Tachometer


class TimeSeries(Part):
    """What a sensor sees, every `every`-th sample of it."""

    sensor: AbstractSensor
    every: int = option(whole(1), default=1)

    def __check_init__(self) -> None:
        refuse(problems(self, "TimeSeries"))

    def sensors(self) -> tuple[AbstractSensor, ...]:
        return (self.sensor,)

    def __call__(self, response: Any) -> Float[Array, " k"]:
        return see(response, self.sensor)[:: self.every]


class OverSpeed(Part):
    """The largest |signal| within each of the ranges of speed between `edges` (k + 1, rad/s, rising) of the
    station `speed_of`; NaN where the speed never is."""

    sensor: AbstractSensor
    speed_of: str = eqx.field(static=True)
    edges: Float[Array, " k1"] = parameter("rad/s", shapes=((None,),))

    def __check_init__(self) -> None:
        refuse(problems(self, "OverSpeed"))

    def faults(self) -> Iterator[str]:
        if self.edges.size < 2 or not np.all(np.diff(self.edges) > 0) or self.edges[0] < 0:
            yield (
                "edges must be two rising speeds at least, none of them negative, but are "
                f"{self.edges.tolist()} rad/s"
            )

    def sensors(self) -> tuple[AbstractSensor, ...]:
        return self.sensor, Tachometer(self.speed_of)

    def __call__(self, response: Any) -> Float[Array, " k"]:
        size = jnp.abs(see(response, self.sensor))
        speed = jnp.abs(jax.lax.stop_gradient(see(response, Tachometer(self.speed_of))))
        inside = (speed >= self.edges[:-1, None]) & (speed < self.edges[1:, None])
        largest = jnp.max(jnp.where(inside, size, -jnp.inf), axis=1)
        return jnp.where(inside.any(axis=1), largest, jnp.nan)


Output = AbstractMeasure | AbstractMachineMeasure | TimeSeries | OverSpeed


def checked(outputs: Mapping[str, Any]) -> dict[str, Any]:
    """Bare sensors become whole series. Raises `InputError`."""
    if not isinstance(outputs, Mapping):
        raise InputError(
            "outputs: must be a mapping from names, such as {'peak': PeakValue(Radial('main'))}, "
            f"but is {outputs!r}"
        )
    found = {}
    for name, one in outputs.items():
        one = TimeSeries(one) if isinstance(one, AbstractSensor) else one
        if not isinstance(one, Output):
            raise InputError(
                f"outputs: `{name}` must be a measure (RootMeanSquare(...)), a sensor, a TimeSeries or an "
                f"OverSpeed, but is {one!r} ({type(one).__name__})"
            )
        found[name] = one
    if not found:
        raise InputError("outputs: name one at least, such as {'peak': PeakValue(Radial('main'))}")
    return found


def with_units(outputs: Mapping[str, Any], machine: Machine) -> dict[str, Any]:
    """Signals are told their elements' units."""

    def told(x):
        return x.in_machine(machine) if isinstance(x, Signal) else x

    return {
        name: jax.tree.map(told, one, is_leaf=lambda x: isinstance(x, Signal))
        for name, one in outputs.items()
    }


def unit_of(output: Any) -> str:
    return output.unit if hasattr(output, "unit") else output.sensor.unit


def needs_run(output: Any) -> bool:
    return not isinstance(output, AbstractMachineMeasure)


def needs_states(outputs: Mapping[str, Any]) -> bool:
    """Whether some measure wants the whole response, not only what sensors saw."""
    kinds = (AbstractSignalMeasure, TimeSeries, OverSpeed, AbstractMachineMeasure)
    return not all(isinstance(one, kinds) for one in outputs.values())


def all_sensors(outputs: Mapping[str, Any]) -> tuple[AbstractSensor, ...]:
    """Of all outputs, those that are written alike once."""
    from ..objectives.measure import alike

    found: list[AbstractSensor] = []
    for one in outputs.values():
        if needs_run(one):
            found += [s for s in one.sensors() if not any(alike(s, k) for k in found)]
    return tuple(found)


def evaluated(outputs: Mapping[str, Any], seen: Seen | Any, machine: Any) -> dict[str, Array]:
    return {
        name: jnp.asarray(one(seen) if needs_run(one) else one(machine))
        for name, one in outputs.items()
    }


def coordinates(output: Any, t: np.ndarray) -> tuple[tuple[str, ...], dict[str, np.ndarray]]:
    """Dimensions of one output beside the case, and their values, by name."""
    if isinstance(output, TimeSeries):
        return ("time",), {"time": t[:: output.every]}
    if isinstance(output, OverSpeed):
        edges = np.asarray(output.edges)
        return ("speed",), {"speed": 0.5 * (edges[1:] + edges[:-1])}
    return (), {}
