"""Responses where an eigenvalue is met: a rotor free to turn at 0 rad/s, undamped modes at their own
frequency. Oracle: each coordinate of a disc on springs is a mass by itself, 1/(k - m w²)."""

import jax
import numpy as np
import pytest

import jaxrotor as jr

K, M, J, TILT = 1e4, 1.0, 0.02, 0.011
PLACES = ["d.x", "d.y", "d.phi"]


STIFFNESS = np.array([3 * K, K, K, 50.0, 50.0, 0.0])


def disc(k=STIFFNESS):
    return jr.Machine.in_line(
        {"d": jr.Rotor(M, J, TILT, unbalance=jr.Unbalance(1e-5))},
        attachments={"s": (jr.LinearSupport(k), "d")},
    )


@pytest.mark.filterwarnings("ignore:.*has no bound")
@pytest.mark.parametrize("kind, power", [("receptance", 0), ("mobility", 1), ("accelerance", 2)])
def test_a_rotor_free_to_turn_and_undamped_poles(kind, power):
    w = np.array([0.0, 50.0, np.sqrt(K), np.sqrt(3 * K)])
    found = np.asarray(jr.frequency_response(disc(), PLACES, PLACES, w, kind=kind).values)
    for i, stiffness in enumerate((3 * K, K)):
        met = np.isclose(w**2, stiffness)
        expected = (1j * w[~met]) ** power / (stiffness - M * w[~met] ** 2)
        np.testing.assert_allclose(found[~met, i, i], expected, rtol=1e-10, atol=1e-18)
        assert np.all(np.isinf(found[met, i, i])) and met.sum() == 1
    turning = -((1j * w[1:]) ** power) / (J * w[1:] ** 2)
    np.testing.assert_allclose(found[1:, 2, 2], turning, rtol=1e-10)
    assert (
        found[0, 2, 2] == pytest.approx(1 / J, rel=1e-10)
        if power == 2
        else np.isinf(found[0, 2, 2])
    )
    off = ~np.eye(3, dtype=bool)
    assert np.all(found[:, off] == 0)


def test_no_bound_is_said():
    words = "`d.phi` by `d.phi` at 0 rad/s has no bound, for nothing holds or damps"
    with pytest.warns(UserWarning, match=words):
        jr.frequency_response(disc(), "d.phi", "d.phi", [0.0])
    with pytest.warns(UserWarning, match="order 1 at 100 rad/s has no bound"):
        found = jr.unbalance_response(disc(), ["d.x", "d.y"], [60.0, 100.0], kind="accelerance")
    e, w = 1e-5, 60.0
    np.testing.assert_allclose(found.values[0, 0], -(w**4) * e / (3 * K - w**2), rtol=1e-10)
    assert np.isinf(found.values[1, 1])
    # x is met by no pole there
    np.testing.assert_allclose(found.values[1, 0], -1e8 * e / (3 * K - 1e4), rtol=1e-7)


def test_the_derivative_at_0_is_that_of_the_spring():
    def receptance(s):
        found = jr.frequency_response(disc(s * STIFFNESS), "d.x", "d.x", [0.0])
        return found.values[0, 0, 0].real

    assert float(jax.grad(receptance)(1.0)) == pytest.approx(-1 / (3 * K), rel=1e-9)
