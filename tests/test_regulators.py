"""Matrix equations and optimal feedback against SciPy, 50 digits, closed forms and the matrix exponential."""

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
from helpers import assert_derivatives_agree

import jaxrotor as jr
from jaxrotor.linear.matrix_equations import balance, lyapunov, riccati, stable
from jaxrotor.linear.regulator import closed_loop_cost, lqg, lqr

RNG = np.random.default_rng(5)


def stable_matrix(d):
    A = RNG.standard_normal((d, d))
    return A - (np.linalg.eigvals(A).real.max() + 0.3) * np.eye(d)


def assert_alike(X, Y, rtol):
    """Entries of symmetric matrices by the sizes that their diagonals give them."""
    size = np.sqrt(np.outer(np.diag(Y), np.diag(Y)))
    np.testing.assert_allclose(np.asarray(X) / size, np.asarray(Y) / size, atol=rtol, rtol=0)


def chain():
    """Three masses in a row, from a heavy soft to a light stiff one: A and the force on the last, SI.
    Eigenvalues -0.24 +- 69i, -8e3 +- 6e4 i, -1.5e3 and -4e6, 1/s."""
    M = np.array([20.0, 1.0, 0.01])
    k = np.array([1e5, 4e9, 6e7])
    K = np.diag(k + np.append(k[1:], 0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    c = np.array([10.0, 1.6e4, 4e4])
    C = np.diag(c + np.append(c[1:], 0)) - np.diag(c[1:], 1) - np.diag(c[1:], -1)
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-K / M[:, None], -C / M[:, None]]])
    return A, np.array([0, 0, 0, 0, 0, 1 / M[2]])[:, None]


def exact_lyapunov(A, Q):
    """By eigenvectors, with 60 digits."""
    with mpmath.workdps(60):
        values, V = mpmath.eig(mpmath.matrix(A.tolist()))
        inverse = V**-1
        F = inverse * mpmath.matrix(Q.tolist()) * inverse.H
        d = len(A)
        for i in range(d):
            for j in range(d):
                F[i, j] /= -(values[i] + mpmath.conj(values[j]))
        return np.array((V * F * V.H).tolist(), complex).real


def test_lyapunov():
    for d in (1, 4, 15):
        A, B = stable_matrix(d), RNG.standard_normal((d, 2))
        found = lyapunov(A, B @ B.T)
        assert_alike(found, scipy.linalg.solve_continuous_lyapunov(A, -B @ B.T), 1e-12)
    A = jnp.stack([stable_matrix(4) for _ in range(3)])
    batch = jax.vmap(lyapunov, (0, None))(A, jnp.eye(4))
    np.testing.assert_allclose(batch[2], lyapunov(A[2], jnp.eye(4)), rtol=1e-12)
    # a defective matrix
    J = np.array([[-1.0, 1.0], [0.0, -1.0]])
    np.testing.assert_allclose(lyapunov(J, jnp.eye(2)), [[0.75, 0.25], [0.25, 0.5]], rtol=1e-15)


def test_lyapunov_of_a_stiff_machine():
    A, B = chain()
    values = np.linalg.eigvals(A)
    assert abs(values).max() > 1e6 and abs(values.real).min() < 0.3
    X = lyapunov(A, B @ B.T)
    # SciPy is 6e-8 off; a change of A in its last digit makes 5e-12
    assert_alike(X, exact_lyapunov(A, B @ B.T), 3e-11)
    assert bool(stable(A)) and not bool(stable(jnp.array(A).at[3:, :3].set(0.0)))
    scale = np.asarray(balance(A))
    np.testing.assert_array_equal(np.log2(scale), np.round(np.log2(scale)))
    sides = np.abs(A * scale / scale[:, None]) * (1 - np.eye(6))
    ratio = sides.sum(0) / sides.sum(1)
    assert 0.2 < ratio.min() and ratio.max() < 5.0


def test_derivatives_of_the_equations():
    A, B, W = stable_matrix(4), RNG.standard_normal((4, 2)), RNG.standard_normal((3, 4, 4))

    def moved(p):
        return A + jnp.tensordot(p, W, 1), B + p[0] * B**2

    def covariance(p):
        A, B = moved(p)
        return lyapunov(A, B @ B.T)

    def cost(p):
        A, B = moved(p)
        Q, R = jnp.eye(4) * (1 + p[1]) + p[2] * jnp.ones((4, 4)), jnp.diag(1 + p[:2])
        return riccati(A + 0.5 * jnp.eye(4), B, Q, R)

    p = np.array([0.02, 0.03, 0.01])
    for f in (covariance, cost):
        assert_derivatives_agree(f, p, rtol=1e-8, step=1e-3)

        @jax.jit
        @jax.grad
        def slope(p, f=f):
            return jnp.sum(f(p) ** 2)

        second = jax.jit(jax.jacfwd(slope))(p)
        for i, h in enumerate(1e-4 * np.eye(3)):
            central = (8 * (slope(p + h) - slope(p - h)) - slope(p + 2 * h) + slope(p - 2 * h)) / 12
            np.testing.assert_allclose(second[:, i], central / 1e-4, rtol=1e-6)


