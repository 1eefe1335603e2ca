"""Friction clutches: what they carry is their capacity times an engagement between 0 and 1."""

from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import NonSmooth
from ...profiles.schedule import AbstractSchedule, as_schedule
from ..laws.law import AbstractLaw, Scalar, States


class CoulombClutch(AbstractLaw, NonSmooth):
    """Coulomb friction, smoothed: `capacity engagement(t) tanh(v/slip_speed)`.

    It never sticks: below its capacity it creeps at about `slip_speed` times the share of capacity.
    """

    capacity: Scalar = parameter("N*m", nonnegative=True)
    engagement: AbstractSchedule = eqx.field(
        converter=as_schedule, default=1.0, metadata={"drives": ""}
    )
    slip_speed: Scalar = parameter("rad/s", positive=True, default=0.1)

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        return self.capacity * self.engagement.value(t) * jnp.tanh(v / self.slip_speed)

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        return jnp.zeros_like(x)

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        carried = self.capacity * self.engagement.value(t)
        decay = -2 * jnp.abs(v) / self.slip_speed
        return carried * jnp.abs(v) * -jnp.expm1(decay) / (1 + jnp.exp(decay))

    def times(self) -> Float[Array, " n"]:
        return self.engagement.jumps()


class StickSlipClutch(AbstractLaw, NonSmooth):
    """Friction that sticks: bristles that bend by `slip_angle` and then slip.

    `torque = engagement(t) (capacity z/slip_angle + damping z')`, and `z' = v (1 - a z/slip_angle)`
    while the bristles are bent further; a grows from 0 at `elastic_share` of capacity to 1 at
    capacity. Below that share, and when they unbend, they are elastic (z' = v): the clutch holds any
    vibration there without creeping, as Dahl's and LuGre's bristles (a = 1) do not.

    Stored is `engagement capacity z²/(2 slip_angle)`. A growing engagement presses stiffness onto
    bent bristles, and what that stores is counted in `power_lost`, with its sign. A jump of engagement
    frees (or gives) energy at once, which no power accounts for: schedule it smoothly for an energy
    audit. Source: Dupont, Hayward, Armstrong & Altpeter, IEEE Trans. Autom. Control 47 (2002) 787.
    """

    capacity: Scalar = parameter("N*m", nonnegative=True)
    slip_angle: Scalar = parameter("rad", positive=True)
    engagement: AbstractSchedule = eqx.field(
        converter=as_schedule, default=1.0, metadata={"drives": ""}
    )
    damping: Scalar = parameter("N*m*s/rad", nonnegative=True, default=0.0)
    elastic_share: Scalar = parameter(nonnegative=True, default=0.9)

    def faults(self) -> Iterator[str]:
        if float(self.elastic_share) >= 1:
            yield f"elastic_share must be below 1, but is {float(self.elastic_share):g}"

    def initial(self) -> States:
        return jnp.zeros(1)

    def _slipping(self, v, state: Any) -> Scalar:
        """The part of v that does not bend the bristles: between 0 and 1 up to capacity."""
        bent = jnp.abs(state[0]) / self.slip_angle
        s = jnp.clip((bent - self.elastic_share) / (1 - self.elastic_share), 0.0, 1.0)
        return jnp.where(v * state[0] > 0, s**2 * (3 - 2 * s) * bent, 0.0)

    def rates(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> States:
        return (v * (1 - self._slipping(v, state)))[None]

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        bent = self.capacity * state[0] / self.slip_angle
        damped = self.damping * self.rates(t, x, v, state)[0]
        return self.engagement.value(t) * (bent + damped)

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        stiffness = self.capacity / self.slip_angle
        return 0.5 * self.engagement.value(t) * stiffness * state[0] ** 2

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        t = jnp.asarray(t, float)
        pressed, pressing = jax.jvp(self.engagement.value, (t,), (jnp.ones_like(t),))
        stiffness, slip = self.capacity / self.slip_angle, self._slipping(v, state)
        friction = stiffness * state[0] * v * slip + self.damping * v**2 * (1 - slip)
        return pressed * friction - 0.5 * pressing * stiffness * state[0] ** 2

    def times(self) -> Float[Array, " n"]:
        return self.engagement.jumps()
