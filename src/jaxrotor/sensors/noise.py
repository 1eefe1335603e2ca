"""Noise of measurement chains."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from ..core.parameter import parameter
from ..core.part import Part
from ..core.quick import lightly_compiled


class Noise(Part):
    """Gaussian noise, and the steps of a converter.

    **Arguments:** (in the unit of the channel)

    - `std`: standard deviation.
    - `correlation_time`: s, after which the correlation of the noise has fallen to 1/e; 0 is white.
    - `quantum`: step of the analog-digital converter; 0 is none.
    """

    std: Float[Array, ""] = parameter(nonnegative=True, label="standard deviation")
    correlation_time: Float[Array, ""] = parameter("s", nonnegative=True, default=0.0)
    quantum: Float[Array, ""] = parameter(
        nonnegative=True, default=0.0, label="step of the converter"
    )

    def added(
        self, key: PRNGKeyArray, values: Float[Array, " nt"], interval: Array
    ) -> Float[Array, " nt"]:
        """`values`, sampled every `interval` s, with noise of this kind; the key makes it repeatable."""
        return self._added(key, jnp.asarray(values), jnp.asarray(interval))

    @lightly_compiled
    def _added(self, key, values, interval) -> Array:
        white = jax.random.normal(key, values.shape)
        slow = self.correlation_time > 0
        decay = jnp.where(
            slow, jnp.exp(-interval / jnp.where(slow, self.correlation_time, 1.0)), 0.0
        )

        def step(before, fresh):
            now = decay * before + jnp.sqrt(1 - decay**2) * fresh
            return now, now

        _, coloured = jax.lax.scan(step, white[0], white[1:])
        noisy = values + self.std * jnp.concatenate([white[:1], coloured])
        step_size = jnp.where(self.quantum > 0, self.quantum, 1.0)
        return jnp.where(self.quantum > 0, jnp.round(noisy / step_size) * step_size, noisy)
