"""Balancing: a published example, and machines balanced by what was found."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr


def test_idn_01_two_planes():
    """Rao, Mechanical Vibrations, Example 9.2: the turbine rotor."""
    before = jr.identification.phasor([8.5, 6.5], [60, 205])
    trials = jr.identification.phasor([10.0, 12.0], [270, 180])
    after = [
        jr.identification.phasor([6.0, 4.5], [125, 230]),
        jr.identification.phasor([6.0, 10.5], [35, 160]),
    ]
    found = jr.balance(before, jr.identification.influence_coefficients(before, trials, after))
    np.testing.assert_allclose(np.abs(found.corrections), [10.0561, 5.8774], rtol=1e-4)
    angles = np.rad2deg(np.angle(found.corrections)) % 360
    np.testing.assert_allclose(angles, [325.5548, 68.2559], atol=1e-3)
    np.testing.assert_allclose(found.residual, 0, atol=1e-12)


def test_least_squares_over_two_speeds():
    """More measurements than planes: NumPy's least squares, and the scatter by trying it out."""
    rng = np.random.default_rng(0)
    C = rng.normal(size=(4, 2)) + 1j * rng.normal(size=(4, 2))
    before = rng.normal(size=4) + 1j * rng.normal(size=4)
    found = jr.balance(before, C, std=0.01)
    np.testing.assert_allclose(found.corrections, -np.linalg.lstsq(C, before, rcond=None)[0])
    noise = 0.01 * (rng.normal(size=(20000, 4)) + 1j * rng.normal(size=(20000, 4)))
    tried = np.array([jr.balance(before + e, C).corrections for e in noise[:4000]])
    np.testing.assert_allclose(tried.real.std(axis=0), found.correction_std, rtol=0.05)
    left = np.array([before + e + C @ c for e, c in zip(noise, tried)])
    np.testing.assert_allclose(
        (left - found.residual).real.std(axis=0), found.residual_std, rtol=0.05
    )
    light = jr.balance(before, C, weights=[1, 1, 1e-12, 1e-12])
    np.testing.assert_allclose(light.residual[:2], 0, atol=1e-9)


def test_modes():
    """The modal unbalance is cancelled, with the smallest corrections there are."""
    shapes = np.array([[0.4, 1.0, 0.5], [1.0, 0.1, -0.9]])
    unbalance = jr.identification.phasor([2e-4, 5e-5], [30, 200])
    found = jr.identification.modal_balance(shapes, ("a", "b", "c"), unbalance)
    np.testing.assert_allclose(shapes @ found, -unbalance, rtol=1e-12)
    null = np.linalg.svd(shapes)[2][-1]
    assert abs(null @ found) < 1e-12 * np.abs(found).max()


def test_planes_and_back():
    """`in_planes` is the inverse of `from_planes`, in both modes of differentiation."""
    inertia = (6.0, 0.03, 0.05)
    planes = jr.identification.phasor([3e-5, 5e-5], [20, 250])
    places = (-0.04, 0.07)
    made = jr.Unbalance.from_planes(
        [(abs(p), np.angle(p), z) for p, z in zip(planes, places)], *inertia
    )
    np.testing.assert_allclose(made.in_planes(places, *inertia), planes, rtol=1e-12)

    def amounts(x):
        found = jr.Unbalance(*x).in_planes(places, *inertia)
        return jnp.concatenate([found.real, found.imag])

    x = jnp.array([1e-5, 0.3, 2e-4, 1.1])
    forward, reverse = (jax.jit(way(amounts))(x) for way in (jax.jacfwd, jax.jacrev))
    np.testing.assert_allclose(forward, reverse, rtol=1e-12, atol=1e-18)
    with pytest.raises(jr.InputError, match="both planes lie at 0.1 m"):
        made.in_planes((0.1, 0.1), *inertia)


def test_balancing_refuses():
    one = jr.identification.phasor([1.0, 1.0], [0, 0])
    with pytest.raises(jr.InputError, match="one row of 2 vibrations for each of the 1 trials"):
        jr.identification.influence_coefficients(one, [1.0], [[1.0, 2.0, 3.0]])
    with pytest.raises(jr.InputError, match="trial 1 is zero"):
        jr.identification.influence_coefficients(one, [1.0, 0.0], [one, one])
    with pytest.raises(jr.InputError, match="2 measurements cannot balance 3 planes"):
        jr.balance(one, np.ones((2, 3)))
    with pytest.raises(jr.InputError, match="act alike"):
        jr.balance(one, np.ones((2, 2)))
    with pytest.raises(jr.InputError, match="need a row for each of the 2"):
        jr.balance(one, np.ones((3, 2)))
    with pytest.raises(jr.InputError, match="lie where a mode does not move"):
        jr.identification.modal_balance([[1.0, 0.0], [2.0, 0.0]], ("a", "b"), one)
    with pytest.raises(jr.InputError, match="2 modes need as many planes"):
        jr.identification.modal_balance([[1.0], [2.0]], ("a",), one)
