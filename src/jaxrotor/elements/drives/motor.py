"""Motors by their characteristic, and the direct-current motor."""

from collections.abc import Iterator
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import (
    AbstractAttachment,
    Energetic,
    Motion,
    Powered,
    Signalling,
    Stateful,
    Timed,
    Vec6,
)
from ...profiles.schedule import AbstractSchedule, as_schedule
from .load import about_axis


class KlossMotor(AbstractAttachment, Timed):
    """An induction motor by Kloss's formula: `T = 2 breakdown_torque s sk/(s² + sk²)`, N·m.

    `s = 1 - phi'/synchronous_speed` is the slip, `sk = breakdown_slip` that at the breakdown torque.
    The torque drives towards `synchronous_speed` (rad/s of the shaft; negative turns backward), and
    beyond it brakes. `connected` scales it, a number or a schedule: 0 is a blackout. The fluxes are
    taken as settled: for the surge of torque at switching see `InductionMotor`. Source: Kloss,
    Archiv für Elektrotechnik 5 (1916) 59; stator resistance neglected.
    """

    breakdown_torque: Float[Array, ""] = parameter("N*m", positive=True)
    breakdown_slip: Float[Array, ""] = parameter(positive=True)
    synchronous_speed: Float[Array, ""] = parameter("rad/s")
    connected: AbstractSchedule = eqx.field(
        converter=as_schedule, metadata={"drives": ""}, default=1.0
    )

    def faults(self) -> Iterator[str]:
        if self.synchronous_speed == 0:
            yield "synchronous_speed must not be zero: give 2 pi times frequency over pole pairs"

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        ((_, v),) = motions
        # both slips as speeds: so the sense of turning takes care of itself
        behind = self.synchronous_speed - v[5]
        at_breakdown = self.breakdown_slip * jnp.abs(self.synchronous_speed)
        share = 2 * behind * at_breakdown / (behind**2 + at_breakdown**2)
        return about_axis(self.connected.value(t) * self.breakdown_torque * share)

    def times(self) -> Float[Array, " n"]:
        return self.connected.jumps()


class DCMotor(AbstractAttachment, Stateful, Energetic, Powered, Timed, Signalling):
    """A direct-current motor with constant excitation, whose armature current is a state.

    `inductance i' = voltage - resistance i - constant phi'`; the torque on the station is
    `constant i` (N·m), driving where the current is positive. `resistance` in ohm, `inductance` in
    H, `constant` in N·m/A, which is V·s/rad; `voltage` in V, a number or a schedule. The current is
    zero at the start. Signals: `current` (A). Source: Leonhard, Control of Electrical Drives, ch. 5.
    """

    resistance: Float[Array, ""] = parameter("ohm", positive=True)
    inductance: Float[Array, ""] = parameter("H", positive=True)
    constant: Float[Array, ""] = parameter("V*s/rad")
    voltage: AbstractSchedule = eqx.field(  # pyright: ignore
        converter=as_schedule, metadata={"drives": "V"}
    )

    signals: ClassVar[dict[str, str]] = {"current": "A"}

    def initial(self) -> Float[Array, "1"]:
        return jnp.zeros(1)

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, "1"]:
        ((_, v),) = motions
        drop = self.resistance * state + self.constant * v[5]
        return (self.voltage.value(t) - drop) / self.inductance

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return about_axis(self.constant * state[0])

    def times(self) -> Float[Array, " n"]:
        return self.voltage.jumps()

    def current(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return state[0]

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return 0.5 * self.inductance * state[0] ** 2

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.resistance * state[0] ** 2

    def power_in(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.voltage.value(t) * state[0]
