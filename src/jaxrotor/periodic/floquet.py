"""Floquet multipliers: by what factors small deviations from a periodic motion grow in a period.

The variational equation is carried over the period by Magnus' series of sixth order with three Gauss points a
step (Blanes, Casas, Oteo & Ros, Phys. Rep. 470 (2009) 151): each step is one exponential, so that stiff and
fast modes cost no steps, and a motion whose Jacobian is constant has the eigenvalues of the linear model to
rounding. (Hill's method would need the true ones sorted out of 2 K + 1 times as many.)
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..machine.field import n_free
from ..machine.system import System
from .balance import slopes, states_of
from .waves import Waves

# Of the exponential: terms of its series, for norms up to a half, and doublings, for norms up to 2^40.
_TERMS, _DOUBLINGS = 14, 40


def monodromy(
    system: System, coefficients: Float[Array, "w m"], speed: Array, waves: Waves
) -> Float[Array, "d d"]:
    """What a deviation of the state y = (u, u', z) has become after the period."""
    steps = waves.samples
    width = 2 * np.pi * waves.turns / steps
    places = 0.5 + np.sqrt(15) / 10 * np.array([-1.0, 0.0, 1.0])
    angles = (width * (np.arange(steps)[:, None] + places)).ravel()
    y = states_of(coefficients, speed, n_free(system), waves.at(angles), waves)
    J = slopes(system, jnp.asarray(angles), y, speed)[1]
    h = width / jnp.abs(speed)
    # rates scaled to the size of what they are rates of, so that exponentials see numbers of a like size
    scale = _scale(system, J.shape[-1], speed)
    J = J * scale / scale[:, None]

    first, second, third = h * jnp.moveaxis(J.reshape(steps, 3, *J.shape[1:]), 1, 0)
    even, odd = second, np.sqrt(15) / 3 * (third - first)
    curve = 10 / 3 * (third - 2 * second + first)
    inner = _commutator(even, odd)
    outer = odd - _commutator(even, 2 * curve + inner) / 60
    exponents = even + curve / 12 + _commutator(inner - 20 * even - curve, outer) / 240

    def step(product, flow):
        return product + flow @ product, None

    product = jax.lax.scan(step, jnp.eye(J.shape[-1]), _flows(exponents))[0]
    return product / scale * scale[:, None]


def _commutator(a: Array, b: Array) -> Array:
    return a @ b - b @ a


def _flows(z: Float[Array, "s d d"]) -> Float[Array, "s d d"]:
    """e^z - 1 of each: by a Taylor series of a part of z, and doubling, e^2z - 1 = F (2 + F), which keeps the
    digits of slow modes."""
    norm = jnp.max(jnp.sum(jnp.abs(jax.lax.stop_gradient(z)), axis=-1))
    doublings = jnp.clip(jnp.ceil(jnp.log2(jnp.maximum(norm, 1e-300))) + 1, 0, _DOUBLINGS)
    small, eye = z * 2.0**-doublings, jnp.eye(z.shape[-1])

    def series(F, k):
        return small @ (eye + F) / k, None

    F = jax.lax.scan(series, jnp.zeros_like(z), jnp.arange(float(_TERMS), 0.0, -1.0))[0]

    def double(F, i):
        return jax.lax.cond(i < doublings, lambda: 2 * F + F @ F, lambda: F), None

    return jax.lax.scan(double, F, jnp.arange(float(_DOUBLINGS)))[0]


def _scale(system: System, d: int, speed: Array) -> Float[Array, " d"]:
    n = n_free(system)
    return jnp.ones(d).at[n : 2 * n].set(jnp.abs(speed))
