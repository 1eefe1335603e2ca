"""Periodic motions by harmonic balance: closed forms, other methods, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

import jaxrotor as jr
from jaxrotor.periodic import continuation, harmonic_balance

MASS, ECCENTRICITY, STIFFNESS, DAMPING = 2.0, 1e-4, 2e5, 20.0
GAP, CONTACT = 1.5e-3, 1e6


def rotor(friction=0.0, gap=GAP, stiffness=(STIFFNESS, STIFFNESS), contact=CONTACT):
    """A Jeffcott rotor in a ring."""
    spring = jr.LinearSupport([*stiffness, 0.0, 0.0, 0.0, 0.0], [DAMPING] * 2 + [0.0] * 4)
    rub = jr.Rub(gap=gap, stiffness=contact, radius=0.05, friction=friction)
    return jr.Machine.in_line(
        {"disc": jr.Rotor(MASS, 0.01, 0.006, unbalance=jr.Unbalance(ECCENTRICITY))},
        attachments={"spring": (spring, "disc"), "rub": (rub, "disc")},
        fixed={"disc": ("z", "psi", "theta")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(330.0)}},
    )


class Rubbing:
    """Synchronous full annular rub, r the radius: in the turning frame the motion stands still, so that balance
    is a quadratic in r and stability that of a constant matrix. (Jiang & Ulbrich, Nonlinear Dynamics 24 (2001)
    269; von Groll & Ewins, J. Sound Vib. 241 (2001) 223.)"""

    def __init__(self, friction):
        self.push = CONTACT * (1 + 1j * friction)

    def quadratic(self, w):
        own = STIFFNESS - MASS * w**2 + 1j * DAMPING * w + self.push
        force = MASS * ECCENTRICITY * w**2
        return (
            abs(own) ** 2,
            (own * np.conj(self.push)).real * GAP,
            abs(self.push) ** 2 * GAP**2 - force**2,
        )

    def fold(self, low, high):
        def discriminant(w):
            a, b, c = self.quadratic(w)
            return b**2 / (a * c) - 1

        return brentq(discriminant, low, high, xtol=1e-12)

    def radii(self, w):
        a, b, c = self.quadratic(w)
        return (b + np.sqrt(b**2 - a * c) * np.array([1, -1])) / a

    def multipliers(self, w, r):
        def matrix(z):  # of a factor of a deviation, on (real, imaginary)
            return np.array([[z.real, -z.imag], [z.imag, z.real]])

        touch = matrix(self.push + 0j) @ np.diag([1.0, 1 - GAP / r])
        K = matrix(STIFFNESS - MASS * w**2 + 1j * DAMPING * w) + touch
        C = matrix(DAMPING + 2j * MASS * w)
        A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K / MASS, -C / MASS]])
        return np.exp(np.linalg.eigvals(A) * 2 * np.pi / w)


def by_size(values):
    values = np.asarray(values)
    return values[np.lexsort((np.round(values.imag, 9), np.round(abs(values), 9)))]


def test_without_contact_it_is_the_linear_response_and_its_modes():
    machine = rotor(gap=1.0, stiffness=(STIFFNESS, 1.5 * STIFFNESS))
    motion = harmonic_balance(machine, 330.0)
    linear = jr.unbalance_response(machine, ["disc.x", "disc.y"], [330.0]).values[0]
    for place, value in zip(("disc.x", "disc.y"), linear):
        np.testing.assert_allclose(motion.harmonics(place)[1], value, rtol=1e-11)
        np.testing.assert_allclose(motion.amplitude(place), abs(value), rtol=1e-11)
    own = np.exp(np.asarray(jr.linearize(machine, 330.0).eigenvalues) * 2 * np.pi / 330.0)
    np.testing.assert_allclose(by_size(motion.multipliers), by_size(own), rtol=1e-11)
    assert motion.stable


@pytest.fixture(scope="module")
def smooth():
    return continuation(rotor(), (250.0, 800.0))


@pytest.fixture(scope="module")
def rough():
    return continuation(rotor(friction=0.1), (250.0, 800.0))


def test_folds_of_a_rubbing_rotor_are_where_the_closed_form_has_them(smooth, rough):
    upper, corner = smooth.special
    assert [p.kind for p in smooth.special] == ["fold", "fold"]
    assert upper.speed == pytest.approx(Rubbing(0.0).fold(600.0, 750.0), rel=1e-9)
    # where contact ends: the linear response, falling, is as wide as the gap
    touch = brentq(lambda w: linear_radius(w) - GAP, 318.0, 400.0, xtol=1e-12)
    assert corner.speed == pytest.approx(touch, rel=1e-6)
    folds = [p for p in rough.special if p.kind == "fold"]
    assert folds[0].speed == pytest.approx(Rubbing(0.1).fold(380.0, 450.0), rel=1e-9)
    assert rough.speeds[-1] == smooth.speeds[-1] == 800.0


def linear_radius(w):
    return MASS * ECCENTRICITY * w**2 / abs(STIFFNESS - MASS * w**2 + 1j * DAMPING * w)


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_all_points_and_multipliers_meet_the_closed_form(friction, smooth, rough):
    branch, closed = (rough if friction else smooth), Rubbing(friction)
    touching = 0
    for i in range(0, len(branch), 7):
        w, r = branch.speeds[i], branch.amplitude("disc.x")[i]
        if r < GAP * (1 + 1e-6):
            continue
        touching += 1
        near = min(closed.radii(w), key=lambda own: abs(own - r))
        assert r == pytest.approx(near, rel=1e-7)
        found = by_size(branch.multipliers[i])
        np.testing.assert_allclose(found, by_size(closed.multipliers(w, near)), rtol=1e-8)
    assert touching > 10
