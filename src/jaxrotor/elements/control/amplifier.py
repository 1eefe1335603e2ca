"""The amplifier of a magnetic bearing: from the current that is wanted to the one that flows."""

from collections.abc import Iterator

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import whole
from ...core.parameter import parameter
from ...core.part import Part, option
from .actuator import soft_clip
from .delay import delay_rates, delayed

Scalar = Float[Array, ""]
States = Float[Array, " k"]


class CurrentAmplifier(Part):
    """Delay, then limit, then lag with a limited rate, of the control current. What is left out is ideal.

    - `limit`: the largest control current, A; by default the bias current, which no coil's current then
      reverses.
    - `bandwidth`: Hz, of the first-order lag of the current's control.
    - `voltage`: V, the most that drives a change of current: `voltage/inductance` A/s at the most, with the
      magnet's inductance in the middle; needs a `bandwidth`. The coil's resistance, and what motion induces,
      are taken for small against it.
    - `delay`: s, of a digital controller, as a Padé approximant of order `pade` (Vajta, 3rd TEMPUS-INTCOM
      Symp. (2000)).
    - `softness`: limits are rounded over this part of them, so that they have derivatives.

    Source: Schweitzer & Maslen (eds.), Magnetic Bearings (2009), ch. 4 (power bandwidth).
    """

    limit: Scalar | None = parameter("A", positive=True, optional=True, default=None)
    bandwidth: Scalar | None = parameter("Hz", positive=True, optional=True, default=None)
    voltage: Scalar | None = parameter("V", positive=True, optional=True, default=None)
    delay: Scalar | None = parameter("s", positive=True, optional=True, default=None)
    softness: Scalar = parameter(positive=True, default=0.05, label="part of the limits")
    pade: int = option(whole(2, 8), default=3)

    def faults(self) -> Iterator[str]:
        if self.voltage is not None and self.bandwidth is None:
            yield "bandwidth is missing: a voltage needs one: give the lag of the current's control in Hz"

    def _waiting(self) -> int:
        return 0 if self.delay is None else self.pade

    def initial(self) -> States:
        return jnp.zeros(self._waiting() + (self.bandwidth is not None))

    def limited(self, wanted: Scalar, limit: Scalar | None) -> Scalar:
        """`limit`: A, none where it is `None`."""
        return wanted if limit is None else limit * soft_clip(wanted / limit, self.softness)

    def current(self, wanted: Scalar, state: States, limit: Scalar | None) -> Scalar:
        """What flows, A."""
        if self.bandwidth is not None:
            return state[-1]
        return self.limited(self._late(wanted, state), limit)

    def rates(
        self, wanted: Scalar, state: States, limit: Scalar | None, inductance: Array
    ) -> States:
        """`inductance`: H, of a coil."""
        n = self._waiting()
        parts = [jnp.zeros(0)]
        if self.delay is not None:
            parts.append(delay_rates(wanted, state[:n], self.delay))
        if self.bandwidth is not None:
            given = self.limited(self._late(wanted, state), limit)
            change = 2 * jnp.pi * self.bandwidth * (given - state[-1])
            if self.voltage is not None:
                change = self.limited(change, self.voltage / inductance)
            parts.append(change[None])
        return jnp.concatenate(parts)

    def _late(self, wanted: Scalar, state: States) -> Scalar:
        return wanted if self.delay is None else delayed(state[: self.pade])
