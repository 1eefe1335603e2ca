"""Motions of what a machine stands on: a record of acceleration, and waves."""

from collections.abc import Iterator

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.gate import takes
from ..core.parameter import parameter
from .monotone import ends, row_before, row_frequency, table_faults
from .motion import AbstractMotion, Scalar


class AccelerationRecord(AbstractMotion):
    """A measured acceleration, straight from row to row, integrated twice: an earthquake, a shock, a test
    on a shaker.

    `times` (s) increase strictly; `accelerations` in rad/s², of a displacement in m/s². Before the first row
    all is at rest at zero; behind the last the last speed goes on. Both integrals are exact. An offset of the
    instrument makes the displacement run away: `at_rest` takes it off, `jr.interop.read_accelerations`
    reads files. Source: Chopra, Dynamics of Structures, sec. 5.2 (straight between samples).
    """

    times: Float[Array, " n"] = parameter("s", shapes=((None,),))
    accelerations: Float[Array, " n"] = parameter("rad/s^2", shapes=((None,),))

    def faults(self) -> Iterator[str]:
        yield from table_faults(self.times, self.accelerations, ("times", "accelerations"), "s")

    def position(self, t: Scalar) -> Scalar:
        return self.prepared().position(t)

    def jumps(self) -> Float[Array, " n"]:
        return ends(self.times)

    def top_frequency(self) -> Float[Array, ""]:
        return row_frequency(self.times)

    def reach(self) -> Float[Array, ""]:
        return jnp.max(jnp.abs(self.prepared().positions))

    def prepared(self) -> "IntegratedRecord":
        h, a = jnp.diff(self.times), self.accelerations
        none = jnp.zeros(1)
        v = jnp.concatenate([none, jnp.cumsum(h * (a[:-1] + a[1:]) / 2)])
        steps = h * v[:-1] + h**2 * (2 * a[:-1] + a[1:]) / 6
        return IntegratedRecord(self.times, a, v, jnp.concatenate([none, jnp.cumsum(steps)]))

    @takes()
    def at_rest(self, displacement: float = 0.0) -> "AccelerationRecord":
        """The record less the straight line by which it ends at rest, `displacement` (m or rad) from where it
        began: a permanent one is a fault's slip. Differentiable. The line is of the least order that can meet
        both; what it changes is an offset and a drift of the instrument. Raises `InputError` for what is no
        number."""
        span = self.times[-1] - self.times[0]
        s = (self.times - self.times[0]) / span
        # of 1 and s the speeds and displacements at the end, exactly, as the record is straight too
        found = self.prepared()
        speed, place = found.speeds[-1] / span, (found.positions[-1] - displacement) / span**2
        # offset + slope/2 = speed, offset/2 + slope/6 = place
        slope = 6.0 * (speed - 2.0 * place)
        offset = speed - slope / 2.0
        return AccelerationRecord(self.times, self.accelerations - offset - slope * s)


class IntegratedRecord(AbstractMotion):
    """An `AccelerationRecord` with its speeds and positions at each row, found once a run."""

    times: Float[Array, " n"] = parameter("s", shapes=((None,),))
    accelerations: Float[Array, " n"] = parameter("rad/s^2", shapes=((None,),))
    speeds: Float[Array, " n"] = parameter("rad/s", shapes=((None,),))
    positions: Float[Array, " n"] = parameter("rad", shapes=((None,),))

    def position(self, t: Scalar) -> Scalar:
        x, a, v, p = self.times, self.accelerations, self.speeds, self.positions
        i = row_before(x, t)
        since = t - x[i]
        bend = (a[i + 1] - a[i]) / (x[i + 1] - x[i])
        inside = p[i] + since * (v[i] + since * (a[i] / 2 + since * bend / 6))
        after = p[-1] + v[-1] * (t - x[-1])
        return jnp.where(t < x[0], 0.0, jnp.where(t < x[-1], inside, after))

    def jumps(self) -> Float[Array, " n"]:
        return ends(self.times)


class HarmonicMotion(AbstractMotion):
    """Waves: `sum sines sin(2 pi f t) + cosines cos(2 pi f t)`: a ship that rolls and pitches, a floor beside
    a press.

    `sines` and `cosines` (zero where left out) in rad, of a displacement in m; `frequencies` f in Hz. The
    lists are equally long. `rise` (s): the waves grow from nothing over this time by a smooth curve,
    `10 s³ - 15 s⁴ + 6 s⁵`, so that a run may begin at rest; left out, they are there from the beginning.
    """

    sines: Float[Array, " n"] = parameter("rad", shapes=((None,),))
    frequencies: Float[Array, " n"] = parameter("Hz", shapes=((None,),))
    cosines: Float[Array, " n"] | None = parameter(
        "rad", shapes=((None,),), optional=True, default=None
    )
    rise: Float[Array, ""] | None = parameter("s", positive=True, optional=True, default=None)

    def faults(self) -> Iterator[str]:
        cosines = self.sines if self.cosines is None else self.cosines
        sizes = [x.shape[0] for x in (self.sines, self.frequencies, cosines)]
        if len(set(sizes)) > 1:
            yield (
                f"sines, frequencies and cosines must be equally long, but have {sizes[0]}, {sizes[1]} "
                f"and {sizes[2]} entries"
            )

    def position(self, t: Scalar) -> Scalar:
        angle = 2 * jnp.pi * self.frequencies * t
        waves = self.sines * jnp.sin(angle)
        if self.cosines is not None:
            waves = waves + self.cosines * jnp.cos(angle)
        whole = jnp.sum(waves)
        if self.rise is None:
            return whole
        s = t / self.rise
        grown = s**3 * (10.0 + s * (6.0 * s - 15.0))
        return whole * jnp.where(t < 0.0, 0.0, jnp.where(t < self.rise, grown, 1.0))

    def jumps(self) -> Float[Array, " n"]:
        return jnp.zeros(0) if self.rise is None else self.rise[None]  # the jerk kinks there

    def top_frequency(self) -> Float[Array, ""]:
        return 2 * jnp.pi * jnp.max(jnp.abs(self.frequencies), initial=0.0)

    def excitation_frequency(self) -> Float[Array, ""]:
        return self.top_frequency()

    def reach(self) -> Float[Array, ""]:
        cosines = jnp.zeros_like(self.sines) if self.cosines is None else self.cosines
        return jnp.sum(jnp.hypot(self.sines, cosines))
