"""Steady vectors over speed: what a balancer measures, met by the linear machine without any run."""

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.arguments import choice, mapping, numbers, some_text
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from ..linear.orders import unbalance_response
from ..machine.machine import Machine
from ..search.instrumented import Instrumented
from ..sensors.channel import AbstractChannel
from ..sensors.sensor import Synchronous
from ..sensors.tracking_filter import TrackingFilter
from .simulated import AbstractRun


@dataclasses.dataclass(frozen=True)
class Vectors:
    """One channel: complex `values` at the speeds `t` (rad/s), in `unit`; NaN where one is missing."""

    t: Float[np.ndarray, " n"]
    values: Complex[np.ndarray, " n"]
    unit: str

    @property
    def valid(self) -> np.ndarray:
        return np.isfinite(self.values)

    def scaled(self, size: float, unit: str, place: str) -> "Vectors":
        return Vectors(self.t, size * self.values, unit)

    def __len__(self) -> int:
        return self.t.size


class SteadyRun(AbstractRun):
    """Steady states, each at its own speed and under its own conditions."""

    times: tuple[Array, ...]
    conditions: dict[str, Array]
    channels: tuple[str, ...] = eqx.field(static=True)
    at: str = eqx.field(static=True)
    one_by_one: ClassVar[bool] = True

    def records(self, bench: Instrumented) -> tuple[Array, ...]:
        filters = [filter_of(bench.channels[name], f"`{name}`") for name in self.channels]
        looked_at = [f.sensor.watched() for f in filters]  # pyright: ignore
        outputs = tuple(dict.fromkeys(name for names in looked_at for name in names))
        speeds = self.times[0]

        def whirl(speed, conditions):
            machine = bench.machine.set(conditions) if conditions else bench.machine
            return unbalance_response(machine, outputs, speed, at=self.at).values

        if self.conditions:
            values = jax.lax.map(
                lambda row: whirl(row[0][None], row[1])[0], (speeds, self.conditions)
            )
        else:
            values = whirl(speeds, {})
        return tuple(
            f.over_speed(values[:, np.array([outputs.index(name) for name in names])], speeds)
            for f, names in zip(filters, looked_at)
        )


def filter_of(channel: AbstractChannel, place: str) -> TrackingFilter:
    """The channel, where a steady response can be told of it; raises `InputError`."""
    if not isinstance(channel, TrackingFilter):
        raise InputError(
            f"{place}: steady vectors are what a TrackingFilter records, but it is a "
            f"{type(channel).__name__}: put its sensor into a jr.sensors.TrackingFilter"
        )
    if not isinstance(channel.sensor, Synchronous) or channel.order != 1:
        raise InputError(
            f"{place}: a {type(channel.sensor).__name__} at order {channel.order} cannot be told from an "
            "unbalance response: measure it in a run"
        )
    return channel


def _units(value: Any, place: str) -> Any:
    return mapping(value, place) if isinstance(value, Mapping) else some_text(value, place)


@shows()
@dataclasses.dataclass(frozen=True, init=False)
class MeasuredResponse:
    """Vectors of `TrackingFilter`s in steady states, met by `unbalance_response`: nothing is run through
    time, and of the machine its linearisation counts.

    **Arguments:**

    - `speeds`: (n,), rad/s; one steady state each, in any order, the same one as often as it was measured.
    - `vectors`: channel -> (n,) complex, as its `TrackingFilter` shows them; NaN where one is missing.
    - `conditions`: what was different: path -> a value for all, or (n,) values, such as trial masses. One
      program serves them all.
    - `unit`: of the vectors, or channel -> unit; by default that of their channels.
    - `name`: for messages and figures.
    - `at`: `"equilibrium"`, where it stays under weight, steady loads and films; or `"undeformed"`, which
      says the same of a linear machine that nothing deflects, and compiles in a third of the time.

    Raises `InputError` for lengths that differ, and for what is not finite.
    """

    speeds: Float[np.ndarray, " n"]
    series: Mapping[str, Vectors]
    conditions: Mapping[str, Float[np.ndarray, " n"]]
    name: str
    at: str

    @takes(
        speeds=numbers("rad/s"),
        vectors=mapping,
        conditions=mapping,
        unit=_units,
        at=choice("equilibrium", "undeformed"),
    )
    def __init__(
        self,
        speeds: Any,
        vectors: Mapping[str, Any],
        conditions: Mapping[str, Any] | None = None,
        unit: str | Mapping[str, str] = "",
        name: str = "response",
        at: Literal["equilibrium", "undeformed"] = "equilibrium",
    ):
        speeds = np.atleast_1d(np.asarray(speeds, float))
        if not vectors:
            raise InputError(f"`{name}`: holds no vectors: give channel -> complex values")
        series, known = {}, {}
        for channel, given in vectors.items():
            values = _row(given, f"`{name}`: {channel}", complex, speeds)
            if np.isinf(values).any():
                raise InputError(f"`{name}`: {channel}: is infinite: a missing vector is nan")
            if not np.isfinite(values).any():
                raise InputError(f"`{name}`: {channel}: has no value: is the right column named?")
            own = unit if isinstance(unit, str) else unit.get(channel, "")
            series[channel] = Vectors(speeds, values, own)
        for path, given in (conditions or {}).items():
            place = f"`{name}`: conditions: {path}"
            values = _row(
                np.broadcast_to(given, speeds.shape) if np.ndim(given) == 0 else given,
                place,
                float,
                speeds,
            )
            if not np.isfinite(values).all():
                row = int(np.argmin(np.isfinite(values)))
                raise InputError(
                    f"{place}: is {values[row]:g} in row {row + 1}: leave such rows out"
                )
            known[path] = values
        for field, value in dict(
            speeds=speeds, series=series, conditions=known, name=name, at=at
        ).items():
            object.__setattr__(self, field, value)

    def check(self, machine: Machine) -> None:
        """Raises `InputError` where `machine` does not have what the conditions name."""
        for row in range(len(self.speeds)):
            machine.set({path: values[row] for path, values in self.conditions.items()})

    def planned(self, machine: Machine) -> "MeasuredResponse":
        return self

    def posed(self) -> SteadyRun:
        """Ready to be compared."""
        return SteadyRun(
            times=tuple(jnp.asarray(self.speeds) for _ in self.series),
            conditions={path: jnp.asarray(values) for path, values in self.conditions.items()},
            channels=tuple(self.series),
            at=self.at,
        )


def _row(given: Any, place: str, kind: type, speeds: np.ndarray) -> np.ndarray:
    try:
        found = np.atleast_1d(np.asarray(given, kind))
    except (TypeError, ValueError):
        raise InputError(f"{place}: must be numbers, one for each speed") from None
    if found.shape != speeds.shape:
        raise InputError(
            f"{place}: needs a value for each of the {speeds.size} speeds, but has shape {found.shape}"
        )
    return found
