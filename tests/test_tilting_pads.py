"""Tilting pads: against another program, Someya's tables, and the pads' own degrees of freedom."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.core.quick import quickly_compiled

DEG, SPEED, VISCOSITY = np.pi / 180, 100 * np.pi, 0.02


def bearing(pivots, arc, preload, offset, load, clearance, **given):
    given = dict(speeds=(100.0, SPEED), frequencies=(0.5 * SPEED, SPEED)) | given
    return jr.elements.TiltingPadBearing(
        0.1,
        0.05,
        clearance,
        VISCOSITY,
        (0.0, -load),
        pads=np.array(pivots) * DEG,
        arc=arc * DEG,
        preload=preload,
        offset=offset,
        **given,
    )


# ROSS 3.1.0, TiltingPad without temperature, pads 0.02 m thick, 60 x 20 elements, 3000 rpm: eccentricity
# ratio, tilts about the back of the pads (rad), power (W); then kxx, kyy, cxx, cyy, synchronous and at half
# the speed
ROSS = [
    (
        ((270, 342, 54, 126, 198), 60, 0.5, 0.5, 5000.0, 5e-5),
        (0.3729560, (3.8879e-4, 6.4260e-4, 5.1001e-4, 1.9706e-4, 1.3625e-4), 1400.797),
        (174.510e6, 337.431e6, 620.585e3, 909.334e3),
        (220.810e6, 400.785e6, 534.447e3, 798.456e3),
    ),
    (
        ((234, 306, 18, 90, 162), 60, 0.3, 0.6, 8000.0, 7e-5),
        (0.5969727, (2.7466e-4, 9.7574e-4, 1.61952e-3, 1.28087e-3, 4.8514e-4), 1186.774),
        (256.694e6, 410.736e6, 671.317e3, 1018.217e3),
        (260.186e6, 418.923e6, 668.058e3, 1009.696e3),
    ),
]


@pytest.mark.parametrize("given, place, whole, half", ROSS)
def test_another_program(given, place, whole, half):
    """A pad on and between pads, central and offset pivots: 1 % of coefficients, each grid's own."""
    b = bearing(*given)
    point = b.working_point(SPEED)
    ratio, tilts, power = place
    assert float(point.eccentricity_ratio) == pytest.approx(ratio, rel=7e-4)
    np.testing.assert_allclose(np.asarray(point.tilts) * 0.05 / 0.07, tilts, rtol=4e-3)
    assert float(point.power) == pytest.approx(power, rel=1e-3)
    four = [x[k, k] for x in (point.stiffness, point.damping) for k in (0, 1)]
    np.testing.assert_allclose(four, whole, rtol=0.012)
    assert np.abs(point.stiffness[0, 1]) < 1e-5 * whole[0]  # pads couple nothing across
    table = b.support()
    for row, expected in ((1, whole), (0, half)):
        four = [x[1, row, k, k] for x in (table.stiffness, table.damping) for k in (0, 1)]
        np.testing.assert_allclose(four, expected, rtol=0.012)
    np.testing.assert_allclose(table.stiffness[1, 1, 1, 1], point.stiffness[1, 1], rtol=1e-9)
    same = b.synchronous()
    np.testing.assert_allclose(same.stiffness[1, 0, 0], point.stiffness[0, 0], rtol=1e-9)


def test_someyas_four_pads():
    """Databook, p. 83: load between pads, no preload, L/D = 0.5: S, eps, K, B, both alike in x and y."""
    for S, eps, K, B in (
        (1.05, 0.4, 1.68, 3.61),
        (0.550, 0.6, 2.26, 3.21),
        (0.259, 0.8, 3.15, 3.01),
        (0.103, 1.0, 4.47, 2.99),
    ):
        load = VISCOSITY * 50 * 0.05 * 0.1 * 500.0**2 / S
        point = bearing((225, 315, 45, 135), 80, 0.0, 0.5, load, 1e-4).working_point(SPEED)
        assert float(point.sommerfeld) == pytest.approx(S, rel=1e-12)
        assert float(point.eccentricity_ratio) == pytest.approx(eps, abs=0.007)
        for k in (0, 1):
            assert float(point.stiffness[k, k]) * 1e-4 / load == pytest.approx(K, rel=0.07)
            assert float(point.damping[k, k]) * 1e-4 * SPEED / load == pytest.approx(B, rel=0.04)
        assert np.all(np.asarray(point.forces)[2:] == pytest.approx(0.0, abs=1e-6 * load))


@pytest.fixture(scope="module")
def loaded():
    """Of five pads, as those above, so that nothing more is compiled."""
    return bearing(
        (234, 306, 18, 90, 162),
        60,
        0.3,
        0.5,
        1500.0,
        7e-5,
        speeds=(200.0, 400.0),
        frequencies=(0.0, 400.0),
        pad_inertia=2e-2,
    )


