"""Unbalance in the words of balancing, against the sums over point masses."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr

BODY = dict(mass=8.0, polar_inertia=0.05, transverse_inertia=0.08)
DISC = dict(mass=8.0, polar_inertia=0.09, transverse_inertia=0.05)
# kg, m, rad, m
MASSES = [(0.02, 0.1, 0.3, 0.05), (0.01, 0.12, 2.0, -0.03), (0.03, 0.08, -1.0, 0.01)]


@pytest.mark.parametrize("body", [BODY, DISC])
def test_from_masses(body):
    """Mass centre and products of inertia are those of the masses."""
    rotor = jr.Rotor(**body, unbalance=jr.Unbalance.from_masses(MASSES, **body))
    m, r, angle, z = np.array(MASSES).T
    x, y = r * np.cos(angle), r * np.sin(angle)
    centre = np.array([np.sum(m * x), np.sum(m * y), 0.0]) / body["mass"]
    np.testing.assert_allclose(rotor.mass_centre(), centre, atol=1e-12)
    tensor = np.asarray(rotor.tensor())
    np.testing.assert_allclose(
        [tensor[0, 2], tensor[1, 2]], [-np.sum(m * x * z), -np.sum(m * y * z)], rtol=1e-10
    )
    planes = [(mk * rk, ak, zk) for mk, rk, ak, zk in MASSES]
    same = jr.Unbalance.from_planes(planes, **body)
    np.testing.assert_array_equal(same.inclination, rotor.unbalance.inclination)


def test_static_or_moment_alone():
    """One plane at the centre has no moment; a couple no resultant. Derivatives stay finite there."""
    static = jr.Unbalance.from_planes([(2e-4, 0.7, 0.0)], **BODY)
    assert float(static.eccentricity) == pytest.approx(2e-4 / 8)
    assert float(static.angle) == pytest.approx(0.7)
    assert float(static.inclination) == 0.0
    couple = [(2e-4, 0.7, 0.1), (2e-4, 0.7 + np.pi, -0.1)]
    dynamic = jr.Unbalance.from_planes(couple, **BODY)
    assert float(dynamic.eccentricity) < 1e-18
    product = 0.5 * (0.08 - 0.05) * np.sin(2 * float(dynamic.inclination))
    assert product == pytest.approx(2 * 2e-4 * 0.1, rel=1e-12)

    def inclination(amount):
        return jr.Unbalance.from_planes(
            [(amount, 0.7, 0.1), (2e-4, -2.4, -0.1)], **BODY
        ).inclination

    h = 1e-7
    slope = (inclination(2e-4 + h) - inclination(2e-4 - h)) / (2 * h)
    assert float(jax.grad(inclination)(2e-4)) == pytest.approx(float(slope), rel=1e-6)
    assert float(jax.jacfwd(inclination)(2e-4)) == pytest.approx(float(slope), rel=1e-6)
    at_zero = jax.jacrev(lambda u: jr.Unbalance.from_planes([(u, 0.7, 0.1)], **BODY).eccentricity)
    assert np.isfinite(float(at_zero(jnp.asarray(0.0))))


def test_from_grade():
    """ISO 21940-11: G 6.3 at 3000 rpm permits 20 g·mm/kg (6.3/314.159 mm)."""
    unbalance = jr.Unbalance.from_grade(6.3, 3000 * np.pi / 30, angle=0.5)
    assert float(unbalance.eccentricity) == pytest.approx(20.05e-6, rel=1e-3)
    assert float(unbalance.angle) == 0.5
    with pytest.raises(jr.InputError, match="speed must be positive and finite, but is 0"):
        jr.Unbalance.from_grade(6.3, 0.0)


def test_more_than_a_body_can_have():
    with pytest.raises(jr.InputError, match="check the amounts .kg.m, not g.mm. and the inertias"):
        jr.Unbalance.from_planes([(200.0, 0.0, 0.1)], **BODY)
    ball = dict(mass=8.0, polar_inertia=0.05, transverse_inertia=0.05)
    with pytest.raises(jr.InputError, match="principal inertias differ by 0 kg.m"):
        jr.Unbalance.from_planes([(1e-4, 0.0, 0.1)], **ball)
    assert float(jr.Unbalance.from_planes([(1e-4, 0.0, 0.0)], **ball).inclination) == 0.0
