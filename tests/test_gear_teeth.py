"""Teeth by geometry: form, compliance, contact, stiffness over the engagement; ISO 6336, ROSS, envelopes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree

import jaxrotor as jr
from jaxrotor.elements import GearPair
from jaxrotor.elements.couplings.gear_pair import _loaded, harmonics_of
from jaxrotor.elements.couplings.tooth import bending_and_shear, cut, ring, tooth_compliance

ALPHA = np.deg2rad(20.0)


def tooth(teeth=20.0, shift=0.0, module=1.0, dedendum=1.25, corner=0.38):
    return cut(*(jnp.asarray(x, float) for x in (teeth, module, ALPHA, shift, dedendum, corner)))


def enveloped(radii, teeth, shift, dedendum=1.25, corner=0.38):
    """Half the tooth's angle at these radii, of module 1: the rack's profile is rolled along the gear, and at
    each radius the tooth is what no position of it cuts away."""
    r = teeth / 2
    depth = dedendum - shift  # of the rack's tip below the rolling line
    aside = np.pi / 4 - dedendum * np.tan(ALPHA)
    aside -= corner * (1 - np.sin(ALPHA)) / np.cos(ALPHA)
    round_ = np.linspace(np.pi / 2, ALPHA, 400)
    x = aside + corner * np.cos(round_)
    y = -depth + corner - corner * np.sin(round_)
    rise = np.linspace(0, 2.2, 400)
    x = np.concatenate([x, x[-1] + rise * np.tan(ALPHA)])
    y = np.concatenate([y, y[-1] + rise])
    space = np.full(len(radii), -np.inf)
    for at in np.linspace(-4, 4, 4001):
        px, py = x + at, y + r
        R, angle = np.hypot(px, py), np.arctan2(px, py) - at / r
        # where the profile runs outward; below, it cuts less than elsewhere
        k = int(np.argmin(R))
        here = np.interp(radii, R[k:], angle[k:], left=-np.inf, right=-np.inf)
        space = np.maximum(space, here)
    return np.pi / teeth - space


@pytest.mark.parametrize("teeth, shift", [(20, 0.0), (20, 0.3), (45, -0.4)])
def test_a_tooth_is_what_its_rack_leaves(teeth, shift):
    """Flank and fillet against the envelope of the rack, a ten-thousandth of a module."""
    made = tooth(teeth, shift)
    ends = np.tan(np.arccos(float(made.base) / (teeth / 2 + 1 + shift)))
    for x, y in (
        made.flank(jnp.linspace(made.first, ends, 7)),
        made.fillet(jnp.linspace(ALPHA, 1.4, 6)),
    ):
        radii = np.hypot(x, y)
        found = radii * enveloped(radii, teeth, shift)
        np.testing.assert_allclose(found, radii * np.arctan2(x, y), atol=1e-4)


def test_compliance_of_a_tooth():
    """Weber & Banaschek's formula with their rounded numbers for nu = 0.3, on a fine grid of heights."""
    made = tooth(25.0)
    u = jnp.tan(jnp.asarray(0.38))
    turn = float(u - made.half)
    height = float(made.base) / np.cos(turn)
    x1, y1 = made.fillet(jnp.linspace(jnp.pi / 2, ALPHA, 4000))
    x2, y2 = made.flank(jnp.linspace(made.first, u, 20000))
    x, y = np.concatenate([x1, x2]), np.concatenate([y1, y2])
    grid = np.linspace(y[0], height, 200001)
    thick = 2 * np.interp(grid, y, x)
    bending = np.trapezoid((height - grid) ** 2 / thick**3, grid)
    shear = np.trapezoid(1 / thick, grid)
    np.testing.assert_allclose(bending_and_shear(made, u), [bending, shear], rtol=2e-6)
    tan2, arm = np.tan(turn) ** 2, (height - y[0]) / (2 * x[0])
    theirs = 10.92 * bending + 3.1 * (1 + 0.294 * tan2) * shear
    theirs += 5.2 * arm**2 + arm + 1.4 * (1 + 0.294 * tan2)
    found = tooth_compliance(made, u, jnp.asarray(0.3), None)
    assert float(found) == pytest.approx(np.cos(turn) ** 2 * theirs, rel=0.01)


@jax.jit
def _contact(teeth, shifts):
    at = GearPair(teeth, 0.003, 0.02, profile_shifts=shifts).contact()
    return at.pressure, at.ratio, jnp.sum(at.bases) / jnp.cos(at.pressure)


def test_contact_of_shifted_gears():
    """KHK, Gear Technical Reference, table 4.3: z = 12/24, m = 3 mm, x = 0.6/0.36."""
    pressure, _, distance = _contact(jnp.array([12.0, 24.0]), jnp.array([0.6, 0.36]))
    assert np.degrees(pressure) == pytest.approx(26.0886, abs=1e-4)
    assert distance == pytest.approx(56.4999e-3, abs=1e-7)


