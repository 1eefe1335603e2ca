"""The synchronous motor while it starts: as an induction motor, with a torque that pulsates."""

from collections.abc import Iterator
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import whole
from ...core.parameter import parameter
from ...core.part import option
from ...core.protocol import (
    AbstractAttachment,
    Motion,
    Nominal,
    Signalling,
    Tabulated,
    Timed,
    Vec6,
)
from ...profiles.monotone import interpolate, table_faults
from ...profiles.schedule import AbstractSchedule, as_schedule
from .load import about_axis


class SynchronousStart(AbstractAttachment, Timed, Tabulated, Nominal, Signalling):
    """A salient-pole synchronous motor in its asynchronous start, N·m on its rotor:

        T = connected (mean(phi') + pulsating(phi') cos(2 (w t - p phi) + phase)),  w = 2 pi frequency,

    `p` = `pole_pairs`: the unequal axes of the rotor make its torque pulsate, twice whenever the field laps
    it, so at `2 frequency (1 - N/Ns)`, Hz, at the speed N. That falls from twice the line's frequency at rest
    to nothing at the synchronous speed `Ns = w/p`, and meets a torsional natural frequency ft at
    `N = Ns (1 - ft/(2 frequency))`.

    - `speeds` (rad/s, increasing), `mean_torques`, `pulsating_torques` (N·m, the latter amplitudes): the
      curves that the motor's maker gives; a monotone cubic between the rows, constant outside them, and a
      run that leaves the table says so.
    - `frequency`: Hz; negative for a motor that turns backward. `phase`: rad.
    - `connected`: scales it, a number or a schedule: a Step switches on.

    Up to where the field is switched on: falling into step is not in it. Linear models have the mean torque
    alone. Signals: `torque` (N·m). Source: the two-axis theory of unequal axes; the frequencies as in
    IEEE Std 1255-2000 (Guide for Evaluation of Torque Pulsations During Starting of Synchronous Motors,
    known from its abstract).
    """

    speeds: Float[Array, " n"] = parameter("rad/s", shapes=((None,),))
    mean_torques: Float[Array, " n"] = parameter("N*m", shapes=((None,),))
    pulsating_torques: Float[Array, " n"] = parameter("N*m", nonnegative=True, shapes=((None,),))
    frequency: Float[Array, ""] = parameter("Hz")
    phase: Float[Array, ""] = parameter("rad", default=0.0)
    connected: AbstractSchedule = eqx.field(
        converter=as_schedule, metadata={"drives": ""}, default=1.0
    )
    pole_pairs: int = option(whole(1, 1000), default=1)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m"}
    # it laps the field, not the shaft
    once_per_turn: ClassVar[bool] = False

    def faults(self) -> Iterator[str]:
        for name in ("mean_torques", "pulsating_torques"):
            yield from table_faults(self.speeds, getattr(self, name), ("speeds", name), "rad/s")
        if self.frequency == 0:
            yield "frequency must not be zero: give the line's, in Hz"

    @property
    def synchronous_speed(self) -> Float[Array, ""]:
        """rad/s of the shaft."""
        return 2 * jnp.pi * self.frequency / self.pole_pairs

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return about_axis(self.torque(t, motions, state))

    def torque(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """N·m on the station."""
        ((q, v),) = motions
        lag = 2 * (2 * jnp.pi * self.frequency * t - self.pole_pairs * q[5]) + self.phase
        mean = interpolate(self.speeds, self.mean_torques, v[5])
        swing = interpolate(self.speeds, self.pulsating_torques, v[5])
        return self.connected.value(t) * (mean + swing * jnp.cos(lag))

    def times(self) -> Float[Array, " n"]:
        return self.connected.jumps()

    def looked_up(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, str]:
        return motions[0][1][5], self.speeds, "rad/s"

    def nominal(self) -> "SynchronousStart":
        """The mean torque alone."""
        return eqx.tree_at(
            lambda m: m.pulsating_torques, self, jnp.zeros_like(self.pulsating_torques)
        )
