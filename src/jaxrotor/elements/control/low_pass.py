"""The filter that measured values go through: Butterworth's low-pass of second order."""

import jax.numpy as jnp
from jaxtyping import Array, Float

Values = Float[Array, " k"]


def low_pass_rates(
    cutoff: Float[Array, ""], raw: Values, seen: Values, rate: Values
) -> tuple[Values, Values]:
    """Time derivatives of both states, `seen`, which is what comes out, and `rate`; `cutoff` in Hz."""
    w = 2 * jnp.pi * cutoff
    # the second state is the rate over w: of the size of what is seen
    return w * rate, w * (raw - seen) - jnp.sqrt(2.0) * w * rate
