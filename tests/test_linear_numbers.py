"""Linear analysis where no derivative is asked: matrices from one small program, the rest in NumPy. The same
as under a trace; oracles beside: closed forms, central differences, a table by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.linear import over_speed
from jaxrotor.linear.coordinates import coordinate_order, internal_order
from jaxrotor.linear.degree import degree
from jaxrotor.linear.linearise import models_at

SPEEDS = np.linspace(20.0, 400.0, 8)
OUTPUTS = ("disc.x", "bearing.force.y")


def overhung(stiffness=1e6, eccentricity=1e-4):
    """A disc on a shaft of finite elements, bent by its weight, on unequal supports."""
    return jr.Machine(
        {
            "disc": jr.Rotor(8.0, 0.1, 0.06, unbalance=jr.Unbalance(eccentricity, 0.3, 0.01)),
            "shaft": jr.FiniteElementShaft(0.4, 0.03, elements=2, rayleigh=(0.0, 1e-5)),
            "end": jr.Node(),
            "bearing": jr.LinearSupport(
                jnp.stack([stiffness, 0.7 * stiffness, 1e6, 2e4, 2e4, 0.0]),
                [300.0] * 3 + [5.0, 5.0, 0.0],
            ),
        },
        {"shaft": ("disc", "end"), "bearing": "end"},
        (0.0, -9.81, 0.0),
    )


def tabled():
    """A mass on supports whose table has a bump of two points, at 200 and 210 rad/s."""
    speeds = [0.0, 100.0, 190.0, 200.0, 210.0, 220.0, 400.0]
    k = np.array([1e5, 1e5, 1e5, 9e5, 9e5, 1e5, 1e5])
    stiffness = np.stack([k, 2 * k, 50 * k, k, k, 0 * k], axis=1)
    return jr.Machine(
        {
            "mass": jr.Rotor(4.0, 0.02, 0.01),
            "table": jr.SpeedDependentSupport(speeds, stiffness, 0 * stiffness),
        },
        {"table": "mass"},
    ), (np.array(speeds), k)


@jax.jit
def traced(stiffness, eccentricity, speeds):
    """What a trace gives: matrices at one speed, responses, critical speeds."""
    machine = overhung(stiffness, eccentricity)
    return (
        jr.linearize(machine, speeds[0]),
        jr.unbalance_response(machine, OUTPUTS, speeds).values,
        jr.critical_speeds(machine, count=2),
    )


def test_the_same_as_under_a_trace():
    """Matrices to 1e-12 of the largest in a row, responses and critical speeds to 1e-9."""
    model, response, critical = traced(jnp.asarray(1e6), jnp.asarray(1e-4), jnp.asarray(SPEEDS))
    machine = overhung()
    mine = jr.linearize(machine, SPEEDS[0])
    for name in ("M", "K", "A", "B"):
        found, expected = np.asarray(getattr(mine, name)), np.asarray(getattr(model, name))
        assert np.all(np.abs(found - expected) <= 1e-12 * np.abs(expected).max(1, keepdims=True))
    for one, other in zip(jax.tree.leaves(mine.state), jax.tree.leaves(model.state)):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-15)
    assert np.abs(mine.state.position).max() > 1e-4  # it hangs
    found = np.asarray(jr.unbalance_response(machine, OUTPUTS, SPEEDS).values)
    np.testing.assert_allclose(found, response, rtol=1e-9, atol=0)
    np.testing.assert_allclose(jr.critical_speeds(machine, count=2), critical, rtol=1e-11)


def test_derivatives_are_those_of_the_numbers():
    """What is traced against central differences of what is not: a disc on springs."""

    def found(stiffness):
        machine = jr.Machine(
            {
                "mass": jr.Rotor(4.0, 0.02, 0.01, unbalance=jr.Unbalance(1e-5)),
                "springs": jr.LinearSupport(
                    jnp.stack([stiffness, 2 * stiffness, 1e6, 1e3, 1e3, 0.0]), [50.0] * 5 + [0.0]
                ),
            },
            {"springs": "mass"},
            (0.0, -9.81, 0.0),
        )
        model = jr.linearize(machine, 300.0)
        response = jr.unbalance_response(machine, "mass.x", [300.0, 470.0], at="undeformed")
        return jnp.append(response.magnitude[:, 0], model.natural_frequencies[0])

    at, step = 1e6, 10.0
    expected = (found(at + step) - found(at - step)) / (2 * step)
    np.testing.assert_allclose(jax.jacrev(found)(jnp.asarray(at)), expected, rtol=1e-7)


def test_polynomials_between_a_few_speeds(monkeypatch):
    """The matrices at many speeds are those at each."""
    machine, calls = overhung(), []
    steady = over_speed.steady
    monkeypatch.setattr(over_speed, "steady", lambda *x: calls.append(x[1]) or steady(*x))
    found = jr.campbell(machine, SPEEDS, 4)
    assert len(calls) == 4  # three nodes and a test, for eight speeds
    for speed, row in zip(SPEEDS, found.eigenvalues):
        expected = np.array([m.eigenvalue for m in jr.modes(jr.linearize(machine, speed), 8)])
        assert all(np.min(np.abs(expected - x)) < 1e-9 * abs(x) for x in row)


def test_a_bump_in_a_table_is_not_stepped_over():
    """Frequencies at the table's own speeds are those of a mass on its springs, at the bump too."""
    machine, (speeds, k) = tabled()
    found = jr.campbell(machine, speeds, 2, at="undeformed").frequencies
    for row, stiffness in zip(found, k):
        expected = np.sqrt(stiffness * np.array([1.0, 2.0]) / 4.0)
        np.testing.assert_allclose(np.sort(row), expected, rtol=1e-12)


