"""Torques and forces from outside."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..drive.schedule import AbstractSchedule, Steady
from ..parameter import parameter
from ..protocol import AbstractAttachment, Motion, Timed, Vec6


def _as_schedule(value: Any) -> Any:
    return value if isinstance(value, eqx.Module) else Steady(value)


class Torque(AbstractAttachment, Timed):
    """A torque about the axis of rotation on a station, N·m: a number or a schedule in time.

    Positive drives in the sense of phi. It is conjugate to phi, as the paper's torques are.
    """

    value: AbstractSchedule = eqx.field(converter=_as_schedule, metadata={"drives": "N*m"})

    def forces(self, t, motions: tuple[Motion, ...], state) -> tuple[Vec6, ...]:
        torque = self.value.value(t)
        return (torque * jnp.array([0.0, 0, 0, 0, 0, 1]),)

    def times(self) -> Float[Array, " n"]:
        return self.value.jumps()


class Force(AbstractAttachment, Timed):
    """A force fixed in direction on a station or port, N: `direction` times a number or schedule.

    On `"main"` it acts at the geometric centre, on `"main.mass_centre"` at the mass centre, whose
    moment about the geometric centre it then has.
    """

    value: AbstractSchedule = eqx.field(converter=_as_schedule, metadata={"drives": "N"})
    direction: Float[Array, "3"] = parameter(shapes=((3,),), default=(0.0, -1.0, 0.0))

    def forces(self, t, motions: tuple[Motion, ...], state) -> tuple[Vec6, ...]:
        return (jnp.concatenate([self.direction * self.value.value(t), jnp.zeros(3)]),)

    def times(self) -> Float[Array, " n"]:
        return self.value.jumps()
