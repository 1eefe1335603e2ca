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
from .picked_slopes import columns_of, in_place, picked_slopes
from .waves import Waves

# Of the exponential: doublings, for norms up to 2^40; steps by which its rows and columns are balanced.
_DOUBLINGS, _BALANCING = 40, 40
# Where in a step Gauss's points are.
_GAUSS = 0.5 + np.sqrt(15) / 10 * np.array([-1.0, 0.0, 1.0])
# Steps for each order, and orders per turn of what varies with the tilts.
_PER_ORDER, _SMOOTH = 8, 7


def monodromy(
    system: System,
    coefficients: Float[Array, "w m"],
    speed: Array,
    waves: Waves,
    touched: tuple[int, ...] | None = None,
) -> Float[Array, "d d"]:
    """What a deviation of the state y = (u, u', z) has become after the period. `touched`: the unknowns that
    laws touch, where the others' columns of the Jacobian are known by their orders (`_by_parts`)."""
    at = system, coefficients, speed, waves
    found = _of_each(*at) if touched is None else _by_parts(*at, touched)
    steps, _, d = found[0].shape
    h = 2 * np.pi * waves.turns / steps / jnp.abs(speed)
    scale = _scale(jnp.mean(jnp.abs(found[0]), axis=0))
    even, odd, curve = (h * x * scale / scale[:, None] for x in found)
    inner = _commutator(even, odd)
    outer = odd - _commutator(even, 2 * curve + inner) / 60
    exponents = even + curve / 12 + _commutator(inner - 20 * even - curve, outer) / 240

    def step(product, flow):
        return product + flow @ product, None

    product = jax.lax.scan(step, jnp.eye(d), _flows(exponents))[0]
    return product / scale * scale[:, None]


def _of_each(
    system: System, coefficients: Array, speed: Array, waves: Waves
) -> tuple[Array, Array, Array]:
    """Of the Jacobian in each step (steps, d, d): value in the middle, slope and curve."""
    steps = waves.samples
    angles = _gauss_angles(waves)
    y = states_of(coefficients, speed, n_free(system), waves.at(angles), waves)
    J = slopes(system, jnp.asarray(angles), y, speed)[1]
    first, second, third = jnp.moveaxis(J.reshape(steps, 3, *J.shape[1:]), 1, 0)
    return second, np.sqrt(15) / 3 * (third - first), 10 / 3 * (third - 2 * second + first)


def _by_parts(
    system: System, coefficients: Array, speed: Array, waves: Waves, touched: tuple[int, ...]
) -> tuple[Array, Array, Array]:
    """The same, where laws touch few coordinates. Columns by these are looked at in three instants between
    any two samples; by the others, which vary with the tilts alone, in so few that their own orders come out.
    Steps are no more than smooth motions need: within one, edges of contacts count by their moments."""
    n, m, d = n_free(system), coefficients.shape[1], n_free(system) + coefficients.shape[1]
    mine, rest = columns_of(n, m, touched)
    smooth = Waves(min(waves.harmonics, _SMOOTH), waves.turns, 0)
    smooth = smooth._replace(samples=smooth.count)
    gauss = _gauss_angles(waves)
    angles = np.concatenate([gauss, smooth.angles])
    y = states_of(coefficients, speed, n, waves.at(angles), waves)
    many, few = np.arange(gauss.size), gauss.size + np.arange(smooth.samples)
    instants = np.concatenate([np.tile(many, mine.size), np.repeat(few, rest.size)])
    columns = np.concatenate([np.repeat(mine, gauss.size), np.tile(rest, smooth.samples)])
    state = jnp.asarray(angles), y, speed
    found = picked_slopes(system, state, (instants, columns), size=waves.samples)[1][:, n:]
    own = found[: mine.size * gauss.size].reshape(mine.size, gauss.size, m)
    others = found[mine.size * gauss.size :].reshape(smooth.samples, rest.size, m)

    each = _in_a_step(waves)
    steps, rule = waves.samples // each, _moments(each)
    own = jnp.einsum("qg,csgm->qsmc", rule, own.reshape(mine.size, steps, 3 * each, m))
    between = smooth.at(gauss) @ smooth.from_samples
    between = np.einsum("qg,sgf->qsf", rule, between.reshape(steps, 3 * each, -1))
    others = jnp.einsum("qsf,fcm->qsmc", between, others)
    lower = in_place((own, others), (mine, rest))
    upper = np.zeros((3, steps, n, d))
    upper[0][:, np.arange(n), n + np.arange(n)] = 1.0
    even, odd, curve = jnp.concatenate([jnp.asarray(upper), lower], axis=2)
    return even, odd, curve


def _gauss_angles(waves: Waves) -> np.ndarray:
    """Three between any two samples."""
    steps = waves.samples
    width = 2 * np.pi * waves.turns / steps
    return (width * (np.arange(steps)[:, None] + _GAUSS)).ravel()


def _in_a_step(waves: Waves) -> int:
    """How many intervals between samples a step takes, of those that divide them."""
    most = waves.samples // (_PER_ORDER * waves.harmonics * waves.turns)
    return max(q for q in range(1, max(most, 1) + 1) if waves.samples % q == 0)


def _moments(each: int) -> Float[np.ndarray, "3 g"]:
    """Of values at Gauss's points of so many intervals in a step from -1/2 to 1/2: the parabola (value,
    slope, curve) that has the same moments up to the second."""
    x = ((np.arange(each)[:, None] + _GAUSS) / each - 0.5).ravel()
    weight = np.tile([5.0, 8.0, 5.0], each) / 18 / each
    zeroth, first, second = weight, weight * x, weight * x**2
    return np.stack([2.25 * zeroth - 15 * second, 12 * first, 180 * second - 15 * zeroth])


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
