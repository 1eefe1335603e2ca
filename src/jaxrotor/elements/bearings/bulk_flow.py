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

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .implicit import root

# Points along the seal (Radau's, the last at the exit), and Newton's steps for the flow: of 600 seals of all
# kinds, turned at up to 1e7 rad/s, none needs more than four.
_POINTS, _NEWTON = 14, 6
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
    """`-F = [[K, k], [-k, K]] q + [[C, c], [-c, C]] v + [[M, m], [-m, M]] a`; a gas has no M and m."""

    K: Array
    k: Array
    C: Array
    c: Array
    M: Any = None
    m: Any = None


def _radau(n: int) -> np.ndarray:
    """Integrals from 0 to each of Radau's n points (the last at 1) of what is given at them: collocation with
    these is stable however fast the friction settles the swirl."""
    polynomials = np.polynomial.legendre
    # where those of the degrees n and n - 1 are alike
    points = polynomials.legroots([0.0] * (n - 1) + [-1.0, 1.0])
    sums = [polynomials.legval(points, polynomials.legint(one, lbnd=-1)) for one in np.eye(n)]
    return np.stack(sums, axis=1) @ np.linalg.inv(polynomials.legvander(points, n - 1)) / 2


_INTEGRALS = _radau(_POINTS)


def finite_flow(gap: Gap) -> tuple[Array, Array]:
    """Axial velocity, m/s, and the velocity around the seal at the points, m/s."""
    T, start = gap.length * _INTEGRALS, gap.preswirl * gap.radius * gap.speed
    size = jnp.sqrt(gap.drop)

    def left(x: Array) -> Array:
        w, u = size * jnp.exp(x[0]), size * x[1:]
        axial, around = _friction(gap, w, u, gap.clearance)
        resistance = T[-1] @ axial + 0.5 * (1 + gap.inlet_loss - gap.exit_recovery) * w**2
        swirl = (u - start + T @ around / w) / size
        return jnp.concatenate([jnp.log(resistance / gap.drop)[None], swirl])

    # from the friction of about the final velocity, a swirl settled
    settled = 0.5 * gap.radius * gap.speed
    (n, m), V = gap.stator, jnp.sqrt(gap.drop + settled**2)
    rub = n * (2 * gap.clearance * V / gap.viscosity) ** m * V * gap.length / gap.clearance
    w = 2 * gap.drop / (rub + jnp.sqrt(rub**2 + 2 * (1 + gap.inlet_loss) * gap.drop))
    start_at = jnp.full(_POINTS + 1, settled / size).at[0].set(jnp.log(w / size))
    x = root(left, start_at, _NEWTON)
    return size * jnp.exp(x[0]), size * x[1:]


def finite_coefficients(gap: Gap) -> tuple[Array, Coefficients]:
    """Axial velocity, m/s, and coefficients by the perturbed flow along the whole seal."""
    w, u = finite_flow(gap)
    least = _LEAST * w / gap.length
    whirls = jnp.where(gap.speed < 0, -1.0, 1.0) * jnp.sqrt(gap.speed**2 + least**2) * _WHIRLS
    return w, _fitted(jax.vmap(lambda f: _impedance(gap, w, u, f))(whirls), whirls)


def _impedance(gap: Gap, w: Array, u: Array, whirl: Array) -> Array:
    """`-F/r` at a frequency of the whirl, rad/s, from flows of first order at the points: w1 and p1 are
    sums of what comes of u1, of the gap's change and of w1 at the inlet (columns of the latter two)."""
    R, C, T = gap.radius, gap.clearance, gap.length * _INTEGRALS
    slopes = jax.vmap(jax.jacfwd(_friction, argnums=(1, 2, 3)), in_axes=(None, None, 0, None))
    (axial_w, axial_u, axial_h), (around_w, around_u, around_h) = slopes(gap, w, u, C)
    seen = 1j * (whirl - u / R)
    to_u = around_w - _friction(gap, w, u, C)[1] / w  # with w1 du/dz
    ones, zeros = jnp.ones_like(u), jnp.zeros_like(u)

    def carried(w1_z: Array, u1: Any = 0.0, gaps: Any = 0.0, w1_in: Any = 0.0):
        """w1 and p1."""
        w1 = w1_in + T @ w1_z
        p1_z = -_by(seen + axial_w, w1) - w * w1_z - _by(axial_u, u1) - _by(axial_h, gaps)
        return w1, T @ p1_z - (1 + gap.inlet_loss) * w * w1_in

    def swirled(w1: Array, p1: Array, u1: Any = 0.0, gaps: Any = 0.0):
        slowed = _by(to_u, w1) + _by(around_u + seen, u1) + _by(around_h, gaps)
        return T @ (1j / R * p1 - slowed) / w

    gaps, w1_in = jnp.stack([-ones, zeros], 1), jnp.stack([zeros, ones], 1)
    each = jnp.eye(_POINTS)
    by_u = carried(1j / R * each, u1=each)
    by_gap = carried(-_by(seen, gaps) / C, gaps=gaps, w1_in=w1_in)
    u1 = jnp.linalg.solve(each - swirled(*by_u, u1=each), swirled(*by_gap, gaps=gaps))
    w1, p1 = (own + of @ u1 for own, of in zip(by_gap, by_u))
    left = p1[-1] + gap.exit_recovery * w * w1[-1]
    force = T[-1] @ p1
    return jnp.pi * R * gap.density * (force[0] - left[0] / left[1] * force[1])


def _by(factor: Array, columns: Any) -> Array:
    return factor[:, None] * columns


def _fitted(total: Array, whirls: Array) -> Coefficients:
    """Parabolas through `-F/r` by least squares over the frequency."""
    basis = np.stack([np.ones_like(_WHIRLS), _WHIRLS, _WHIRLS**2])
    inverse = jnp.asarray(np.linalg.pinv(basis.T))
    size = whirls[2] ** jnp.arange(3.0)
    real, imaginary = inverse @ total.real / size, inverse @ total.imag / size
    return Coefficients(real[0], -imaginary[0], imaginary[1], real[1], -real[2], imaginary[2])


def short_flow(gap: Gap) -> Array:
    """Axial velocity, m/s, with the friction of a swirl of half the rotor's speed."""

    def left(x: Array) -> Array:
        w = jnp.exp(x)
        resistance = w**2 * (0.5 * (1 + gap.inlet_loss) + _mean_friction(gap, w)[0])
        return jnp.log(resistance / gap.drop)

    return jnp.exp(root(left, 0.5 * jnp.log(0.5 * gap.drop)[None], _NEWTON)[0])


def short_coefficients(gap: Gap) -> tuple[Array, Coefficients]:
    """Childs's formulas of 1983 (at a preswirl of a half Black & Jenssen's), as printed: the pressure around
    the seal drives no flow around it, and what the whirl does to w at the inlet has no inertia."""
    w = short_flow(gap)
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
    return w, Coefficients(
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
