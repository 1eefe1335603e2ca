"""Low-pass filters and values between samples, differentiable."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.quick import lightly_compiled

_NODES = 8  # points of the polynomial between samples
# Corrections of a value's place between samples; where it grows evenly the first is exact.
_CORRECTIONS = 5


@lightly_compiled
def between(
    values: Float[Array, " nt"], first: Array, interval: Array, times: Float[Array, " m"]
) -> Float[Array, " m"]:
    """`values`, sampled from `first` every `interval` s, at other `times` (s): polynomials of degree 7
    through the neighbours. With 10 samples a period they are right to 1e-6. NaN outside."""
    n = min(_NODES, values.shape[0])
    place = (times - first) / interval
    # a place between samples within rounding of one of them counts as that
    at = jnp.clip(
        jnp.floor(jax.lax.stop_gradient(place)).astype(int) - (n // 2 - 1), 0, values.shape[0] - n
    )
    u = place - at
    weights = []
    for j in range(n):
        others = np.array([k for k in range(n) if k != j])
        weights.append(jnp.prod((u[:, None] - others) / (j - others), axis=1))
    found = jnp.sum(jnp.stack(weights, axis=1) * values[at[:, None] + np.arange(n)], axis=1)
    slack = 1e-6
    inside = (place >= -slack) & (place <= values.shape[0] - 1 + slack)
    return jnp.where(inside, found, jnp.nan)


def low_pass(
    values: Float[Array, " nt"], interval: Array, cutoff: Array, order: int
) -> Float[Array, " nt"]:
    """Butterworth low-pass of `order` with its -3 dB at `cutoff` (Hz), started from rest at the first
    value. Exact for a signal that is straight between samples (first-order hold)."""
    import scipy.signal  # takes as long to load as all the rest of a check

    polynomials: Any = scipy.signal.butter(order, 1.0, analog=True)
    A, B, C, _ = scipy.signal.tf2ss(*polynomials)
    s = 2 * jnp.pi * cutoff * interval  # the filter's own time per sample
    n = order
    # states, input and its slope in one exponential (Van Loan)
    block = jnp.zeros((n + 2, n + 2))
    block = block.at[:n, :n].set(A * s).at[:n, n].set(B[:, 0] * s).at[n, n + 1].set(1.0)
    big = jax.scipy.linalg.expm(block)
    F, G, H = big[:n, :n], big[:n, n], big[:n, n + 1]
    start = -np.linalg.solve(A, B[:, 0]) * values[0]

    def step(x, pair):
        u, u_next = pair
        x = F @ x + G * u + H * (u_next - u)
        return x, C[0] @ x

    _, rest = jax.lax.scan(step, start, (values[:-1], values[1:]))
    return jnp.concatenate([(C[0] @ start)[None], rest])


def places(turned: Array, marks: Array, last: Array) -> Array:
    """Where `turned`, which rises, has the values `marks`: in samples, `last` the last of them."""
    after = jnp.clip(jnp.searchsorted(turned, marks), 1, last)
    low, high = turned[after - 1], turned[after]
    step = jax.lax.stop_gradient(jnp.where(high > low, high - low, 1.0))
    place = after - 1 + (marks - low) / step
    for _ in range(_CORRECTIONS):
        place = jnp.clip(jax.lax.stop_gradient(place), after - 1, after)
        here = between(turned, jnp.zeros(()), jnp.ones(()), place)
        place = place + (marks - here) / step
    return place