def test_contact_ratio_in_closed_form():
    """Of tips at one module: `(sqrt(ra1² - rb1²) + sqrt(ra2² - rb2²) - a sin alpha)/p_b`."""
    z = np.array([20.0, 57.0])
    path = np.sum(np.sqrt((z / 2 + 1) ** 2 - (z / 2 * np.cos(ALPHA)) ** 2))
    path -= np.sum(z) / 2 * np.sin(ALPHA)
    _, ratio, _ = _contact(jnp.asarray(z), jnp.zeros(2))
    assert float(ratio) == pytest.approx(path / (np.pi * np.cos(ALPHA)), rel=1e-12)


@jax.jit
def _largest(teeth, shifts):
    """Of one pair at ISO's 300 N/mm, over the path of contact; and ISO's, N/m²."""
    pair = GearPair(teeth, 0.005, 0.05, profile_shifts=shifts)
    at = pair.contact()
    places = jnp.linspace(at.first, at.last, 41)[1:-1]
    force = 300e3 * pair.face_width * at.ratio
    return jnp.max(jax.lax.map(lambda s: pair._line_stiffness(force, s), places))


@pytest.mark.parametrize(
    "teeth, shifts",
    [
        ((17, 17), (0, 0)),
        ((20, 20), (0, 0)),
        ((30, 30), (0, 0)),
        ((62, 62), (0, 0)),
        ((100, 100), (0, 0)),
        ((20, 60), (0, 0)),
        ((20, 40), (0.3, 0.3)),
        ((25, 80), (0.5, 0.0)),
    ],
)
def test_a_pair_of_teeth_against_iso_6336(teeth, shifts):
    """ISO's polynomial fits Weber & Banaschek's theory; it holds equal gears to 3.5 %, others to 6 %."""
    found = float(_largest(jnp.array(teeth, float), jnp.array(shifts, float)))
    z, x = 1 / np.array(teeth, float), np.array(shifts)
    q = 0.04723 + 0.15551 * z[0] + 0.25791 * z[1] - 0.00635 * x[0] - 0.11654 * x[0] * z[0]
    q += -0.00193 * x[1] - 0.24188 * x[1] * z[1] + 0.00529 * x[0] ** 2 + 0.00182 * x[1] ** 2
    assert found * q / 1e9 == pytest.approx(1.0, abs=0.035 if teeth[0] == teeth[1] else 0.06)


# Times E and the face width: bending, shear and compression of a tooth of 62 and of 25 teeth (module 2 mm,
# 20 deg) at pressure angles, by ROSS 3.1's GearElementTVMS (`_inv_kb`, `_inv_ks`, `_inv_ka`).
ROSS = [
    (62.0, 0.277738034525382, 0.0145224006, 0.749758062, 0.0150049536),
    (62.0, 0.42672233774375, 4.25898532, 4.00335782, 0.248296541),
    (25.0, 0.134550738067833, 0.0829984779, 1.01320224, 0.00108102866),
    (25.0, 0.515420042444245, 4.76448715, 3.9195772, 0.355283939),
]


@pytest.mark.parametrize("row", ROSS)
def test_a_tooth_against_ross(row):
    """ROSS integrates in plane stress up to the height of the contact, not to where the load's line crosses
    the middle: so are the integrals here taken, over our form of the tooth."""
    teeth, angle, bending, shear, compression = row
    made = tooth(teeth)
    u = np.tan(angle)
    turn = u - float(made.half)
    x1, y1 = made.fillet(jnp.linspace(jnp.pi / 2, ALPHA, 4000))
    x2, y2 = made.flank(jnp.linspace(made.first, u, 20000))
    y, thick = np.concatenate([y1, y2[1:]]), 2 * np.concatenate([x1, x2[1:]])
    height = float(made.base) / np.cos(turn)
    arm, over = np.cos(turn) ** 2, np.trapezoid(1 / thick, y)
    found = [12 * arm * np.trapezoid((height - y) ** 2 / thick**3, y), 1.2 * 2.6 * arm * over]
    np.testing.assert_allclose(found, [bending, shear], rtol=2e-4)
    assert np.sin(turn) ** 2 * over == pytest.approx(compression, rel=2e-4)


NAMES = ("teeth", "profile_shifts", "addenda", "dedenda", "corners", "bores")
PAIR = [20.0, 43.0, 0.2, 0.1, 1.0, 0.95, 1.25, 1.3, 0.3, 0.35, 0.03, 0.05]
PAIR += [0.003, 0.03, ALPHA, 0.2, 2e11, 0.29, 0.0985, 3000.0]


