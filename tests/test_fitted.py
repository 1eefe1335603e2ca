"""Exponentially fitted Adams: weights, exactness, order, start, and the change of linearisation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from jaxrotor.integrators import fitted
from jaxrotor.integrators.fitted import History, Ladder, begin, rebased, run_blocks, step
from jaxrotor.integrators.fitted_weights import first_steps, fitted_weights, turn_of
from jaxrotor.integrators.phi import phi_functions, turning_powers

OMEGA = 3.0  # rad/s


def integrals(Z, turn, count):
    """∫_0^1 e^((1-s) Z) u_n(s) ds, n < count, where u_n is s^n/n!, or for the last two its turning mate:
    all from one exponential, for the u_n follow linear equations themselves."""
    d = len(Z)
    J = np.eye(count, k=-1)
    J[count - 2, count - 1] = -(turn**2)
    whole = np.zeros((d + count, d + count))
    out = []
    for column in np.eye(d):
        for n in range(count):
            whole[:d, :d], whole[d:, d:] = Z, J
            whole[:d, d:] = np.outer(column, np.eye(count)[n])
            out.append(expm(whole)[:d, d])
    return np.array(out).reshape(d, count, d).transpose(1, 2, 0)


def matrix(kind):
    rng = np.random.default_rng(3)
    Z = rng.standard_normal((4, 4))
    if kind == "damped":
        return 8 * Z - 30 * np.eye(4)
    if kind == "critical":  # an undamped mode at the very speed, and one that stands still
        turning = np.array([[0.0, 1.3], [-1.3, 0.0]])
        return Z @ np.block([[turning, np.zeros((2, 2))], [np.zeros((2, 4))]]) @ np.linalg.inv(Z)
    return 0.01 * Z


@pytest.mark.parametrize("kind", ["damped", "critical", "slow"])
def test_integrals_that_turn(kind):
    """Against one matrix exponential each; (i θ - Z)^-1 does not exist where θ is an eigenvalue."""
    Z, turned = matrix(kind), jax.jit(phi_functions, static_argnums=1)
    for turn in (0.0, 1e-3, 1.3, 2.0):
        found = np.asarray(turned(jnp.asarray(Z), 7, jnp.asarray(turn)))
        for part, scale in zip(found, (0.5, 1.0)):
            want = integrals(scale * Z, scale * turn, 7)
            size = np.abs(want).max(axis=(1, 2), keepdims=True)
            np.testing.assert_allclose(part[1:] / size, want / size, atol=1e-12)
            np.testing.assert_allclose(part[0] + np.eye(4), expm(scale * Z), atol=1e-12)


def test_turning_powers_are_cosine_and_sine_less_their_first_terms():
    x, turn = np.linspace(-5, 1, 7), 1.5
    found = np.asarray(turning_powers(jnp.asarray(x), jnp.asarray(turn), 0, 4))
    a = turn * x
    want = [np.cos(a), np.sin(a) / turn, (1 - np.cos(a)) / turn**2, (a - np.sin(a)) / turn**3]
    np.testing.assert_allclose(found, want, atol=2e-12)


def test_integrals_have_derivatives_by_matrix_and_speed():
    Z = jnp.asarray(matrix("damped"))

    def f(x):
        return jnp.sum(phi_functions(Z * x, 4, 1.3 * x)[1] * jnp.arange(80.0).reshape(5, 4, 4))

    step = 1e-5
    central = (f(1 + step) - f(1 - step)) / (2 * step)
    np.testing.assert_allclose(jax.grad(f)(1.0), central, rtol=1e-8)
    np.testing.assert_allclose(jax.jvp(f, (1.0,), (1.0,))[1], central, rtol=1e-8)


@pytest.mark.parametrize("order", [3, 6])
def test_exact_for_what_the_weights_are_fitted_to(order):
    """Prediction for 1, s, ..., s^(k-3) and the pair; correction for one power more."""
    rng = np.random.default_rng(order)
    A, h, turn = matrix("damped"), 0.05, 1.1
    w = fitted_weights(jnp.asarray(A), jnp.asarray(h), jnp.asarray(turn), order)
    s = np.arange(1.0, -order, -1)  # the step's end, then the past, newest first
    powers = np.stack([s**n for n in range(order - 1)])
    pair = np.stack([np.cos(turn * s), np.sin(turn * s)])
    # the same as linear equations of the powers and the pair
    J = np.zeros((order + 1, order + 1))
    J[np.arange(1, order - 1), np.arange(order - 2)] = np.arange(1, order - 1)
    J[-2:, -2:] = [[0, -turn], [turn, 0]]
    start = np.zeros(order + 1)
    start[[0, -2]] = 1.0
    factors = rng.standard_normal((4, order + 1))
    y = rng.standard_normal(4)
    for corrected in (False, True):
        if not corrected:
            factors[:, order - 2] = 0.0
        else:
            factors[:, order - 2] = rng.standard_normal(4)
        N = factors @ np.concatenate([powers, pair])
        whole = np.block([[h * A, h * factors], [np.zeros((order + 1, 4)), J]])
        want = (expm(whole) @ np.concatenate([y, start]))[:4]
        history = N[:, 1:].T
        gap = N[:, 0] - np.asarray(w.ahead) @ history
        found = np.asarray(w.predict) @ np.concatenate([y, history.ravel()])
        if corrected:
            assert np.abs(found - want).max() > 1e-4  # the power is not in the prediction
            found = found + np.asarray(w.correct) @ gap
        else:
            np.testing.assert_allclose(gap, 0.0, atol=1e-10)
        np.testing.assert_allclose(found, want, atol=1e-12)


def test_rows_without_N_are_left_out():
    A = np.eye(4, k=2) + np.diag([0, 0, -3.0, -40.0])
    args = jnp.asarray(A), jnp.asarray(0.1), jnp.asarray(0.7), 4
    whole, some = fitted_weights(*args), fitted_weights(*args, 2)
    columns = np.concatenate([np.arange(4), *(4 + 4 * j + np.arange(2, 4) for j in range(4))])
    np.testing.assert_allclose(some.predict, whole.predict[:, columns], atol=1e-15)
    np.testing.assert_allclose(some.correct, whole.correct[:, 2:], atol=1e-15)


# Three coordinates, the last stiff, with forces bent so that `motion` is what they do, whatever A is. Of the
# Jacobian a gyroscopic coupling goes with a speed that rises, as in a machine.
STIFF = -1e4


def motion(t):
    a = OMEGA * t
    y = jnp.stack([jnp.sin(a), 0.5 * jnp.cos(2 * a), jnp.sin(a) ** 2])
    return y, OMEGA * jnp.stack([jnp.cos(a), -jnp.sin(2 * a), jnp.sin(2 * a)])


def speed(t, y):
    return 4.0 * t


def linear(w):
    gyro = jnp.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return jnp.diag(jnp.array([-1.0, -2.0, STIFF])) + w * gyro


def field(t, y):
    want, rate = motion(t)
    off = y - want
    bent = jnp.stack([off[0] * off[1], off[0] ** 2, off[0]])
    return rate + linear(speed(t, y)) @ off + bent + 0.3 * (jnp.sin(y) - jnp.sin(want))


def largest_errors(order):
    """At three steps, each half the one before, over two seconds and eleven linearisations."""
    speeds = jnp.linspace(0.0, 8.0, 11)
    A = jax.vmap(linear)(speeds)

    def one(h, blocks):
        ladder = Ladder.of(speeds, A, h, order)
        first, history = begin(field, ladder, jnp.zeros(()), motion(0.0)[0])
        ys, _ = run_blocks(field, ladder, speed, (order - 1) * h, blocks, 10, first[-1], history)
        ys = jnp.concatenate([first, ys])
        t = h * (1 + jnp.arange(ys.shape[0]))
        return jnp.max(jnp.abs(ys - jax.vmap(motion)(t)[0]))

    one = jax.jit(one, static_argnums=1)
    return np.array([one(jnp.asarray(2.0 / (10 * n)), n) for n in (5, 10, 20)])


@pytest.mark.parametrize("order", [4, 6])
def test_order_over_changes_of_the_linearisation(order):
    """The correction's, one above the number of past values, or a little less where steps are long."""
    found = largest_errors(order)
    assert np.all(np.log2(found[:-1] / found[1:]) > order + 0.3), found
    assert found[-1] < {4: 1e-6, 6: 1e-9}[order]


