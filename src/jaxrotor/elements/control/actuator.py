"""What stands between a wanted torque and the shaft."""

from collections.abc import Iterator

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import whole
from ...core.parameter import parameter
from ...core.part import Part, option
from .delay import delay_rates, delayed

States = Float[Array, " k"]


def soft_clip(x: Array, width: float | Array) -> Array:
    """x held within -1 and 1, which it never passes; the corner is rounded over some `width`."""

    def corner(a):
        return jnp.logaddexp(a, -a)

    return 0.5 * width * (corner((x + 1) / width) - corner((x - 1) / width))


class Actuator(Part):
    """A torque actuator: delay, then limit, then lag with a limited rate. What is left out is ideal.

    **Arguments:**

    - `limit`: the largest torque, N·m.
    - `bandwidth`: 1/s, of its first-order lag.
    - `rate_limit`: the fastest change of torque, N·m/s; needs a `bandwidth`.
    - `delay`: s, as a Padé approximant of order `pade` whose numerator is one degree lower: nothing comes
      through at once. A loop that samples and holds is `SampledTorque`.
    - `softness`: limits are rounded over this part of them, so that they have derivatives and leave the
      solver its order; the torque stays below the limit.

    Source of the approximant: Vajta, Some remarks on Padé-approximations, 3rd TEMPUS-INTCOM Symp. (2000).
    """

    limit: Float[Array, ""] | None = parameter("N*m", positive=True, optional=True, default=None)
    bandwidth: Float[Array, ""] | None = parameter(
        "1/s", positive=True, optional=True, default=None
    )
    rate_limit: Float[Array, ""] | None = parameter(
        "N*m/s", positive=True, optional=True, default=None
    )
    delay: Float[Array, ""] | None = parameter("s", positive=True, optional=True, default=None)
    softness: Float[Array, ""] = parameter(positive=True, default=0.1, label="part of the limits")
    pade: int = option(whole(2, 8), default=3)

    def faults(self) -> Iterator[str]:
        if self.rate_limit is not None and self.bandwidth is None:
            yield "bandwidth is missing: a rate_limit needs one: give the lag of the actuator in 1/s"

    def initial(self) -> States:
        return jnp.zeros(self._delayed() + (self.bandwidth is not None))

    def _delayed(self) -> int:
        return 0 if self.delay is None else self.pade

    def torque(self, wanted: Array, state: States) -> Float[Array, ""]:
        """What reaches the shaft, N·m."""
        if self.bandwidth is not None:
            return state[-1]
        return self.limited(self._late(wanted, state))

    def rates(self, wanted: Array, state: States) -> States:
        n = self._delayed()
        parts = [jnp.zeros(0)]
        if self.delay is not None:
            parts.append(delay_rates(wanted, state[:n], self.delay))
        if self.bandwidth is not None:
            change = self.bandwidth * (self.limited(self._late(wanted, state)) - state[-1])
            if self.rate_limit is not None:
                change = self.rate_limit * soft_clip(change / self.rate_limit, self.softness)
            parts.append(change[None])
        return jnp.concatenate(parts)

    def limited(self, wanted: Array) -> Float[Array, ""]:
        if self.limit is None:
            return wanted
        return self.limit * soft_clip(wanted / self.limit, self.softness)

    def _late(self, wanted: Array, state: States) -> Array:
        if self.delay is None:
            return wanted
        return delayed(state[: self.pade])