def pair_of(x):
    """Every parameter that a pair has, and the force."""
    two = dict(zip(NAMES, (x[2 * k : 2 * k + 2] for k in range(6))))
    return GearPair(
        module=x[12],
        face_width=x[13],
        pressure_angle=x[14],
        helix_angle=x[15],
        youngs_modulus=x[16],
        poissons_ratio=x[17],
        centre_distance=x[18],
        **two,
    )


def test_harmonics_are_those_of_the_engagement():
    """Fourier's integrals along the path of one pair against the sum over all pairs that touch, at
    512 angles and 64 slices of the face."""
    pair = pair_of(jnp.asarray(PAIR))
    angles = 2 * np.pi * np.arange(512) / 512
    found = np.fft.rfft(pair.stiffness(3000.0, angles)) / 512
    made = pair.mesh_stiffness(3000.0, 4)
    assert float(made.mean) == pytest.approx(found[0].real, rel=1e-4)
    expected = 2 * found[1:5] / found[0].real
    np.testing.assert_allclose(
        made.amplitudes * np.exp(1j * np.asarray(made.phases)), expected, atol=2e-5
    )
    assert float(pair.overlap_ratio()) > 0.5


def test_derivatives_by_all_geometry():
    """Of mean and harmonics by every parameter: forward, reverse, differences."""

    def told(x):
        pair = pair_of(x * jnp.asarray(PAIR))
        found = harmonics_of(pair, x[19] * PAIR[19], 2)
        waves = found.amplitudes * jnp.stack([jnp.cos(found.phases), jnp.sin(found.phases)])
        return jnp.concatenate([(found.mean / 1e8)[None], waves.ravel()])

    assert_derivatives_agree(told, np.ones(20), rtol=1e-5, step=1e-5, atol=1e-7)


def test_a_ring_yields_more_the_wider_its_bore():
    """Sainsot, Velex & Duverger's four functions at h = 1.4 and 7 and a thin tooth, by hand."""
    made = tooth(62.0)
    x, y = (float(v) for v in made.root)
    t = np.arctan2(x, y)
    for h in (1.5, 5.0):
        bore = jnp.asarray(np.hypot(x, y) / h)
        L = -5.574e-5 / t**2 - 1.9986e-3 * h**2 - 2.3015e-4 * h / t + 4.7702e-3 / t
        L += 0.0271 * h + 6.8045
        with_arm = ring(made, jnp.asarray(100.0), jnp.asarray(0.0), bore)
        with_half = ring(made, jnp.asarray(50.0), jnp.asarray(0.0), bore)
        none = ring(made, jnp.asarray(0.0), jnp.asarray(0.0), bore)
        found = float(with_arm - 2 * with_half + none) / 5000.0
        assert found == pytest.approx(L, rel=1e-9)


def test_iso_6336_of_a_helical_pair():
    """By hand: z = 23/67, beta = 15 deg, solid gears of the basic rack; c' = 0.8 c'th 0.975 cos beta."""
    pair = GearPair((23, 67), 0.0025, 0.03, helix_angle=np.deg2rad(15))
    beta = np.deg2rad(15)
    base = np.arcsin(np.sin(beta) * np.cos(ALPHA))
    zn = np.array([23, 67]) / (np.cos(base) ** 2 * np.cos(beta))
    q = 0.04723 + 0.15551 / zn[0] + 0.25791 / zn[1]
    found = pair.iso_stiffness()
    single = 0.8 / q * 0.975 * np.cos(beta) * 1e9
    assert float(found.single) == pytest.approx(single, rel=1e-12)
    mesh = single * (0.75 * float(pair.contact_ratio()) + 0.25)
    assert float(found.mesh) == pytest.approx(mesh, rel=1e-12)
    # geometry's mean, in the transverse plane: without ISO's factor 0.8 from theory to what is measured
    mean = float(pair.mesh_stiffness(3e5 * 0.03, 0).mean) * np.cos(base) ** 2 / 0.03
    assert 0.8 * 0.975 * mean / mesh == pytest.approx(0.95, abs=0.05)


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(teeth=(12, 40)), "gear a must not be undercut"),
        (dict(pressure_angle=20.0), "pressure_angle must be below 0.8 rad"),
        (dict(teeth=(20, 20), addenda=(1.0, 1.9)), "must touch gear a on the involute"),
        (dict(centre_distance=0.1275), "contact ratio is 0"),
        (dict(bores=(0.01, 0.02)), "bores must be between"),
        (dict(poissons_ratio=0.5), "poissons_ratio must be below 0.5"),
        (
            dict(teeth=(20, 60), profile_shifts=(0.5, 0.0), addenda=(1.6, 1.0)),
            "gear a must have tips of some width",
        ),
    ],
)
def test_bad_pairs(options, words):
    given = dict(teeth=(40, 60), module=0.0025, face_width=0.02) | options
    with pytest.raises(jr.InputError, match=words):
        GearPair(**given).mesh_stiffness(1000.0)


