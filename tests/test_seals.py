"""Annular seals: coefficients from geometry and fluid against the nonlinear flow, Childs's printed formulas and
limits in closed form; inside machines against tables of their coefficients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, simpson
from scipy.optimize import brentq

import jaxrotor as jr

# Childs, J. Lubr. Tech. 105 (1983) 429: interstage seal of the space shuttle's hydrogen pump
HPFTP = dict(
    diameter=0.0798,
    length=0.0432,
    clearance=1.397e-4,
    pressure_drop=14.92e6,
    viscosity=1.16e-5,
    density=70.78,
    friction=(0.066 * 2**0.25, -0.25),
)
SPEED = 37360 * np.pi / 30
# Kanki & Kawakami, IMechE (1984) 159: seals of water, by pressure and turning
WATER = dict(
    diameter=0.2,
    length=0.2,
    clearance=5e-4,
    pressure_drop=9.8e5,
    viscosity=8.779876e-4,
    density=996.8914,
    preswirl=0.2,
    inlet_loss=0.2,
)


def six(point):
    """K, k, C, c, M, m."""
    both = (point.stiffness, point.damping, point.mass)
    for x in both:
        assert x[0, 0] == x[1, 1] and x[0, 1] == -x[1, 0]
    return np.array([x[0, j] for x in both for j in (0, 1)])


# --- the short theory


def short_by_hand(swirl, speed=SPEED, inertia=0.0, n=0.066, m=-0.25, loss=0.1):
    """K, k, C, c, M and the axial velocity by quadrature of the short seal's equations: no flow around the
    seal by the pressure; of the inertia of what w changes by at the inlet the part `inertia`."""
    R, L, H = 0.0399, 0.0432, 1.397e-4
    rho, nu, drop = 70.78, 1.16e-5 / 70.78, 14.92e6

    def factor(w):
        b = w / (R * speed)
        return n * (H * w / nu) ** m * (1 + 1 / (4 * b**2)) ** ((1 + m) / 2)

    w = brentq(
        lambda w: (1 + loss + 2 * factor(w) * L / H) * rho * w**2 / 2 - drop, 1.0, 1e4, xtol=1e-13
    )
    sigma, T, b = factor(w) * L / H, L / w, w / (R * speed)
    beta = 1 / (1 + 4 * b**2)
    a, B = sigma * (1 + beta * (1 + m)), 1 + 4 * b**2 * beta * (1 + m)
    z = np.linspace(0, 1, 2001)

    def force(whirl):
        x = 1j * T * (whirl - speed / 2 - swirl * speed * np.exp(-a * z))
        X = cumulative_simpson(x.imag, x=z, initial=0) * 1j
        XX = cumulative_simpson(X.imag, x=z, initial=0) * 1j
        # pressure without y0, its factor, and at the inlet -(1 + loss) y0
        rest = -X - sigma * (1 - m) * z - sigma * B * XX - X**2 / 2
        by_inlet = -(1 + loss) - sigma * B * z - inertia * X
        p = rest - by_inlet * rest[-1] / by_inlet[-1]
        return np.pi * R * L * rho * w**2 / H * simpson(p, x=z)

    still, ahead, back = (force(f) for f in (0.0, SPEED, -SPEED))
    M = (still - (ahead + back) / 2).real / SPEED**2
    around = (ahead - back) / (2 * SPEED)
    return np.array([still.real, -still.imag, around.imag, around.real, M]), w


@pytest.mark.parametrize("preswirl", [0.5, 0.1])
def test_short_seal_by_quadrature(preswirl):
    """Childs's formulas: as printed they leave out what K has of the swirl squared."""
    seal = jr.elements.AnnularSeal(**HPFTP, preswirl=preswirl, theory="short")
    found = seal.coefficients(SPEED)
    swirl = preswirl - 0.5
    expected, w = short_by_hand(swirl)
    h = 1e-3
    even = [short_by_hand(x)[0][0] for x in (h, -h, 0.0)]
    expected[0] = even[2] + (even[0] - even[1]) / (2 * h) * swirl
    assert float(found.velocity) == pytest.approx(w, rel=1e-10)
    np.testing.assert_allclose(six(found)[:5], expected, rtol=1e-7)
    leakage = np.pi * 0.0798 * 1.397e-4 * 70.78 * w
    assert float(found.leakage) == pytest.approx(leakage, rel=1e-10)


