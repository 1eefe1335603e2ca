"""Control of speed."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import (
    AbstractAttachment,
    Motion,
    NonSmooth,
    Signalling,
    Stateful,
    Timed,
    Vec6,
)
from ...profiles.schedule import AbstractSchedule, as_schedule
from .load import about_axis


class SpeedGovernor(AbstractAttachment, Stateful, Timed, Signalling, NonSmooth):
    """A drive whose torque a PI controller sets, to hold its station's phi' at `setpoint`.

    It wants `proportional e + z`, where `e = setpoint - phi'`, and gives that within
    `±torque_limit` (N·m, positive drives). The integral's share z (N·m) is a state, zero at the
    start: `z' = integral e + anti_windup (given - wanted)`. So a controller at its limit does not
    wind up: back-calculation, Åström & Hägglund, PID Controllers, sec. 3.5. `proportional` in
    N·m·s/rad, `integral` in N·m/rad, `anti_windup` in 1/s (left out: integral/proportional).
    `setpoint` in rad/s, a number or a schedule. Signals: `integral_torque` (N·m).
    """

    setpoint: AbstractSchedule = eqx.field(converter=as_schedule, metadata={"drives": "rad/s"})
    proportional: Float[Array, ""] = parameter("N*m*s/rad", positive=True)
    integral: Float[Array, ""] = parameter("N*m/rad", nonnegative=True)
    torque_limit: Float[Array, ""] = parameter("N*m", positive=True)
    anti_windup: Float[Array, ""] | None = parameter(
        "1/s", nonnegative=True, optional=True, default=None
    )

    signals: ClassVar[dict[str, str]] = {"integral_torque": "N*m"}

    def initial(self) -> Float[Array, "1"]:
        return jnp.zeros(1)

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, "1"]:
        error, wanted, given = self._torques(t, motions, state)
        back = self.anti_windup
        if back is None:
            back = self.integral / self.proportional
        return (self.integral * error + back * (given - wanted))[None]

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return about_axis(self._torques(t, motions, state)[2])

    def times(self) -> Float[Array, " n"]:
        return self.setpoint.jumps()

    def integral_torque(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Array:
        return state[0]

    def _torques(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Array, Array, Array]:
        """Error of speed (rad/s), torque wanted and torque given (N·m)."""
        ((_, v),) = motions
        error = self.setpoint.value(t) - v[5]
        wanted = self.proportional * error + state[0]
        return error, wanted, jnp.clip(wanted, -self.torque_limit, self.torque_limit)
