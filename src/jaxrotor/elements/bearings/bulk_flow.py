"""Turbulent flow of a liquid through a narrow gap, averaged over its height, and what it does to a rotor that
whirls in the middle of it.

With w along the seal and u around it, h the height of the gap and R its radius, at both walls Fanning's
friction factor `f = n (2 h V/nu)^m` of the velocity V against that wall (the stator's V_s, the rotor's V_r):

    dh/dt + d(h w)/dz + d(h u)/(R dtheta) = 0
    Dw/Dt = -(1/rho) dp/dz - (f_s V_s w + f_r V_r w) / (2 h)
    Du/Dt = -(1/rho) dp/(R dtheta) - (f_s V_s u + f_r V_r (u - R Omega)) / (2 h)
    p(0) = p_supply - (1 + inlet_loss) rho w²/2,  u(0) = preswirl R Omega,
    p(L) = p_sump - exit_recovery rho w²/2

A whirl of small amplitude, `x + i y = r exp(i f t)`, makes `h = clearance - Re(r exp(i (f t - theta)))` and
everything of first order as `Re(... r exp(i (f t - theta)))`: a linear boundary value problem along z, whose
pressure gives `-F/r = K + f c - f² M + i (f C - k + f² m)`, fitted at five frequencies of the whirl.

Sources: Childs, J. Lubr. Tech. 105 (1983) 429 (short seals) and 437 (finite length); Hirs, J. Lubr. Tech. 95
(1973) 137; Black & Jenssen, ASME 71-WA/FE-38 (1971); Childs, Turbomachinery Rotordynamics (1993), ch. 4.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Steps of Runge and Kutta's along the seal, and Newton's for the flow (four do).
_STEPS = 24
# Of each stage: how far ahead by the slope before, its weight, whether the step ends.
_STAGES = ((0.0, 1 / 6, 0.0), (0.5, 1 / 3, 0.0), (0.5, 1 / 3, 0.0), (1.0, 1 / 6, 1.0))
_NEWTON = 6
# Frequencies of the whirl over the speed (Childs 1983), and the least, over what passes the seal in a second.
_WHIRLS = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
_LEAST = 1e-3


class Gap(NamedTuple):
    """A seal at one speed; SI. `drop`: of the pressure, over the density; `speed`: of the rotor, rad/s;
    `stator`, `rotor`: n and m of the friction."""

    radius: Array
    length: Array
    clearance: Array
    density: Array
    viscosity: Array  # kinematic
    inlet_loss: Array
    exit_recovery: Array
    preswirl: Array
    stator: Float[Array, "2"]
    rotor: Float[Array, "2"]
    drop: Array
    speed: Array


class Coefficients(NamedTuple):
    """`-F = [[K, k], [-k, K]] q + [[C, c], [-c, C]] v + [[M, m], [-m, M]] a`."""

    K: Array
    k: Array
    C: Array
    c: Array
    M: Array
    m: Array


def finite_flow(gap: Gap) -> Array:
    """Axial velocity, m/s."""

    def resistance(w: Array) -> Array:
        def rate(u: Array) -> tuple[Array, Array]:
            axial, around = _friction(gap, w, u, gap.clearance)
            return -around / w, axial

        start = gap.preswirl * gap.radius * gap.speed, jnp.zeros_like(w)
        along = _along(gap, lambda state: rate(state[0]), start)
        return along[1] + 0.5 * (1 + gap.inlet_loss - gap.exit_recovery) * w**2

    return _root(gap, resistance)


def finite_coefficients(gap: Gap, w: Array) -> Coefficients:
    """By the perturbed flow along the whole seal at the axial velocity `w`."""
    R, C, speed = gap.radius, gap.clearance, gap.speed
    least = _LEAST * w / gap.length
    whirls = jnp.where(speed < 0, -1.0, 1.0) * jnp.sqrt(speed**2 + least**2) * _WHIRLS
    # two solutions at a time: of the gap's change, with no change of w at the inlet; of the latter alone
    gaps, inlet = jnp.array([[-1.0], [0.0]]), jnp.array([[0.0], [1.0]])

    def rate(state):
        u, w1, u1, p1, _ = state
        _, around = _friction(gap, w, u, C)
        slopes = jax.jacfwd(_friction, argnums=(1, 2, 3))(gap, w, u, C)
        axial1, around1 = (by[0] * w1 + by[1] * u1 + by[2] * gaps for by in slopes)
        seen = 1j * (whirls - u / R)
        w1_z = 1j * u1 / R - seen * gaps / C
        u_z = -around / w
        u1_z = (1j * p1 / R - around1 - w1 * u_z - seen * u1) / w
        return u_z, w1_z, u1_z, -seen * w1 - w * w1_z - axial1, p1

    still = jnp.zeros((2, len(_WHIRLS)), complex)
    w1 = still + inlet
    start = (
        gap.preswirl * R * speed,
        w1,
        still,
        -(1 + gap.inlet_loss) * w * w1,
        still,
    )
    _, w1, _, p1, force = _along(gap, rate, start)
    left = p1 + gap.exit_recovery * w * w1
    total = jnp.pi * R * gap.density * (force[0] - left[0] / left[1] * force[1])
    return _fitted(total, whirls)


def _fitted(total: Array, whirls: Array) -> Coefficients:
    """Parabolas through `-F/r` by least squares over the frequency."""
    basis = np.stack([np.ones_like(_WHIRLS), _WHIRLS, _WHIRLS**2])
    inverse = jnp.asarray(np.linalg.pinv(basis.T))
    size = whirls[2] ** jnp.arange(3.0)
    real, imaginary = inverse @ total.real / size, inverse @ total.imag / size
    return Coefficients(real[0], -imaginary[0], imaginary[1], real[1], -real[2], imaginary[2])


def short_flow(gap: Gap) -> Array:
    """Axial velocity, m/s, with the friction of a swirl of half the rotor's speed."""
    return _root(gap, lambda w: w**2 * (0.5 * (1 + gap.inlet_loss) + _mean_friction(gap, w)[0]))