def test_black_and_jenssens_coefficients():
    """At a preswirl of a half: mu0, mu1 and mu2 of Black & Jenssen (1971) with Blasius's exponent,
    K = mu0 - mu2 (speed T)²/4, C = mu1 T, k = mu1 speed T/2, c = mu2 speed T², M = mu2 T²."""
    seal = jr.elements.AnnularSeal(**HPFTP, theory="short")
    found = seal.coefficients(SPEED)
    w, (R, L, H) = float(found.velocity), (0.0399, 0.0432, 1.397e-4)
    b, T, xi = w / (R * SPEED), L / w, 0.1
    sigma = (2 * 14.92e6 / (70.78 * w**2) - 1 - xi) / 2
    B, A = (1 + 7 * b**2) / (1 + 4 * b**2), np.pi * sigma / (1 + xi + 2 * sigma)
    E = (1 + xi) / (2 * (1 + xi + B * sigma))
    mu = [2.5 * A * E, 2 * A * (E / sigma + B / 2 * (E + 1 / 6)), A / sigma * (E + 1 / 6)]
    turn = SPEED * T
    expected = [
        mu[0] - mu[2] * turn**2 / 4,
        mu[1] * turn / 2,
        mu[1] * T,
        mu[2] * turn * T,
        mu[2] * T**2,
    ]
    expected = np.array(expected) * 14.92e6 * L * R / H
    np.testing.assert_allclose(six(found)[:5], expected, rtol=1e-9)


# --- the finite theory


def whirling_flow(amplitude, whirl, speed, given, rows=14, columns=8):
    """Force on a rotor in a circular whirl, by the NONLINEAR equations of the flow on a grid: polynomials
    along the seal, waves around it, in axes that whirl along; Newton's method."""
    R, L, H = given["diameter"] / 2, given["length"], given["clearance"]
    nu = given["viscosity"] / given["density"]
    swirl, loss = given["preswirl"], given["inlet_loss"]
    (n, m), (n2, m2) = given["friction"], given["rotor_friction"]
    z = (1 - np.cos(np.pi * np.arange(rows) / (rows - 1))) / 2
    gaps = z[:, None] - z + np.eye(rows)
    weights = 1 / np.prod(gaps, axis=1)
    along = weights / weights[:, None] / gaps
    along[np.diag_indices(rows)] = 0
    along[np.diag_indices(rows)] = -along.sum(axis=1)
    along /= L
    waves = np.fft.fftfreq(columns, 1 / columns)
    waves[columns // 2] = 0
    around = np.fft.ifft(1j * waves[:, None] * np.fft.fft(np.eye(columns), axis=0), axis=0).real
    theta = 2 * np.pi * np.arange(columns) / columns
    h = H - amplitude * np.cos(theta)
    scale = np.sqrt(given["pressure_drop"] / given["density"])

    def residual(x):
        w, u, p = x.reshape(3, rows, columns)
        w, u, p = w * scale, u * scale, p * scale**2
        turn = lambda f: f @ jnp.asarray(around.T)  # noqa: E731
        slip = u - R * speed
        stator = n * (2 * h / nu) ** m * (w**2 + u**2) ** ((1 + m) / 2)
        rotor = n2 * (2 * h / nu) ** m2 * (w**2 + slip**2) ** ((1 + m2) / 2)
        flow = along @ (h * w) + turn(h * u) / R - whirl * turn(h)
        carried = lambda f: w * (along @ f) + (u / R - whirl) * turn(f)  # noqa: E731
        axial = carried(w) + along @ p + (stator + rotor) * w / (2 * h)
        circular = carried(u) + turn(p) / R + (stator * u + rotor * slip) / (2 * h)
        # at the inlet: u given, and p by w; at the exit p
        drop = given["pressure_drop"] / given["density"]
        circular = jnp.concatenate([(u[:1] - swirl * R * speed) * scale / L, circular[1:]])
        axial = jnp.concatenate(
            [(p[:1] - drop + (1 + loss) * w[:1] ** 2 / 2) / L, axial[1:-1], p[-1:] / L]
        )
        return jnp.stack([flow / H * scale, circular, axial]).ravel() * L / scale**2

    start = np.ones((3, rows, columns))
    start[1] *= swirl * R * speed / scale
    start[2] = 1 - z[:, None]
    x = start.ravel()
    jacobian = jax.jit(lambda x: (residual(x), jax.jacfwd(residual)(x)))
    for _ in range(12):
        value, slope = jacobian(x)
        # one equation too many: of the mass at the exit, where the rest says it already
        x = x - np.linalg.lstsq(np.asarray(slope), np.asarray(value), rcond=1e-12)[0]
    assert np.abs(jacobian(x)[0]).max() < 1e-9
    p = x.reshape(3, rows, columns)[2] * given["pressure_drop"]
    # int over z: Clenshaw and Curtis by the polynomial itself
    inside = np.linalg.solve(
        np.vander(z, increasing=True).T, 1 / np.arange(1, rows + 1)
    ) * L
    return -R * 2 * np.pi * np.mean((inside @ p) * np.exp(1j * theta))
