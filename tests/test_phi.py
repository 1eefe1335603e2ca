"""phi functions and the weights made of them."""

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest

from jaxrotor.integrators.phi import balance, phi_functions
from jaxrotor.integrators.weights import adams_weights, extrapolation, runge_kutta_weights


def exact_phi(k, z):
    """By its integral's closed form, in 150 digits (small arguments cancel)."""
    with mpmath.workdps(150):
        z = mpmath.mpf(z)
        if z == 0:
            return 1.0 / float(mpmath.factorial(k))
        rest = sum(z**j / mpmath.factorial(j) for j in range(k))
        return float((mpmath.exp(z) - rest) / z**k)


@pytest.mark.parametrize("z", [0.0, 1e-9, -0.3, -1.0, 2.5, -40.0, -1e4, -4e7])
def test_scalar(z):
    half, full = np.asarray(phi_functions(jnp.array([[z]]), 7))[:, :, 0, 0]
    for k in range(8):
        want = [exact_phi(k, z / 2), exact_phi(k, z)]
        if k == 0:
            with mpmath.workdps(150):
                want = [float(mpmath.expm1(mpmath.mpf(z) / 2)), float(mpmath.expm1(z))]
        np.testing.assert_allclose([half[k], full[k]], want, rtol=2e-13, atol=1e-300)


def test_matrix_with_slow_and_fast_modes():
    """A matrix with eigenvalues -4e3, -2 ± 3i and 0 keeps the slow ones' digits."""
    rng = np.random.default_rng(0)
    V = rng.standard_normal((4, 4))
    blocks = np.zeros((4, 4))
    blocks[0, 0], blocks[1:3, 1:3] = -4e3, [[-2, 3], [-3, -2]]
    A = V @ blocks @ np.linalg.inv(V)
    _, phi = phi_functions(jnp.asarray(A), 3)
    eigen, W = np.linalg.eig(A)

    def function(k, z):
        if abs(z) < 1e-6:
            return 1 / float(mpmath.factorial(k))
        rest = sum(mpmath.mpc(z) ** j / mpmath.factorial(j) for j in range(k))
        return complex((mpmath.exp(z) - rest) / mpmath.mpc(z) ** k)

    for k in (1, 2, 3):
        want = (W * [function(k, z) for z in eigen]) @ np.linalg.inv(W)
        np.testing.assert_allclose(np.asarray(phi[k]), want.real, atol=1e-12)


def test_derivative():
    """d phi/dA by reverse mode against central differences."""
    rng = np.random.default_rng(1)
    A = jnp.asarray(rng.standard_normal((3, 3)) * 5)

    def f(s):
        return jnp.sum(phi_functions(A * s, 4)[1] * jnp.arange(9.0).reshape(3, 3))

    h = 1e-5
    central = (f(1 + h) - f(1 - h)) / (2 * h)
    np.testing.assert_allclose(jax.grad(f)(1.0), central, rtol=1e-8)
    np.testing.assert_allclose(jax.jvp(f, (1.0,), (1.0,))[1], central, rtol=1e-8)


def test_balance_evens_out_units():
    """Metres against micrometres: the norm falls to what the eigenvalues need."""
    A = jnp.array([[0.0, 1.0], [-1e8, -1.0]])
    d = balance(A)
    scaled = A * d[None] / d[:, None]
    assert jnp.abs(scaled).sum(1).max() < 3e4  # sqrt(1e8), not 1e8
    assert np.all(np.log2(np.asarray(d)) % 1 == 0)


def test_extrapolation_is_exact_for_polynomials():
    for k in range(2, 8):
        past = -np.arange(k, dtype=float)
        for m in range(k):
            assert extrapolation(k) @ past**m == pytest.approx(1.0)


@pytest.mark.parametrize("k", [2, 4, 6])
def test_adams_is_exact_for_polynomial_forcing(k):
    """y' = a y + t^m: the predictor is exact for m < k, the corrector for m = k too."""
    a, h, t0 = -3.0, 0.2, 0.7
    weights = adams_weights(jnp.array([[a]]), jnp.asarray(h), k)
    for m in range(k + 1):

        def solution(t, m=m):  # particular solution with y(t0) = 1
            with mpmath.workdps(40):
                integral = mpmath.quad(
                    lambda s: mpmath.exp(a * (t - s)) * s**m, [mpmath.mpf(t0), mpmath.mpf(t)]
                )
                return float(mpmath.exp(a * (t - t0)) + integral)

        past = np.array([(t0 - j * h) ** m for j in range(k)])
        predicted = weights.predict @ np.array([1.0, *past])
        new = (t0 + h) ** m
        corrected = predicted + weights.correct @ np.array([new - extrapolation(k) @ past])
        want = solution(t0 + h)
        if m < k:
            np.testing.assert_allclose(predicted[0], want, rtol=1e-12)
        else:
            assert abs(predicted[0] - want) > 1e-9
        np.testing.assert_allclose(corrected[0], want, rtol=1e-12)


def test_runge_kutta_reduces_to_the_classical_one():
    """With A = 0 Krogstad's method is Runge's: its weights are 1/6, 1/3, 1/3, 1/6."""
    rows = np.asarray(runge_kutta_weights(jnp.zeros((1, 1)), jnp.asarray(0.1)))[:, 0]
    np.testing.assert_allclose(rows[4], [1, 0.1 / 6, 0.1 / 3, 0.1 / 3, 0.1 / 6], rtol=1e-13)
    np.testing.assert_allclose(rows[3], [1, 0, 0, 0.1, 0], atol=1e-15)