def test_riccati():
    R = np.diag([1.0, 3.0])
    for d in (2, 5, 12):
        A, B, Q = (RNG.standard_normal(shape) for shape in ((d, d), (d, 2), (d, d)))
        want = scipy.linalg.solve_continuous_are(A, B, Q @ Q.T, R)
        assert_alike(riccati(A, B, Q @ Q.T, R), want, 1e-11)
    A, B = jnp.asarray(RNG.standard_normal((3, 4, 4))), jnp.ones((4, 1))
    batch = jax.vmap(lambda A: riccati(A, B, jnp.eye(4), jnp.eye(1)))(A)
    want = scipy.linalg.solve_continuous_are(A[1], B, np.eye(4), np.eye(1))
    np.testing.assert_allclose(batch[1], want, rtol=1e-11)


@pytest.mark.parametrize("m, q, r", [(1.0, 1.0, 1.0), (3.0, 1e12, 1e-4), (1e-3, 1e-8, 1e6)])
def test_a_free_mass(m, q, r):
    """Its gain is (sqrt(q/r), sqrt(2 m sqrt(q/r))) where displacement costs q, force r."""
    A, B = np.array([[0.0, 1], [0, 0]]), np.array([[0], [1 / m]])
    found = lqr(A, B, np.diag([q, 0.0]), [[r]])
    k = np.sqrt(q / r)
    np.testing.assert_allclose(found.gain[0], [k, np.sqrt(2 * m * k)], rtol=1e-12)


def test_riccati_of_a_stiff_machine():
    """Its own equation in 50 digits: the defect, as an error by one step of Newton's method."""
    A, B = chain()
    Q, R = np.diag([1e12] * 3 + [1e-4] * 3), np.array([[1e-2]])
    X = np.asarray(riccati(A, B, Q, R))
    with mpmath.workdps(50):
        a, b, x, q = (mpmath.matrix(y.tolist()) for y in (A, B, X, Q))
        defect = a.T * x + x * a - x * b * b.T * x / R[0, 0] + q
        loop = np.array((a - b * b.T * x / R[0, 0]).tolist(), float)
        error = exact_lyapunov(loop.T, np.array(defect.tolist(), float))
    size = np.sqrt(np.outer(np.diag(X), np.diag(X)))
    assert np.abs(error / size).max() < 1e-9
    assert np.linalg.eigvals(loop).real.max() < 0


def linear(**more):
    """A rotor on a torsion spring with a tuned damper, a torque on it: x = (twist, its rate, and the ring's
    relative to the rotor)."""
    inertia, stiffness = 0.04, 900.0
    return jr.linearize(
        jr.Machine.in_line(
            {
                "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
                "spring": jr.Coupling([0.0, 0, 0, 0, 0, stiffness]),
                "disc": jr.Rotor(1.0, inertia, 0.03),
            },
            attachments={"absorber": (jr.TorsionalDamper(0.004, 0.15, 70.0), "disc"), **more},
            fixed={"disc": ("x", "y", "z", "psi", "theta")},
        ),
        at="undeformed",
    )


@pytest.fixture(scope="module")
def model():
    return linear()


ENERGY = np.diag([900.0, 0.04, 70.0, 0.004])  # as a weight
EFFORT = np.array([[0.02]])


def test_regulator_of_a_machine(model):
    A, B = model.A, model.B
    gain, X = lqr(A, B, ENERGY, EFFORT)
    want = scipy.linalg.solve_continuous_are(A, B, ENERGY, EFFORT)
    assert_alike(X, want, 1e-11)
    np.testing.assert_allclose(gain, np.linalg.solve(EFFORT, B.T @ want), rtol=1e-10)
    x0 = np.array([0.01, 2.0, -0.02, 1.0])
    start = np.outer(x0, x0)

    @jax.jit
    @jax.value_and_grad
    def cost(K):
        return closed_loop_cost(A, B, K, ENERGY, EFFORT, start)

    value, slope = cost(gain)
    assert value == pytest.approx(float(x0 @ X @ x0), rel=1e-12)
    assert np.abs(slope * gain).max() < 1e-10 * value
    assert cost(1.1 * gain)[0] > value < cost(0.9 * gain)[0]
    # the integral itself, by the matrix exponential
    loop, h = np.asarray(A - B @ gain), 2e-5
    weight = ENERGY + gain.T @ EFFORT @ gain
    step, x, costs = scipy.linalg.expm(loop * h), x0, []
    for _ in range(60001):
        costs.append(x @ weight @ x)
        x = step @ x
    assert value == pytest.approx(scipy.integrate.simpson(costs, dx=h), rel=1e-9)
    assert cost(-10 * gain)[0] == np.inf and np.all(np.isfinite(cost(-10 * gain)[1]))
    assert_derivatives_agree(
        lambda k: closed_loop_cost(A, B, k[None], ENERGY, EFFORT, start), 0.7 * gain[0], step=1e-3
    )


