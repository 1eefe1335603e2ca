"""What a control loop measures of the stations that it is connected to."""

import abc
from collections.abc import Iterator

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import whole
from ...core.part import Part, option
from ...core.protocol import Motion
from ...profiles.schedule import AbstractSchedule, as_schedule


class AbstractFeedback(Part):
    """Measured values. One of your own needs `count`, `stations_needed` and `values`."""

    @abc.abstractmethod
    def count(self) -> int:
        """How many they are."""

    @abc.abstractmethod
    def stations_needed(self) -> int:
        """How many stations the loop must be given at least."""

    @abc.abstractmethod
    def values(self, t: Float[Array, ""], motions: tuple[Motion, ...]) -> Float[Array, " k"]:
        """From the motions of the loop's stations, in the order in which it was given them."""


class TwistOf(AbstractFeedback):
    """The twist `phi_first - phi_second` (rad) and its rate (rad/s) between two of the loop's stations,
    counted from 0: two encoders and their difference."""

    first: int = eqx.field(static=True, default=0)
    second: int = eqx.field(static=True, default=1)

    def count(self) -> int:
        return 2

    def stations_needed(self) -> int:
        return max(self.first, self.second) + 1

    def values(self, t: Float[Array, ""], motions: tuple[Motion, ...]) -> Float[Array, "2"]:
        (qa, va), (qb, vb) = motions[self.first], motions[self.second]
        return jnp.stack([qa[5] - qb[5], va[5] - vb[5]])

    def faults(self) -> Iterator[str]:
        if min(self.first, self.second) < 0 or self.first == self.second:
            yield (
                "first and second must be two stations of the loop, counted from 0, but are "
                f"{self.first} and {self.second}"
            )


class SpeedError(AbstractFeedback):
    """How much faster than `setpoint` (rad/s, a number or a schedule) a station of the loop turns: phi' less
    setpoint, one value."""

    setpoint: AbstractSchedule = eqx.field(converter=as_schedule, metadata={"drives": "rad/s"})
    station: int = eqx.field(static=True, default=0)

    def count(self) -> int:
        return 1

    def stations_needed(self) -> int:
        return self.station + 1

    def values(self, t: Float[Array, ""], motions: tuple[Motion, ...]) -> Float[Array, "1"]:
        return (motions[self.station][1][5] - self.setpoint.value(t))[None]


class RelativeStates(AbstractFeedback):
    """For state feedback: of the loop's first `stations` but the last of them, the angles phi relative to
    that last one's (rad), then the speeds phi' relative to it (rad/s). A line in service turns: what is fed
    back is how it twists about its last station."""

    stations: int = option(whole(2, 100), default=2)

    def count(self) -> int:
        return 2 * (self.stations - 1)

    def stations_needed(self) -> int:
        return self.stations

    def faults(self) -> Iterator[str]:
        if isinstance(self.stations, bool) or self.stations < 2:
            yield f"stations must be two at least, but is {self.stations!r}"

    def values(self, t: Float[Array, ""], motions: tuple[Motion, ...]) -> Float[Array, " k"]:
        *others, (q_last, v_last) = motions[: self.stations]
        angles = [q[5] - q_last[5] for q, _ in others]
        speeds = [v[5] - v_last[5] for _, v in others]
        return jnp.stack([*angles, *speeds])
