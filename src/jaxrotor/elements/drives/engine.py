"""Torque of a piston engine."""

from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Motion, Nominal, Timed, Vec6
from ...profiles.schedule import AbstractSchedule, as_schedule
from .load import about_axis


class EngineTorque(AbstractAttachment, Timed, Nominal):
    """Gas torque as a harmonic series of the crank angle, N·m, positive in the sense of phi.

    `throttle (mean + sum amplitude cos(order phi + phase))`, where phi is the angle of its station.
    `orders` count the periods in a turn of the crank: halves for a four-stroke engine; `phases` in
    rad, zero where left out. `throttle` is a number or a schedule. Source: Ker Wilson, Practical
    Solution of Torsional Vibration Problems, vol. 2 (tables of harmonic components).
    """

    mean: Float[Array, ""] = parameter("N*m")
    orders: Float[Array, " n"] = parameter(positive=True, shapes=((None,),))
    amplitudes: Float[Array, " n"] = parameter("N*m", shapes=((None,),))
    phases: Float[Array, " n"] | None = parameter(
        "rad", shapes=((None,),), optional=True, default=None
    )
    throttle: AbstractSchedule = eqx.field(
        converter=as_schedule, metadata={"drives": ""}, default=1.0
    )

    def faults(self) -> Iterator[str]:
        phases = self.orders if self.phases is None else self.phases
        sizes = [x.shape[0] for x in (self.orders, self.amplitudes, phases)]
        if len(set(sizes)) > 1:
            yield (
                f"orders, amplitudes and phases must be equally long, but have {sizes[0]}, "
                f"{sizes[1]} and {sizes[2]} entries"
            )

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        ((q, _),) = motions
        phases = 0.0 if self.phases is None else self.phases
        waves = jnp.sum(self.amplitudes * jnp.cos(self.orders * q[5] + phases))
        return about_axis(self.throttle.value(t) * (self.mean + waves))

    def times(self) -> Float[Array, " n"]:
        return self.throttle.jumps()

    def nominal(self) -> "EngineTorque":
        """The mean torque alone: the harmonics turn with the crank."""
        return eqx.tree_at(lambda e: e.amplitudes, self, jnp.zeros_like(self.amplitudes))