def test_compensator_of_a_machine(model):
    """The twist is measured; a torque of white noise shakes the rotor."""
    A, B, C = np.asarray(model.A), np.asarray(model.B), np.array([[1.0, 0, 0, 0]])
    W, V = 0.5 * B @ B.T, np.array([[1e-9]])
    found = lqg(A, B, C, ENERGY, EFFORT, W, V)
    X = scipy.linalg.solve_continuous_are(A, B, ENERGY, EFFORT)
    S = scipy.linalg.solve_continuous_are(A.T, C.T, W, V)
    K, L = np.linalg.solve(EFFORT, B.T @ X), S @ C.T / V
    by = found.compensator
    np.testing.assert_allclose(by.C, -K, rtol=1e-9)
    np.testing.assert_allclose(by.B, L, rtol=1e-8)
    np.testing.assert_allclose(by.A, A - B @ K - L @ C, rtol=1e-8, atol=1e-8)

    def mean_cost(A_c, B_c, C_c):
        """Of machine and compensator together, each with its noise."""
        whole = np.block([[A, B @ C_c], [B_c @ C, A_c]])
        noise = scipy.linalg.block_diag(W, B_c @ V @ B_c.T)
        weight = scipy.linalg.block_diag(ENERGY, C_c.T @ EFFORT @ C_c)
        assert np.linalg.eigvals(whole).real.max() < 0
        return np.trace(weight @ exact_lyapunov(whole, noise))

    A_c, B_c, C_c = map(np.asarray, (by.A, by.B, by.C))
    best = mean_cost(A_c, B_c, C_c)
    assert found.cost == pytest.approx(best, rel=1e-10)
    for k in (0.95, 1.05):  # no other gains are better
        assert mean_cost(A_c, k * B_c, C_c) > best < mean_cost(A_c, B_c, k * C_c)
    slopes = [
        jax.jit(way(lambda v: lqg(A, B, C, ENERGY, EFFORT, W, v * V).cost))(1.0)
        for way in (jax.jacfwd, jax.jacrev)
    ]
    # the envelope: noise v enters the cost as tr(L' P L) with the optimal L held
    h = 1e-4
    up, down = (lqg(A, B, C, ENERGY, EFFORT, W, (1 + s * h) * V).cost for s in (1, -1))
    np.testing.assert_allclose(slopes, (up - down) / (2 * h), rtol=1e-6)
    np.testing.assert_allclose(slopes[0], slopes[1], rtol=1e-9)


def test_a_loop_takes_the_compensator_as_it_is(model):
    """Twist and rate are measured: the poles of the loop are those of regulator and filter."""
    A, B, C = np.asarray(model.A), np.asarray(model.B), np.eye(2, 4)
    W, V = 0.5 * B @ B.T, np.diag([1e-9, 1e-5])
    found = lqg(A, B, C, ENERGY, EFFORT, W, V)
    X = scipy.linalg.solve_continuous_are(A, B, ENERGY, EFFORT)
    S = scipy.linalg.solve_continuous_are(A.T, C.T, W, V)
    K, L = np.linalg.solve(EFFORT, B.T @ X), S @ C.T @ np.linalg.inv(V)
    want = np.concatenate([np.linalg.eigvals(A - B @ K), np.linalg.eigvals(A - L @ C)])
    closed = linear(loop=(jr.elements.ActiveTorque(found.compensator), ("disc", "end")))
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(closed.A)), np.sort_complex(want), rtol=1e-6
    )


def test_refusals(model):
    A, B = np.asarray(model.A), np.asarray(model.B)
    with pytest.raises(jr.InputError, match="Q must be a matrix, 4 by 4, but its shape is .3, 3."):
        lqr(A, B, np.eye(3), EFFORT)
    with pytest.raises(
        jr.InputError, match="R must be positive definite, but its least eigenvalue is -1:"
    ):
        lqr(A, B, ENERGY, [[-1.0]])
    growing = np.diag([1.0, -1.0])
    with pytest.raises(
        jr.InputError, match="no feedback makes every motion die out: let an input reach"
    ):
        lqr(growing, [[0.0], [1.0]], np.eye(2), [[1.0]])
    with pytest.raises(jr.InputError, match="A, C.: no feedback .*: measure the one that does not"):
        lqg(growing, [[1.0], [1.0]], [[0.0, 1.0]], np.eye(2), [[1.0]], np.eye(2), [[1.0]])