def test_tables_of_supports_are_taken_apart():
    """Of matrices between a few speeds, forward and backward: as at each, to rounding. Where weight or the
    damping of the spin bends the machine, a table moves its state, and each speed counts for itself."""
    speeds, draw = np.array([0.0, 150.0, 250.0, 500.0]), np.random.default_rng(0)
    stiffness = 1e5 * (5 * np.eye(6) + draw.uniform(-1, 1, (4, 6, 6)))
    damping = 1e2 * (5 * np.eye(6) + draw.uniform(-1, 1, (4, 6, 6)))
    for gravity, drag in ((0.0, 1.0), (-9.81, 0.0), (0.0, 0.0)):
        damping[:, :, 5] *= drag
        machine = jr.Machine(
            {
                "disc": jr.Rotor(8.0, 0.1, 0.06),
                "shaft": jr.FiniteElementShaft(0.4, 0.03),
                "end": jr.Node(),
                "table": jr.SpeedDependentSupport(speeds, stiffness, damping),
                "diagonal": jr.SpeedDependentSupport(
                    speeds[:2], stiffness[:2, 0], 0 * stiffness[:2, 0]
                ),
            },
            {"shaft": ("disc", "end"), "table": "end", "diagonal": "disc"},
            (0.0, gravity, 0.0),
        )
        for at in ("undeformed", "equilibrium"):
            over = over_speed.OverSpeed(machine, np.linspace(-400.0, 400.0, 9), at)
            assert (over.nodes is not None) == (at == "undeformed" or not (gravity or drag))
            each = models_at(machine, at)
            assert np.abs(each(100.0).K - each(-100.0).K).max() > 1e4
            for speed in (-333.0, 77.0, 201.0, 399.0):
                A, _ = over.rates(speed)
                order = coordinate_order(machine)[2]
                whole = internal_order(order, len(A))
                expected = each(speed).A
                size = np.abs(expected).sum(1, keepdims=True)
                assert np.abs((A[np.ix_(whole, whole)] - expected) / size).max() < 1e-14
                found = over(speed)
                np.testing.assert_array_equal(found.at.A, A)
                pull = found.M @ A[len(order) : 2 * len(order)]
                np.testing.assert_allclose(
                    found.at.pull[:, : len(order)],
                    pull[:, : len(order)],
                    rtol=0,
                    atol=1e-8 * abs(pull).max(),
                )


def test_degrees():
    """Of polynomials written out, of what is none, and through calls and linear solves."""

    def told(function, *given):
        return degree(function, [jnp.full(3, 0.5)] * len(given), given)

    assert told(lambda w, x: w**3 * x + jnp.sin(x) * w, 1, 0) == 3
    assert told(lambda w, x: (w @ w) * (w + x) - w / x, 1, 0) == 3
    assert told(lambda w, x: jnp.where(x > 0, w, w * w), 1, 0) == 2
    assert told(lambda w, x: jax.jit(lambda w: w[:2] * w[1])(w), 1, 0) == 2
    assert told(lambda w, x: jnp.linalg.solve(jnp.diag(x), w * w), 1, 0) == 2
    assert told(lambda w, x: jnp.zeros(4).at[1:].add(w), 1, 0) == 1
    assert told(lambda w, x: jnp.cos(x), 1, 0) == 0
    for other in (
        lambda w, x: jnp.tanh(w),
        lambda w, x: x / w,
        lambda w, x: jnp.where(w > 0, x, w),
        lambda w, x: jnp.abs(w),
        lambda w, x: jnp.linalg.solve(jnp.diag(w), x),
        lambda w, x: jnp.interp(w, x, x),
        lambda w, x: jax.lax.fori_loop(0, 3, lambda _, y: y * w, x),
    ):
        assert told(other, 1, 0) == np.inf


@pytest.mark.filterwarnings("ignore:the response to order")
def test_at_an_undamped_frequency():
    """A mass on springs, `x = e w² / (k/m - w²)`: inf at the root itself, the closed form a hair beside."""
    machine = jr.Machine(
        {
            "mass": jr.Rotor(4.0, 0.02, 0.01, unbalance=jr.Unbalance(1e-5)),
            "springs": jr.LinearSupport([1e6] * 5 + [0.0], [0.0] * 6),
        },
        {"springs": "mass"},
    )
    root = 500.0
    speeds = root * np.array([1e-3, 0.5, 1 - 1e-6, 1.0, 1 + 1e-6, 2.0])
    found = np.asarray(jr.unbalance_response(machine, "mass.x", speeds, at="undeformed").values)[
        :, 0
    ]
    assert np.isinf(found[3])
    apart = np.arange(6) != 3
    expected = 1e-5 * speeds**2 / (root**2 - speeds**2 + (speeds == root))
    np.testing.assert_allclose(found[apart], expected[apart], rtol=1e-9)