def short_coefficients(gap: Gap, w: Array) -> Coefficients:
    """Childs's formulas of 1983 (at a preswirl of a half Black & Jenssen's), as printed: the pressure around
    the seal drives no flow around it, and what the whirl does to w at the inlet has no inertia."""
    sigma, beta = _mean_friction(gap, w)
    m = gap.stator[1]
    swirl = gap.preswirl - 0.5
    T = gap.length / w
    turn = gap.speed * T
    a, B = sigma * (1 + beta * (1 + m)), 1 + (1 - beta) * (1 + m)
    E = (1 + gap.inlet_loss) / (2 * (1 + gap.inlet_loss + B * sigma))
    fall = jnp.exp(-a)
    both = 1 / 6 + E
    K = E * (1 - m) - turn**2 / (4 * sigma) * (
        both / 2 + 2 * swirl / a * ((E + 1 / a**2) * (1 - fall) - (0.5 + 1 / a) * fall)
    )
    C = E / sigma + B / 2 * both
    k = (turn / 2) * (
        C + 2 * swirl / a * (E * B + (1 / sigma - B / a) * ((1 - fall) * (E + 0.5 + 1 / a) - 1))
    )
    c = (
        turn
        / sigma
        * (both / 2 + swirl / a * ((1 - fall) * (E + 0.5 + 1 / a**2) - (0.5 + fall / a)))
    )
    M = both / (2 * sigma)
    # pi R (pressure drop) / friction factor · 2 sigma²/(1 + inlet loss + 2 sigma)
    scale = jnp.pi * gap.radius * gap.density * sigma * w**2 * gap.length / gap.clearance
    return Coefficients(
        scale * K, scale * k, scale * C * T, scale * c * T, scale * M * T**2, jnp.zeros_like(K)
    )


def mean_reynolds(gap: Gap, w: Array) -> Array:
    """2 V h/nu, of the flow against the stator at a swirl of half the rotor's speed."""
    return 2 * gap.clearance * jnp.sqrt(w**2 + (gap.radius * gap.speed / 2) ** 2) / gap.viscosity


def _mean_friction(gap: Gap, w: Array) -> tuple[Array, Array]:
    """sigma, friction factor times length over clearance; beta, the swirl's part of V²."""
    n, m = gap.stator
    around = (gap.radius * gap.speed / 2) ** 2
    square = w**2 + around
    factor = n * (2 * gap.clearance * w / gap.viscosity) ** m * (square / w**2) ** ((1 + m) / 2)
    return factor * gap.length / gap.clearance, around / square


def _friction(gap: Gap, w: Array, u: Array, h: Array) -> tuple[Array, Array]:
    """What it slows w and u down by, m/s²."""

    def at(law: Array, against: Array) -> Array:
        n, m = law
        return n * (2 * h / gap.viscosity) ** m * (w**2 + against**2) ** ((1 + m) / 2) / (2 * h)

    slip = u - gap.radius * gap.speed
    stator, rotor = at(gap.stator, u), at(gap.rotor, slip)
    return (stator + rotor) * w, stator * u + rotor * slip


def _along(gap: Gap, rate, start):
    """Integrates from the inlet to the exit by Runge and Kutta's method."""
    dz = gap.length / _STEPS

    def stage(carry, row):
        begun, slope, gained = carry
        share, weight, last = row
        slope = rate(jax.tree.map(lambda x, s: x + share * dz * s, begun, slope))
        gained = jax.tree.map(lambda g, s: g + weight * dz * s, gained, slope)
        begun = jax.tree.map(lambda x, g: x + last * g, begun, gained)
        return (begun, slope, jax.tree.map(lambda g: (1 - last) * g, gained)), None

    # one stage a turn of the loop: a quarter to compile
    rows = jnp.tile(jnp.array(_STAGES), (_STEPS, 1))
    nothing = jax.tree.map(jnp.zeros_like, start)
    return jax.lax.scan(stage, (start, nothing, nothing), rows)[0][0]


def _root(gap: Gap, resistance) -> Array:
    """The velocity at which the seal resists with the pressure at hand; its derivatives are those of the
    implicit function."""

    def gained(x: Array) -> Array:
        return jnp.log(resistance(jnp.exp(x)) / gap.drop)

    def solved(f, x: Array) -> Array:
        def step(_, x):
            value, slope = jax.jvp(f, (x,), (jnp.ones_like(x),))
            return x - value / slope

        return jax.lax.fori_loop(0, _NEWTON, step, x)

    start = 0.5 * jnp.log(0.5 * gap.drop)
    # nearly a straight line of slope 1 to 2: Newton's method arrives from anywhere
    found = jax.lax.custom_root(gained, start, solved, lambda g, y: y / g(jnp.ones_like(y)))
    return jnp.exp(found)
