"""Motions given in time: ramps of speed and tables of it.

A motion is written as its position alone, in rad for a spin; speed and acceleration follow by exact
differentiation, so the three can never disagree.
"""

import abc
from collections.abc import Iterator

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.parameter import parameter
from ..core.part import Part
from .monotone import ends, row_before, row_frequency, slopes, table_faults

Scalar = Float[Array, ""]


class AbstractMotion(Part):
    """A coordinate as a function of time. To write your own, give `position` and `jumps`."""

    @abc.abstractmethod
    def position(self, t: Scalar) -> Scalar:
        """The coordinate at time t; rad for a spin, m for a displacement."""

    @abc.abstractmethod
    def jumps(self) -> Float[Array, " n"]:
        """Instants at which the acceleration jumps or kinks, s; `jnp.zeros(0)` where none are."""

    def top_frequency(self) -> Float[Array, ""]:
        """rad/s: the fastest that the acceleration swings between its jumps; the step of a run follows it."""
        return jnp.zeros(())

    def excitation_frequency(self) -> Float[Array, ""]:
        """As of `AbstractSchedule`."""
        return jnp.zeros(())

    def reach(self) -> Float[Array, ""] | None:
        """How far the coordinate comes from zero; `None` where nobody can say."""
        return None

    def prepared(self) -> "AbstractMotion":
        """What stands for it during a run: work done once, such as integrals of a long record."""
        return self


def differentiate(position, t: Scalar) -> tuple[Array, Array, Array]:
    """`position(t)` with its first and second derivative."""
    one = jnp.ones_like(t)

    def rate(s):
        return jax.jvp(position, (s,), (one,))

    (p, v), (_, a) = jax.jvp(rate, (t,), (one,))
    return p, v, a


class ConstantSpeed(AbstractMotion):
    """`speed` (rad/s) from the beginning."""

    speed: Scalar = parameter("rad/s")

    def position(self, t: Scalar) -> Scalar:
        return self.speed * t

    def jumps(self) -> Float[Array, " n"]:
        return jnp.zeros(0)


class CosineRamp(AbstractMotion):
    """From rest to `speed` (rad/s) in `duration` (s): `w = speed/2 (1 - cos(pi t/duration))`.

    Speed and acceleration are continuous. Source: Matyja & Łazarz 2014.
    """

    speed: Scalar = parameter("rad/s")
    duration: Scalar = parameter("s", positive=True)

    def position(self, t: Scalar) -> Scalar:
        s = t / self.duration
        ramp = 0.5 * self.speed * self.duration * (s - jnp.sin(jnp.pi * s) / jnp.pi)
        after = self.speed * (t - 0.5 * self.duration)
        # chosen, not clipped: at the very instant a clip has no one derivative
        return jnp.where(t < 0.0, 0.0, jnp.where(t < self.duration, ramp, after))

    def jumps(self) -> Float[Array, " n"]:
        return self.duration[None]  # a kink in the acceleration there


class LinearRamp(AbstractMotion):
    """From `start` to `speed` (rad/s) at constant acceleration in `duration` (s)."""

    speed: Scalar = parameter("rad/s")
    duration: Scalar = parameter("s", positive=True)
    start: Scalar = parameter("rad/s", default=0.0)

    def position(self, t: Scalar) -> Scalar:
        # chosen are the numbers of one polynomial: two thirds of the operations in its derivatives
        gain, ended = self.speed - self.start, t >= self.duration
        inside = (t >= 0.0) & ~ended
        begin = jnp.where(ended, -0.5 * gain * self.duration, 0.0)
        speed = jnp.where(ended, self.speed, self.start)
        return begin + t * (speed + t * jnp.where(inside, 0.5 * gain / self.duration, 0.0))

    def jumps(self) -> Float[Array, " n"]:
        return jnp.stack([jnp.zeros_like(self.duration), self.duration])


class SpeedTable(AbstractMotion):
    """Speed given at instants, joined by a monotone cubic, held at its first and last value outside them.

    `times` (s) increase strictly; `speeds` in rad/s. Two rows are a linear ramp. The acceleration is
    continuous inside, so a table of many rows costs no restarts; at both ends it jumps to zero. Source:
    Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300.
    """

    times: Float[Array, " n"] = parameter("s", shapes=((None,),))
    speeds: Float[Array, " n"] = parameter("rad/s", shapes=((None,),))

    def faults(self) -> Iterator[str]:
        yield from table_faults(self.times, self.speeds, ("times", "speeds"), "s")

    def position(self, t: Scalar) -> Scalar:
        x, y = self.times, self.speeds
        m = slopes(x, y)
        h = jnp.diff(x)
        areas = h * (y[:-1] + y[1:]) / 2 + h**2 * (m[:-1] - m[1:]) / 12
        before = jnp.concatenate([jnp.zeros(1), jnp.cumsum(areas)])
        i = row_before(x, t)
        s = (t - x[i]) / h[i]
        inside = before[i] + h[i] * (
            y[i] * (s - s**3 + s**4 / 2)
            + y[i + 1] * (s**3 - s**4 / 2)
            + h[i] * m[i] * (s**2 / 2 - 2 * s**3 / 3 + s**4 / 4)
            + h[i] * m[i + 1] * (s**4 / 4 - s**3 / 3)
        )
        after = before[-1] + y[-1] * (t - x[-1])
        return y[0] * x[0] + jnp.where(
            t < x[0], y[0] * (t - x[0]), jnp.where(t < x[-1], inside, after)
        )

    def jumps(self) -> Float[Array, " n"]:
        return ends(self.times)

    def top_frequency(self) -> Float[Array, ""]:
        return row_frequency(self.times)