def test_a_history_of_another_linearisation_would_spoil_it(monkeypatch):
    """That the test above sees whether a history is rebased."""
    monkeypatch.setattr(fitted, "rebased", lambda history, A_from, A_to: history)
    found = largest_errors(4)
    assert np.all(np.log2(found[:-1] / found[1:]) < 2), found


def test_rebased():
    rng = np.random.default_rng(0)
    states, f = rng.standard_normal((2, 4, 3))
    here, there = np.asarray(linear(0.8)), np.asarray(linear(1.6))
    history = History(jnp.asarray(f - states @ here.T)[:, 1:], jnp.asarray(states))
    moved = rebased(history, jnp.asarray(here), jnp.asarray(there))
    np.testing.assert_allclose(moved.N, (f - states @ there.T)[:, 1:], atol=1e-11)


def test_what_is_remembered_is_N_at_the_corrected_state():
    """Where the field is linear and A goes with the speed evenly, that is known."""
    rng = np.random.default_rng(1)
    speeds = jnp.array([0.0, 3.0, 8.0])
    ladder = Ladder.of(speeds, jax.vmap(linear)(speeds), jnp.asarray(0.05), 4)
    A, weights, follow = ladder.at(1, jnp.asarray(4.2))
    y, N = jnp.asarray(rng.standard_normal(3)), jnp.asarray(rng.standard_normal((4, 3)))
    here = linear(4.2)
    y1, moved, gap = step(lambda t, y: here @ y, A, weights, 0.05, y, N, follow)
    assert np.abs(gap).max() > 0.1
    np.testing.assert_allclose(moved[0], (here - A) @ y1, atol=1e-12)
    np.testing.assert_array_equal(moved[1:], N[:-1])


