"""Torque ripple of a machine that an inverter feeds."""

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


def waves(
    amplitudes: Float[Array, " n"],
    orders: Float[Array, " n"],
    phases: Float[Array, " n"] | None,
    angle: Array,
) -> Float[Array, ""]:
    """The sum of `amplitudes cos(orders angle + phases)`."""
    ahead = 0.0 if phases is None else phases
    return jnp.sum(amplitudes * jnp.cos(orders * angle + ahead))


def unequal(orders: Array, **others: Array | None) -> Iterator[str]:
    """Faults of rows that do not belong together."""
    for name, row in others.items():
        if row is not None and row.shape[-1] != orders.shape[0]:
            yield (
                f"orders and {name} must be equally long, but have {orders.shape[0]} and "
                f"{row.shape[-1]} entries"
            )


class TorqueRipple(AbstractAttachment, Timed, Tabulated, Nominal, Signalling):
    """The torque that pulsates with an inverter's output, N·m on its station, without a mean:

        T = connected sum amplitude(phi') cos(order p phi + phase),   p = `pole_pairs`.

    A three-phase bridge makes 6, 12, 18 ... periods in one of its output; a twelve-pulse one leaves out the
    odd sixes. So `orders` (n,) are multiples of the electrical frequency `p phi'/(2 pi)`: 6 is 6 p times per
    turn of the shaft, and meets a torsional natural frequency f at the speed `2 pi f/(6 p)`. An
    induction machine turns slower than its field: give 6/(1 - slip).

    - `speeds` (m,), rad/s, increasing, and `amplitudes` (m, n), N·m: the table of the drive's maker; a
      monotone cubic between the rows, constant outside them, and a run that leaves the table says so.
    - `phases` (n,): rad; zero where left out. `connected` scales it, a number or a schedule.

    The mean torque is another attachment's, or with its control `InverterDrive`'s. Linear models have none of
    it; `jr.order_response` at `order p` has the response. Signals: `torque` (N·m). Source: the harmonics
    6k ± 1 of a six-pulse bridge's voltage against the fundamental flux (Krause, Wasynczuk & Sudhoff,
    Analysis of Electric Machinery and Drive Systems, ch. 13).
    """

    orders: Float[Array, " n"] = parameter(positive=True, shapes=((None,),))
    speeds: Float[Array, " m"] = parameter("rad/s", shapes=((None,),))
    amplitudes: Float[Array, "m n"] = parameter("N*m", shapes=((None, None),))
    phases: Float[Array, " n"] | None = parameter(
        "rad", shapes=((None,),), optional=True, default=None
    )
    connected: AbstractSchedule = eqx.field(
        converter=as_schedule, metadata={"drives": ""}, default=1.0
    )
    pole_pairs: int = option(whole(1, 1000), default=1)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m"}

    def faults(self) -> Iterator[str]:
        yield from table_faults(self.speeds, self.amplitudes, ("speeds", "amplitudes"), "rad/s")
        yield from unequal(self.orders, amplitudes=self.amplitudes, phases=self.phases)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return about_axis(self.torque(t, motions, state))

    def torque(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """N·m on the station."""
        ((q, v),) = motions
        amplitudes = interpolate(self.speeds, self.amplitudes, v[5])
        swing = waves(amplitudes, self.orders, self.phases, self.pole_pairs * q[5])
        return self.connected.value(t) * swing

    def times(self) -> Float[Array, " n"]:
        return self.connected.jumps()

    def looked_up(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, str]:
        return motions[0][1][5], self.speeds, "rad/s"

    def nominal(self) -> "TorqueRipple":
        """Nothing is left."""
        return eqx.tree_at(lambda r: r.amplitudes, self, jnp.zeros_like(self.amplitudes))
