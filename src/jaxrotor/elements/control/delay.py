"""A delay as a few states: Padé's approximant, whose numerator is one degree lower than its denominator."""

from math import factorial

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

States = Float[Array, " k"]


def delayed(state: States) -> Float[Array, ""]:
    """What comes out of the delay: nothing goes through at once."""
    return jnp.asarray(approximant(state.shape[0])[0]) @ state


def delay_rates(entering: Array, state: States, delay: Array) -> States:
    """Time derivatives of the states; `delay` in s."""
    _, low = approximant(state.shape[0])
    last = (entering - low[:-1] @ state) / low[-1]
    return jnp.concatenate([state[1:], last[None]]) / delay


def approximant(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of x^k = (delay s)^k of exp(-x): numerator of degree n - 1 (n entries), denominator n."""
    m = n - 1

    def row(degree, sign):
        return np.array(
            [
                sign**k * factorial(m + n - k) * factorial(degree)
                / (factorial(m + n) * factorial(k) * factorial(degree - k))
                for k in range(degree + 1)
            ]
        )  # fmt: skip

    return row(m, -1.0), row(n, 1.0)