def relieved(**changed):
    given = dict(module=0.003, tip_reliefs=(20e-6, 15e-6), relief_lengths=(2e-3, 1.5e-3))
    return GearPair((28, 35), face_width=0.03, helix_angle=0.1, **given | changed)


def test_transmission_error_under_load():
    """The approach at which the pairs bear the force between them, by bisection with a hundred times as many
    slices. (Stiffness steps by whole slices as relieved flanks touch: no better than 1 in 100.)"""
    pair = relieved()
    force = 4000.0
    found = pair.loaded(force, 16)
    meet = jax.tree.map(np.asarray, pair.contact())
    at = np.linspace(meet.first, meet.last, 4001)
    line = np.asarray(pair.pair_stiffness(force, at))
    relief = 20e-6 * np.clip((at - meet.last) / 2e-3 + 1, 0, None)
    relief += 15e-6 * np.clip((meet.first - at) / 1.5e-3 + 1, 0, None)
    w = ((np.arange(6400) + 0.5) / 6400 - 0.5) * 0.03
    for k in (0, 5, 11):
        places = w[:, None] * np.tan(meet.base_helix) + meet.base_pitch * (
            float(found.angles[k]) / (2 * np.pi) + np.arange(-4, 5)
        )
        inside = (places >= meet.first) & (places <= meet.last)
        c, g = (np.interp(places[inside], at, y) for y in (line, relief))
        c = c * 0.03 / 6400 / np.cos(meet.base_helix)
        low, high = 0.0, 1e-3
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if c @ np.maximum(middle - g, 0) < force else (low, middle)
        assert float(found.transmission_error[k]) == pytest.approx(low, rel=1e-4)
        assert float(found.stiffness[k]) == pytest.approx(np.sum(c[g < low]), rel=1e-2)


def test_without_relief_the_error_is_force_over_stiffness():
    pair = relieved(tip_reliefs=None, relief_lengths=None)
    found = pair.loaded(4000.0, 32)
    expected = 4000.0 / np.asarray(pair.stiffness(4000.0, found.angles))
    np.testing.assert_allclose(found.transmission_error, expected, rtol=1e-10)
    assert float(jnp.max(jnp.abs(found.error))) == 0.0


def test_derivatives_under_load():
    """Of error and stiffness, where no pair comes or goes, by relief, lengths, force and module."""
    start = np.array([20e-6, 15e-6, 2e-3, 1.5e-3, 4000.0, 0.003])

    def told(x):
        y = x * start
        pair = relieved(module=y[5], tip_reliefs=y[:2], relief_lengths=y[2:4])
        at = _loaded(pair, y[4], 2)
        return jnp.stack([at.transmission_error * 1e5, at.stiffness / 1e8])

    assert_derivatives_agree(told, np.ones(6), rtol=1e-5, step=1e-7, atol=1e-6)


def test_a_mesh_by_drawing_in_a_machine():
    """The same forces as of the `GearMesh` that it stands for, of whose harmonics the relief is a part."""
    pair = relieved()
    joined = jr.elements.InvoluteMesh(
        pair, 4000.0, 300.0, 0.4, error_amplitudes=[1e-6], error_phases=[0.2], harmonics=3
    )
    mesh = pair.gear_mesh(4000.0, 300.0, 3, None, 0.4, error_amplitudes=[1e-6], error_phases=[0.2])
    assert float(joined.ratio()) == pytest.approx(float(mesh.ratio()), rel=1e-12)
    q = jnp.array([1e-5, -2e-5, 3e-6, 1e-4, -2e-4, 0.4, 2e-5, 1e-5, 0, 2e-4, 1e-4, -0.32])
    motions = ((q[:6], 0 * q[:6]), (q[6:], 0 * q[6:]))
    for a, b in zip(joined.forces(0.0, motions, ()), mesh.forces(0.0, motions, ())):
        np.testing.assert_allclose(a, b, rtol=1e-12)
    # what the gear leads by where the teeth bear that force is what `loaded` says
    at = pair.loaded(4000.0, 256)
    waves = np.fft.rfft(at.error)[1:4] / 128
    own = 1e-6 * np.exp(0.2j) * np.array([1, 0, 0])
    made = np.asarray(mesh.error_amplitudes) * np.exp(1j * np.asarray(mesh.error_phases))
    np.testing.assert_allclose(made, waves + own, atol=1e-15)
    nominal = joined.nominal().prepared()
    assert not np.any(nominal.stiffness_amplitudes) and not np.any(nominal.error_amplitudes)
