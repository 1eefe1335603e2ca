"""What a control loop measures of the stations that it is connected to."""

import abc
from collections.abc import Iterator

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import whole
from ...core.parameter import parameter
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
    """The twist `phi_first - ratio * phi_second` (rad) and its rate (rad/s) between two of the loop's
    stations, counted from 0: two encoders and their difference, as seen at the first.

    `ratio`: how many times as fast the first turns as the second where nothing twists, negative where they
    turn against each other: from a gear `a` to its partner `b` `1 / mesh.ratio()`, which is
    `-radii[1] / radii[0]`; through several meshes the product.
    """

    first: int = eqx.field(static=True, default=0)
    second: int = eqx.field(static=True, default=1)
    ratio: Float[Array, ""] = parameter(default=1.0, label="speed of the first over the second's")

    def count(self) -> int:
        return 2

    def stations_needed(self) -> int:
        return max(self.first, self.second) + 1

    def values(self, t: Float[Array, ""], motions: tuple[Motion, ...]) -> Float[Array, "2"]:
        (qa, va), (qb, vb) = motions[self.first], motions[self.second]
        return jnp.stack([qa[5] - self.ratio * qb[5], va[5] - self.ratio * vb[5]])

    def faults(self) -> Iterator[str]:
        if min(self.first, self.second) < 0 or self.first == self.second:
            yield (
                "first and second must be two stations of the loop, counted from 0, but are "
                f"{self.first} and {self.second}"
            )
        if self.ratio == 0:
            yield "ratio must not be zero: give the speed of the first station over the second's"


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
    back is how it twists about its last station.

    `ratios`: (stations - 1,), in geared lines: how many times as fast as the last each of the others turns
    where nothing twists, negative against it; what is fed back is `phi - ratio * phi_last`. Left out: as
    fast.
    """

    stations: int = option(whole(2, 100), default=2)
    ratios: Float[Array, " n"] | None = parameter(
        shapes=((None,),), optional=True, default=None, label="speeds over the last station's"
    )

    def count(self) -> int:
        return 2 * (self.stations - 1)

    def stations_needed(self) -> int:
        return self.stations

    def faults(self) -> Iterator[str]:
        if isinstance(self.stations, bool) or self.stations < 2:
            yield f"stations must be two at least, but is {self.stations!r}"
        elif self.ratios is not None and self.ratios.shape != (self.stations - 1,):
            yield (
                f"ratios must have {self.stations - 1} entries, one for each station but the last, but has "
                f"{self.ratios.size}"
            )

    def values(self, t: Float[Array, ""], motions: tuple[Motion, ...]) -> Float[Array, " k"]:
        *others, (q_last, v_last) = motions[: self.stations]
        angles, speeds = (jnp.stack([m[k][5] for m in others]) for k in (0, 1))
        ratios = 1.0 if self.ratios is None else self.ratios
        return jnp.concatenate([angles - ratios * q_last[5], speeds - ratios * v_last[5]])
