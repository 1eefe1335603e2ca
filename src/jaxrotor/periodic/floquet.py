"""Floquet multipliers: by what factors small deviations from a periodic motion grow in a period.

The variational equation is carried over the period by Magnus' series of sixth order with three Gauss points a
step (Blanes, Casas, Oteo & Ros, Phys. Rep. 470 (2009) 151): each step is one exponential, so that stiff and
fast modes cost no steps, and a motion whose Jacobian is constant has the eigenvalues of the linear model to
rounding. Where stiff forces vary, as in films, the series' commutators are large and wrong: such steps go by
the commutator-free method of fourth order, two exponentials (Blanes & Moan, Appl. Numer. Math. 56 (2006)
1519). (Hill's method would need the true ones sorted out of 2 K + 1 times as many.)
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..machine.field import n_free
from ..machine.system import System
from .balance import slopes, states_of
from .waves import Waves

# Of the exponential: doublings, for norms up to 2^40; steps by which its rows and columns are balanced.
_DOUBLINGS, _BALANCING = 40, 40
# Of the commutators in a step's exponent, up to which the series holds.
_TURNED = 1e-2
# Where in a step Gauss's points are.
_GAUSS = 0.5 + np.sqrt(15) / 10 * np.array([-1.0, 0.0, 1.0])


def monodromy(
    system: System, coefficients: Float[Array, "w m"], speed: Array, waves: Waves
) -> Float[Array, "d d"]:
    """What a deviation of the state y = (u, u', z) has become after the period."""
    steps = waves.samples
    width = 2 * np.pi * waves.turns / steps
    angles = (width * (np.arange(steps)[:, None] + _GAUSS)).ravel()
    y = states_of(coefficients, speed, n_free(system), waves.at(angles), waves)
    J = slopes(system, jnp.asarray(angles), y, speed)[1]
    scale = _scale(jnp.mean(jnp.abs(J), axis=0))
    J = J * scale / scale[:, None]

    h = width / jnp.abs(speed)
    first, second, third = h * jnp.moveaxis(J.reshape(steps, 3, *J.shape[1:]), 1, 0)
    even, odd = second, np.sqrt(15) / 3 * (third - first)
    curve = 10 / 3 * (third - 2 * second + first)
    inner = _commutator(even, odd)
    outer = odd - _commutator(even, 2 * curve + inner) / 60
    mean = even + curve / 12
    turned = _commutator(inner - 20 * even - curve, outer) / 240
    # where stiff forces vary the series' commutators are no small numbers: without them by two exponentials
    small = jnp.max(jnp.sum(jnp.abs(turned), axis=-1), axis=-1) < _TURNED
    first, second = _flows(0.5 * mean - odd / 6), _flows(0.5 * mean + odd / 6)
    apart = first + second + second @ first
    once = _flows(mean + jnp.where(small[:, None, None], turned, 0.0))
    flows = jnp.where(small[:, None, None], once, apart)

    def step(product, flow):
        return product + flow @ product, None

    product = jax.lax.scan(step, jnp.eye(J.shape[-1]), flows)[0]
    return product / scale * scale[:, None]


def _commutator(a: Array, b: Array) -> Array:
    return a @ b - b @ a


def _flows(z: Float[Array, "s d d"]) -> Float[Array, "s d d"]:
    """e^z - 1 of each: by a Taylor series of a part of z, in six products (Paterson & Stockmeyer, SIAM J.
    Comput. 2 (1973) 60), and doubling, e^2z - 1 = F (2 + F), which keeps the digits of slow modes."""
    norm = jnp.max(jnp.sum(jnp.abs(jax.lax.stop_gradient(z)), axis=-1))
    doublings = jnp.clip(jnp.ceil(jnp.log2(jnp.maximum(norm, 1e-300))), 0, _DOUBLINGS)
    one = z * 2.0**-doublings
    two = one @ one
    three, four = two @ one, two @ two
    eye = np.eye(z.shape[-1])
    share = 1.0 / np.cumprod(np.arange(1.0, 17.0))  # of the powers from the first

    F = share[15] * four
    for k in (12, 8, 4):
        part = share[k - 1] * eye + share[k] * one + share[k + 1] * two + share[k + 2] * three
        F = four @ (F + part)
    F = F + one + share[1] * two + share[2] * three

    def double(F, i):
        return jax.lax.cond(i < doublings, lambda: 2 * F + F @ F, lambda: F), None

    return jax.lax.scan(double, F, jnp.arange(float(_DOUBLINGS)))[0]


def _scale(J: Float[Array, "d d"]) -> Float[Array, " d"]:
    """Sizes of the coordinates of the state by which rows and columns are alike (Osborne, J. ACM 7 (1960)
    338): then exponentials have the norm of the fastest mode's rate, and few doublings."""
    size = jnp.abs(jax.lax.stop_gradient(J)) * (1 - np.eye(len(J)))

    def better(scale, _):
        own = size * scale / scale[:, None]
        along, down = own.sum(axis=1), own.sum(axis=0)
        known = (along > 0) & (down > 0)
        ratio = jnp.where(known, along, 1.0) / jnp.where(known, down, 1.0)
        return scale * ratio**0.25, None

    return jax.lax.scan(better, jnp.ones(len(J)), None, length=_BALANCING)[0]