def test_weights_for_many_speeds_are_mixed_from_those_of_one():
    """On one linearisation: those for a speed beside its own are nearly what that speed's own would be."""
    A, h = linear(2.0)[None], jnp.asarray(0.1)
    at = jnp.array([5.0])
    ladder = Ladder.of(at, A, h, 5, speeds=jnp.array([4.0, 5.0, 6.0]))
    np.testing.assert_array_equal(ladder.of_A, [0, 0, 0])
    for i, turn in enumerate((0.4, 0.5, 0.6)):
        own = fitted_weights(A[0], h, jnp.asarray(turn), 5)
        off = fitted_weights(A[0], h, jnp.asarray(0.5), 5)
        apart = np.abs(ladder.weights.predict[i] - own.predict).max()
        assert apart < (1e-14 if i == 1 else 0.1 * np.abs(off.predict - own.predict).max())


def test_first_steps_end_where_regular_steps_know_regular_points():
    for order in (3, 6):
        steps = first_steps(order)
        np.testing.assert_array_equal(steps.ends[steps.regular], np.arange(1, order))
        assert all(abs(length * points[-1]) <= order for length, points in steps.kinds)


def test_turn_is_bounded():
    found = turn_of(jnp.array([-100.0, 1e5]), jnp.asarray(1e-3))
    np.testing.assert_allclose(found, [0.1, 2.0], rtol=1e-15)


def test_reverse_gradient_by_blocks():
    """Of the state at the end by start and stiffness, through the linearisations too, against central
    differences."""

    @jax.jit
    def end(x):
        speeds = jnp.linspace(0.0, 8.0, 3)
        A = jax.vmap(linear)(speeds) * x
        ladder = Ladder.of(speeds, A, jnp.asarray(0.02), 4)

        def f(t, y):
            return field(t, y) + (x - 1) * linear(speed(t, y)) @ y

        first, history = begin(f, ladder, jnp.zeros(()), x * jnp.array([0.1, 0.5, 0.0]))
        ys, _ = run_blocks(f, ladder, speed, 0.06, 3, 8, first[-1], history)
        return jnp.sum(ys[-1] * jnp.arange(1.0, 4.0))

    step = 1e-5
    central = (end(1 + step) - end(1 - step)) / (2 * step)
    np.testing.assert_allclose(jax.jit(jax.grad(end))(1.0), central, rtol=1e-6)
    np.testing.assert_allclose(
        jax.jit(lambda x: jax.jvp(end, (x,), (1.0,))[1])(1.0), central, rtol=1e-6
    )


def test_a_block_holds_a_history():
    ladder = Ladder.of(jnp.zeros(1), linear(0.0)[None], jnp.asarray(0.01), 4)
    history = History(jnp.zeros((4, 3)), jnp.zeros((4, 3)))
    with pytest.raises(ValueError, match="at least 4 steps long, but is 3"):
        run_blocks(field, ladder, speed, 0.0, 1, 3, jnp.zeros(3), history)
