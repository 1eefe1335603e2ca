"""Quantities scheduled in time: torques, forces, voltages.

A schedule has no unit of its own: its levels are in the unit of what it drives, N·m for a torque.
"""

import abc
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.arguments import whole
from ..core.parameter import parameter
from ..core.part import Part, option
from .monotone import ends, interpolate, row_frequency, table_faults

Scalar = Float[Array, ""]


class AbstractSchedule(Part):
    """A quantity as a function of time. To write your own, give `value` and `jumps`."""

    @abc.abstractmethod
    def value(self, t: Scalar) -> Scalar:
        """The quantity at time t, in the unit of what it drives (N·m for a torque, N for a force)."""

    @abc.abstractmethod
    def jumps(self) -> Float[Array, " n"]:
        """Instants at which the quantity jumps or kinks, s."""

    def top_frequency(self) -> Float[Array, ""]:
        """rad/s: the fastest that it swings between its jumps; the step of a run follows it."""
        return jnp.zeros(())

    def excitation_frequency(self) -> Float[Array, ""]:
        """rad/s: of a swing that goes on at one frequency, to which steps are fitted where it is far above
        the spin's; zero where there is none."""
        return jnp.zeros(())


def as_schedule(value: Any) -> Any:
    """A number becomes a steady schedule: the converter of fields that hold a schedule."""
    return value if isinstance(value, eqx.Module) else Steady(value)


class Steady(AbstractSchedule):
    """The same `level` at all times."""

    level: Scalar = parameter()

    def value(self, t: Scalar) -> Scalar:
        return self.level

    def jumps(self) -> Float[Array, " n"]:
        return jnp.zeros(0)


class Step(AbstractSchedule):
    """`before` until `time` (s), `after` from then on: a load thrown on, a drive that fails."""

    time: Scalar = parameter("s")
    after: Scalar = parameter()
    before: Scalar = parameter(default=0.0)

    def value(self, t: Scalar) -> Scalar:
        return jnp.where(t < self.time, self.before, self.after)

    def jumps(self) -> Float[Array, " n"]:
        return self.time[None]


class Ramp(AbstractSchedule):
    """`before` until `start_time` (s), then straight to `after` within `duration` (s)."""

    start_time: Scalar = parameter("s")
    duration: Scalar = parameter("s", positive=True)
    after: Scalar = parameter()
    before: Scalar = parameter(default=0.0)

    def value(self, t: Scalar) -> Scalar:
        s = (t - self.start_time) / self.duration
        ramp = self.before + (self.after - self.before) * s
        # chosen, not clipped: at the very instant a clip has no one derivative; and by the instants that
        # `jumps` lists, for `s` may round to 1 before them
        begin, end = self.jumps()
        return jnp.where(t < begin, self.before, jnp.where(t < end, ramp, self.after))

    def jumps(self) -> Float[Array, " n"]:
        return jnp.stack([self.start_time, self.start_time + self.duration])  # kinks


class Table(AbstractSchedule):
    """`values` given at `times` (s, increasing), joined by a monotone cubic, held at its first and last
    value outside.

    Source: Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300. Between its ends the curve has no
    kink, so a long table costs no restarts.
    """

    times: Float[Array, " n"] = parameter("s", shapes=((None,),))
    values: Float[Array, " n"] = parameter(shapes=((None,),))

    def faults(self) -> Iterator[str]:
        yield from table_faults(self.times, self.values, ("times", "values"), "s")

    def value(self, t: Scalar) -> Scalar:
        return interpolate(self.times, self.values, t)

    def jumps(self) -> Float[Array, " n"]:
        return ends(self.times)

    def top_frequency(self) -> Float[Array, ""]:
        return row_frequency(self.times)


class PulseTrain(AbstractSchedule):
    """`count` rectangular pulses: `level` for `width` (s) at the begin of every `period` (s), from
    `start` (s) on; `base` between and outside them."""

    period: Scalar = parameter("s", positive=True)
    width: Scalar = parameter("s", positive=True)
    level: Scalar = parameter()
    base: Scalar = parameter(default=0.0)
    start: Scalar = parameter("s", default=0.0)
    # how many: a whole number, for the solver must know the number of edges before it runs
    count: int = option(whole(1, 1_000_000), default=1)

    def faults(self) -> Iterator[str]:
        if not self.width < self.period:
            yield (
                f"width must be less than the period, {float(self.period):g} s, but is "
                f"{float(self.width):g} s: use a Step for a level that stays"
            )

    def _edges(self) -> tuple[Array, Array]:
        rise = self.start + self.period * jnp.arange(self.count)
        return rise, rise + self.width

    def value(self, t: Scalar) -> Scalar:
        # by the very edges that `jumps` lists: a remainder of t would round otherwise
        rise, fall = self._edges()
        on = jnp.any((t >= rise) & (t < fall))
        return jnp.where(on, self.level, self.base)

    def jumps(self) -> Float[Array, " n"]:
        return jnp.concatenate(self._edges())


class Harmonic(AbstractSchedule):
    """`mean + sum amplitude cos(frequency t + phase)`: frequencies in rad/s, phases in rad (zero
    where left out). The lists are equally long."""

    mean: Scalar = parameter()
    amplitudes: Float[Array, " n"] = parameter(shapes=((None,),))
    frequencies: Float[Array, " n"] = parameter("rad/s", shapes=((None,),))
    phases: Float[Array, " n"] | None = parameter(
        "rad", shapes=((None,),), optional=True, default=None
    )

    def faults(self) -> Iterator[str]:
        phases = self.amplitudes if self.phases is None else self.phases
        sizes = [x.shape[0] for x in (self.amplitudes, self.frequencies, phases)]
        if len(set(sizes)) > 1:
            yield (
                f"amplitudes, frequencies and phases must be equally long, but have "
                f"{sizes[0]}, {sizes[1]} and {sizes[2]} entries"
            )

    def value(self, t: Scalar) -> Scalar:
        phases = 0.0 if self.phases is None else self.phases
        return self.mean + jnp.sum(self.amplitudes * jnp.cos(self.frequencies * t + phases))

    def jumps(self) -> Float[Array, " n"]:
        return jnp.zeros(0)

    def top_frequency(self) -> Float[Array, ""]:
        return jnp.max(jnp.abs(self.frequencies * (self.amplitudes != 0)), initial=0.0)

    def excitation_frequency(self) -> Float[Array, ""]:
        return self.top_frequency()


class Impulse(AbstractSchedule):
    """A half sine from `time` (s) for `duration` (s) with the area `impulse`: N·m·s for a torque,
    N·s for a force. Zero outside; the peak is `pi/2 impulse/duration`."""

    time: Scalar = parameter("s")
    duration: Scalar = parameter("s", positive=True)
    impulse: Scalar = parameter(times="s")

    def value(self, t: Scalar) -> Scalar:
        s = (t - self.time) / self.duration
        pulse = 0.5 * jnp.pi * self.impulse / self.duration * jnp.sin(jnp.pi * s)
        begin, end = self.jumps()  # as `Ramp` does
        return jnp.where((t >= begin) & (t < end), pulse, 0.0)

    def jumps(self) -> Float[Array, " n"]:
        return jnp.stack([self.time, self.time + self.duration])  # kinks
