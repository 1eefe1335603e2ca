"""Periodic motions of machines of which force laws touch few coordinates: beside all unknowns at once."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.core.quick import quickly_compiled
from jaxrotor.machine.field import n_free
from jaxrotor.machine.system import assemble
from jaxrotor.periodic import harmonic_balance
from jaxrotor.periodic.balance import left_over
from jaxrotor.periodic.described import unknowns
from jaxrotor.periodic.floquet import _moments, _scale, monodromy
from jaxrotor.periodic.touched import touched_by_laws
from jaxrotor.periodic.waves import Waves


@pytest.fixture(scope="module")
def machine():
    """A disc between a film and a spring, which rubs, of 16 free coordinates."""

    def journal():
        return jr.Rotor(mass=0.4, polar_inertia=5e-5, transverse_inertia=1e-4)

    def shaft():
        return jr.Shaft(length=0.25, diameter=0.022, rayleigh=(0.0, 2e-5))

    film = jr.JournalBearing(diameter=0.03, length=0.012, clearance=1.5e-4, viscosity=0.04)
    disc = jr.Rotor(4.0, 0.012, 0.007, unbalance=jr.Unbalance(1e-4))
    spring = jr.LinearSupport([2e6, 3e6, 0.0, 0.0, 0.0, 0.0], [300.0] * 2 + [0.0] * 4)
    rub = jr.Rub(gap=1e-4, stiffness=1e5, radius=0.05, friction=0.05, smoothing=5e-5)
    return jr.Machine.in_line(
        {
            "left": journal(),
            "shaft 1": shaft(),
            "disc": disc,
            "shaft 2": shaft(),
            "right": journal(),
        },
        attachments={"f1": (film, "left"), "spring": (spring, "right"), "rub": (rub, "disc")},
        gravity=(0.0, -9.81, 0.0),
        fixed={"left": ("z",)},
        prescribed={"left": {"phi": jr.ConstantSpeed(330.0)}},
    )


def test_a_motion_and_its_multipliers_are_those_of_all_unknowns_at_once(machine):
    """What is left of the whole balance, in the motion's own accelerations, and the monodromy from the whole
    Jacobian at each instant."""
    waves, speed = Waves(3, 1, 32), 330.0
    motion = harmonic_balance(machine, speed, harmonics=3)
    system = assemble(machine)
    touched = touched_by_laws(system)
    # x and y of two stations, the disc's turning
    assert touched is not None and len(touched) == 5
    n = n_free(system)

    @quickly_compiled
    def whole(system, x):
        found = left_over(system, x, jnp.asarray(speed), waves)
        return found, monodromy(system, x, jnp.asarray(speed), waves)

    x = unknowns(system, motion, waves)
    left, turn = map(np.asarray, whole(system, x))
    own = speed**2 * np.abs(np.asarray(x))[1:, :n].max(axis=0)
    assert np.abs(left).max(axis=0) == pytest.approx(np.zeros(n), abs=1e-9 * own.max())
    values = np.linalg.eigvals(turn)
    order = np.argsort(-abs(values))
    np.testing.assert_allclose(
        abs(np.asarray(motion.multipliers)), abs(values[order]), rtol=1e-7, atol=1e-12
    )


def test_moments_of_a_step_have_its_parabola():
    """However many intervals it takes."""
    for each in (1, 2, 5):
        gauss = np.polynomial.legendre.leggauss(3)[0] / 2 + 0.5
        x = ((np.arange(each)[:, None] + gauss) / each - 0.5).ravel()
        np.testing.assert_allclose(_moments(each) @ (2 + 3 * x + 5 * x**2), [2, 3, 5], rtol=1e-12)


def test_balanced_states_have_the_norm_of_their_fastest_rate():
    """Of beads on a string with rotations a thousand times as large in other units."""
    stiffness = 2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    units = np.array([1.0, 1e-3, 1.0, 1e-3, 1.0])
    stiffness = 1e8 * stiffness * units / units[:, None]
    J = np.block([[np.zeros((5, 5)), np.eye(5)], [-stiffness, np.zeros((5, 5))]])
    scale = np.asarray(_scale(jnp.asarray(J)))
    own = np.abs(J * scale / scale[:, None]).sum(axis=1).max()
    assert own < 2.5 * np.abs(np.linalg.eigvals(J)).max()
