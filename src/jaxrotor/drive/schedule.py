"""Quantities scheduled in time: torques and forces."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..parameter import parameter

Scalar = Float[Array, ""]


class AbstractSchedule(eqx.Module):
    """A quantity as a function of time. To write your own, give `value` and `jumps`."""

    @abc.abstractmethod
    def value(self, t: Scalar) -> Scalar:
        """The quantity at time t, in the unit of what it drives (N·m for a torque, N for a force)."""

    @abc.abstractmethod
    def jumps(self) -> Float[Array, " n"]:
        """Instants at which the quantity jumps, s."""


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