def test_pads_stand_where_their_forces_pass_their_pivots(loaded):
    point = loaded.working_point(400.0)
    forces, pivots = np.asarray(point.forces), np.asarray(loaded.pads)
    across = np.stack([-np.sin(pivots), np.cos(pivots)], axis=1)
    assert np.abs(np.sum(forces * across, axis=1)).max() < 1e-8 * 1500
    np.testing.assert_allclose(forces.sum(axis=0), [0.0, 1500.0], rtol=0, atol=1e-7)
    # and K over a slow motion is what a change of the load moves
    table = loaded.support()
    ends = [loaded.working_point(400.0, (0.0, -1500.0 + s)).eccentricity[1] for s in (0.5, -0.5)]
    assert float(table.stiffness[1, 0, 1, 1]) * float(ends[0] - ends[1]) == pytest.approx(
        1, rel=1e-4
    )


def test_slopes_of_a_working_point(loaded):
    """Forward, reverse, central differences, of all that is found, along one direction of nine parameters."""
    names = "diameter length clearance viscosity arc preload offset pad_inertia".split()
    values = jnp.array([0.1, 0.05, 7e-5, 0.02, 60 * DEG, 0.3, 0.55, 2e-2])

    def value(x):
        given = dict(zip(names, values * (1 + x[:8])))
        b = jr.elements.TiltingPadBearing(
            load=(300.0, -1500.0),
            speeds=loaded.speeds,
            frequencies=loaded.frequencies,
            pads=loaded.pads,
            around=24,
            along=4,
            **given,
        )
        point = b.working_point(400.0 * (1 + x[8]))
        parts = [point.stiffness / 1e8, point.damping / 1e5, point.eccentricity / 1e-4]
        parts += [point.tilts / 1e-3, point.power / 1e3]
        return sum(
            jnp.sum((1.0 + jnp.arange(p.size)) * p.ravel() * 1.3**i) for i, p in enumerate(parts)
        )

    direction = jnp.array([1.0, -0.7, 0.4, 0.3, -0.2, 0.5, 0.3, 0.6, -0.4])

    @quickly_compiled
    def every(x):
        found, forward = jax.linearize(value, x)
        (reverse,) = jax.linear_transpose(forward, x)(jnp.ones(()))
        return found, forward(direction), reverse

    h = 1e-6
    _, forward, reverse = every(jnp.zeros(9))
    ahead, behind = (float(every(s * h * direction)[0]) for s in (1, -1))
    assert float(forward) == pytest.approx((ahead - behind) / (2 * h), rel=1e-6)
    assert float(reverse @ direction) == pytest.approx(float(forward), rel=1e-8)
    assert np.all(np.abs(reverse) > 1e-4)


# --- in machines


def rotor(part):
    disc = jr.Rotor(300.0, 3.0, 2.0, jr.Unbalance(1e-5, 0.0))
    return jr.Machine({"disc": disc, "film": part}, {"film": "disc"})


def test_condensed_pads_move_the_disc_as_their_own_motion_does(loaded):
    """The disc and its five pads solved together under an unbalance, and the disc on what they leave."""
    point = loaded.working_point(400.0)
    M = np.diag([300.0, 300.0, *[2e-2] * 5])
    push = 300.0 * 1e-5 * 400.0**2 * np.array([1.0, -1j, 0, 0, 0, 0, 0])

    def response(K, C):
        n = len(K)
        return np.linalg.solve(np.asarray(K) - 400.0**2 * M[:n, :n] + 400j * C, push[:n])[:2]

    whole = response(point.full_stiffness, np.asarray(point.full_damping))
    condensed = response(point.stiffness, np.asarray(point.damping))
    np.testing.assert_allclose(condensed, whole, rtol=1e-10)


def test_each_mode_meets_the_pads_at_its_own_frequency(loaded):
    """As with the table that stands for it, which a mode leaves no trace in."""
    found, same = (
        jr.linear.matched_modes(rotor(part), 400.0, count=4) for part in (loaded, loaded.support())
    )
    assert sum(mode.damping_ratio > 0.1 for mode in found) >= 2
    for one, other in zip(found, same):
        assert one.eigenvalue == pytest.approx(other.eigenvalue, rel=1e-10)
    with pytest.raises(jr.InputError, match="`film`: .* put its `fitted"):
        jr.stability_threshold(rotor(loaded), 250.0, 350.0, 3, at="undeformed")
    assert isinstance(loaded.fitted(), jr.SpeedDependentSupport)


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(frequencies=(100.0, 50.0)), "frequencies must be two at least and increase"),
        (dict(arc=2.0), "pads must not overlap"),
        (dict(pad_inertia=-1.0), "pad_inertia must be zero or positive"),
    ],
)
def test_impossible_bearings_are_refused(loaded, change, words):
    given = {name: getattr(loaded, name) for name in ("speeds", "frequencies", "pads", "arc")}
    b = jr.elements.TiltingPadBearing(0.1, 0.05, 7e-5, 0.02, (0.0, -1e3), **given | change)
    for ask in (lambda: rotor(b), lambda: b.support(), lambda: b.working_point(SPEED)):
        with pytest.raises(jr.InputError, match=words):
            ask()
