"""Periodic motions of a rotor with a finite-element shaft, beside SciPy's integration of its field."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxrotor as jr
from jaxrotor.core.quick import quickly_compiled
from jaxrotor.core.threads import one_thread
from jaxrotor.machine.field import n_free, relative_field
from jaxrotor.machine.system import assemble
from jaxrotor.periodic import harmonic_balance
from jaxrotor.periodic.floquet import _scale
from jaxrotor.simulation.state import to_flat

SPEED = 255.0


@pytest.fixture(scope="module")
def machine():
    """A disc in a ring on a shaft, on supports of two stiffnesses: its orbit is an ellipse that touches twice
    a turn."""
    shaft = jr.FiniteElementShaft(0.3, 0.02, elements=1, rayleigh=(0.0, 2e-5))
    support = jr.LinearSupport([1e6, 1.5e6, 0.0, 0.0, 0.0, 0.0], [60.0] * 2 + [0.0] * 4)
    end = jr.Rotor(mass=0.3, polar_inertia=5e-5, transverse_inertia=1e-4)
    disc = jr.Rotor(3.0, 0.012, 0.007, unbalance=jr.Unbalance(2e-4))
    ring = jr.Rub(gap=6e-4, stiffness=2e5, radius=0.05, friction=0.02, smoothing=3e-4)
    stations = {"left": end, "shaft 1": shaft, "disc": disc, "shaft 2": shaft, "right": end}
    return jr.Machine.in_line(
        stations,
        attachments={"b1": (support, "left"), "b2": (support, "right"), "ring": (ring, "disc")},
        fixed={"left": ("z",), "disc": ("z",), "right": ("z", "psi", "theta")},
        prescribed={"left": {"phi": jr.ConstantSpeed(SPEED)}},
    )


@pytest.fixture(scope="module")
def motion(machine):
    return harmonic_balance(machine, SPEED, harmonics=9, samples=64)


@pytest.fixture(scope="module")
def field_and_slope(machine):
    """dy/dt and its Jacobian, rates in parts of the speed."""
    system, zero = assemble(machine), jnp.zeros(())
    n = n_free(system)
    scale = jnp.concatenate([jnp.ones(n), jnp.full(n, SPEED)])

    def field(t, x):
        y = x * scale
        return relative_field(zero, y, system, (SPEED * t, jnp.asarray(SPEED), zero)) / scale

    @quickly_compiled
    def slope(t, x):
        columns = jax.vmap(lambda d: jax.jvp(lambda x: field(t, x), (x,), (d,))[1])(jnp.eye(2 * n))
        return columns.T

    def numbers(function):
        # one type for Python's times and NumPy's, for which there would be two programs
        return lambda t, x: np.asarray(function(np.float64(t), np.asarray(x)))

    return numbers(quickly_compiled(field)), numbers(slope), scale


@pytest.fixture(scope="module")
def turn(machine, motion, field_and_slope):
    """A turn from the motion's state at phi = 0, by SciPy's Radau."""
    field, slope, scale = field_and_slope
    spin = (jnp.zeros(()), jnp.asarray(SPEED), jnp.zeros(()))
    start = to_flat(motion.state, assemble(machine), spin) / scale
    return solve_ivp(
        field,
        (0.0, 2 * np.pi / SPEED),
        np.asarray(start),
        "Radau",
        jac=slope,
        rtol=1e-9,
        atol=1e-13,
        dense_output=True,
    )


def test_a_run_of_another_program_comes_back_after_a_turn(turn):
    missed = turn.y[:, -1] - turn.y[:, 0]
    assert np.abs(missed).max() < 1e-7 * np.abs(turn.y[:, 0]).max()


@one_thread
def test_multipliers_are_those_of_the_variational_equation_along_that_run(
    motion, turn, field_and_slope
):
    """By collocation of Radau IIA, of fifth order (Hairer & Wanner, Solving ODEs II, IV.5)."""
    _, slope, _ = field_and_slope
    nodes = np.array([4 - np.sqrt(6.0), 4 + np.sqrt(6.0), 10.0]) / 10
    powers = np.arange(1, 4)
    weights = (nodes[:, None] ** powers / powers) @ np.linalg.inv(np.vander(nodes, increasing=True))
    d, steps = len(turn.y), 100
    h, product, rows = (
        2 * np.pi / SPEED / steps,
        np.eye(d),
        [slice(i * d, i * d + d) for i in range(3)],
    )
    for k in range(steps):
        matrix = np.eye(3 * d)
        for j, t in enumerate((k + nodes) * h):
            J = slope(t, turn.sol(t))
            for i in range(3):
                matrix[rows[i], rows[j]] -= h * weights[i, j] * J
        product = np.linalg.solve(matrix, np.tile(product, (3, 1)))[rows[2]]
    own = np.linalg.eigvals(product)
    found = np.asarray(motion.multipliers)
    large = found[abs(found) > 0.7]
    assert len(large) >= 4
    for value in large:
        assert np.abs(own - value).min() < 1e-6


def test_balanced_states_have_the_norm_of_their_fastest_rate():
    """Of beads on a string with rotations a thousand times as large in other units."""
    stiffness = 2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    units = np.array([1.0, 1e-3, 1.0, 1e-3, 1.0])
    stiffness = 1e8 * stiffness * units / units[:, None]
    J = np.block([[np.zeros((5, 5)), np.eye(5)], [-stiffness, np.zeros((5, 5))]])
    scale = np.asarray(_scale(jnp.asarray(J)))
    own = np.abs(J * scale / scale[:, None]).sum(axis=1).max()
    assert own < 2.5 * np.abs(np.linalg.eigvals(J)).max()
