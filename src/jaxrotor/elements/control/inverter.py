"""A motor on an inverter, with its control and its torque ripple."""

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
    Stateful,
    Timed,
    Vec6,
)
from ..drives.ripple import unequal, waves
from .actuator import Actuator
from .controller import AbstractController
from .feedback import AbstractFeedback
from .loop import ActiveTorque, ideal, put_on


class InverterDrive(AbstractAttachment, Stateful, Timed, Signalling, Nominal):
    """A motor whose inverter's control sets its torque, which ripples:

        T = T_given (1 + sum share cos(order p phi + phase)),   p = `pole_pairs`, phi of its first station.

    T_given is that of an `ActiveTorque` against the ground with the same `controller`, `measured`, `actuator`
    and `cutoff`: for a speed drive `PI`, a `SpeedError`, and an `Actuator` with the torque's `limit`, the lag
    of the current loop (`bandwidth`) and the dead time (`delay`). Further stations are measured alone: an
    encoder at the load.

    - `orders` (n,): periods of the ripple in one of the inverter's output, 6, 12, ... (of an
      induction machine 6/(1 - slip)). - `shares` (n,): amplitudes as parts of the torque given. - `phases`
      (n,): rad; zero where left out. A ripple over speed, in N·m, is a `TorqueRipple` beside it.

    The loop closes over the shaft: its eigenvalues, and by them the stability of its torsional modes, are
    those of `jr.linearize`; `jr.order_response` at `order p` is the forced vibration with the loop closed.
    Signals: `torque` on the station and `wanted` (N·m), `ripple` (N·m), `power` put into the shaft (W).
    Source: field orientation taken as ideal, torque behind a first-order current loop (Leonhard, Control of
    Electrical Drives, ch. 12).
    """

    controller: AbstractController
    measured: AbstractFeedback
    orders: Float[Array, " n"] = parameter(positive=True, shapes=((None,),))
    shares: Float[Array, " n"] = parameter(shapes=((None,),), label="parts of the torque")
    actuator: Actuator = eqx.field(default_factory=ideal)
    phases: Float[Array, " n"] | None = parameter(
        "rad", shapes=((None,),), optional=True, default=None
    )
    cutoff: Float[Array, ""] | None = parameter("Hz", positive=True, optional=True, default=None)
    pole_pairs: int = option(whole(1, 1000), default=1)

    signals: ClassVar[dict[str, str]] = {
        "torque": "N*m",
        "wanted": "N*m",
        "ripple": "N*m",
        "power": "W",
    }

    def faults(self) -> Iterator[str]:
        yield from self._loop().faults()
        yield from unequal(self.orders, shares=self.shares, phases=self.phases)

    def initial(self) -> Float[Array, " k"]:
        return self._loop().initial()

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        return self._loop().rates(t, motions, accelerations, state)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return put_on(lambda: self.torque(t, motions, state), motions, self.measured, False)

    def times(self) -> Float[Array, " n"]:
        return self._loop().times()

    def torque(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """On the first station, N·m."""
        return self._loop().torque(t, motions, state) + self.ripple(t, motions, state)

    def wanted(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """What the controller asks for, N·m."""
        return self._loop().wanted(t, motions, state)

    def ripple(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """What is added to the torque given, N·m."""
        angle = self.pole_pairs * motions[0][0][5]
        given = self._loop().torque(t, motions, state)
        return given * waves(self.shares, self.orders, self.phases, angle)

    def power(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """Put into the shaft, W."""
        return self.torque(t, motions, state) * motions[0][1][5]

    def nominal(self) -> "InverterDrive":
        """Without the ripple."""
        return eqx.tree_at(lambda d: d.shares, self, jnp.zeros_like(self.shares))

    def _loop(self) -> ActiveTorque:
        return ActiveTorque(self.controller, self.measured, self.actuator, False, self.cutoff)
