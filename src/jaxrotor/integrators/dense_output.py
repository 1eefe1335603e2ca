"""The samples within a step: by the same mix that N is taken for in the step, integrated exactly.

Where steps span samples the state is carried from sample to sample, `y(t + h/n) = e^(hA/n) y + ∫ ...`, by one
set of weights for all of them: those of steps as short, which a start needs too. So a mode that rings many
times in a step is seen ringing, and a sample is as good as the end of a step. None of it evaluates the field.
"""

from collections.abc import Sequence
from math import factorial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .fitted_weights import MORE, Moments, Parts
from .phi import turning_powers

# Powers of time that N is taken for from one sample to the next, through as many of Gauss's points: exact to
# twice as many in what is smooth, in which no more than half a radian passes.
_POWERS = 4


class Within(eqx.Module):
    """Of one linearisation, or stacked in front; of each part of the state. `flow`: e^(hA/n); `push`: acts on
    the coefficients of N's powers, m of each."""

    flow: tuple[Float[Array, "d d"], ...]
    push: tuple[Float[Array, "d pm"], ...]

    @classmethod
    def of(cls, short: Sequence[Moments]) -> "Within":
        """By the moments of steps from sample to sample."""
        push = []
        for own in short:
            mean = own.mean[..., :_POWERS, :, :].swapaxes(-3, -2)
            push.append(mean.reshape(*mean.shape[:-2], -1))
        return cls(tuple(own.flow for own in short), tuple(push))


def powers_between(near: Float[Array, ""], order: int, span: int) -> Float[Array, "n p q"]:
    """From each sample in a step to the next: the coefficients of the powers s^i/i!, s from 0 to 1, of the
    functions that weights are mixed from (`fitted_mix`)."""
    node = 0.5 * (np.polynomial.legendre.leggauss(_POWERS)[0] + 1.0)
    at = (np.arange(span)[:, None] + node) / span
    count = order + MORE
    plain = np.stack([at**i / factorial(i) for i in range(count - 2)])
    values = jnp.concatenate([plain, turning_powers(at, near, count - 2, 2)])
    through = np.linalg.inv(np.stack([node**i / factorial(i) for i in range(_POWERS)], axis=1))
    return jnp.einsum("pi,qni->npq", through, values)


def samples_within(
    own: Within,
    parts: Parts,
    coefficients: Float[Array, "n p k+1"],
    begin: Float[Array, "l d"],
    N: Float[Array, "l+k m"],
) -> Float[Array, "l n-1 d"]:
    """The states at the samples within l steps, from where they `begin`. `N`: at their ends and the k points
    before, oldest first; `coefficients` of the powers by the value at a step's end and those before."""
    steps, past = begin.shape[0], N.shape[0] - begin.shape[0]
    windows = jnp.stack([N[i : i + steps] for i in range(past, -1, -1)])
    forced = jnp.einsum("npk,klm->nlpm", coefficients[:-1], windows)
    found = []
    for flow, push, rows, with_N in zip(own.flow, own.push, parts.rows, parts.with_N):
        pushed = forced[..., np.asarray(with_N, int)]
        pushed = pushed.reshape(*pushed.shape[:2], -1) @ push.T

        def ahead(y, more, flow=flow):
            y = y @ flow.T + more
            return y, y

        found.append(jax.lax.scan(ahead, begin[:, np.asarray(rows, int)], pushed)[1])
    order = np.argsort(np.concatenate(parts.rows))
    return jnp.moveaxis(jnp.concatenate(found, axis=-1)[..., order], 0, 1)
