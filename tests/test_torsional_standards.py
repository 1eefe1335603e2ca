"""Torsional separation, life at a meeting and starts to failure: against closed forms, published
frequencies and central differences."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree

import jaxrotor as jr
from jaxrotor import standards
from jaxrotor.standards import SNCurve, TorsionalExcitation
from jaxrotor.standards.moves import Numbers, Term
from jaxrotor.standards.sensitivities import derivatives

HELD = ("x", "y", "z", "psi", "theta")
J1, J2, STIFF, DAMP = 2.0, 3.0, 8e4, 20.0
FIRST = np.sqrt(STIFF * (1 / J1 + 1 / J2))


def two_discs(k=STIFF, c=DAMP, j=J1):
    unit = jnp.array([0.0, 0, 0, 0, 0, 1])
    return jr.Machine.in_line(
        {
            "motor": jr.Rotor(1.0, j, j),
            "shaft": jr.Coupling(k * unit, c * unit),
            "fan": jr.Rotor(1.0, J2, J2),
        },
        fixed={"motor": HELD, "fan": HELD},
    )


def test_two_discs():
    """w² = k (1/J1 + 1/J2), against every excitation by hand; the limit is 10 %."""
    low, high = 150.0, 190.0
    found = standards.torsional_separation(
        two_discs(c=0.0), (low, high), line_frequency=60.0, each=True
    )
    line = 2 * np.pi * 60
    bands = [(low, high), (2 * low, 2 * high), (line, line), (2 * line, 2 * line)]
    expected = [max(1 - FIRST / a, FIRST / b - 1) for a, b in bands]
    assert [f.place.split(", ")[1] for f in found.findings] == [
        "motor 1x", "motor 2x", "line frequency", "2x line frequency",
    ]  # fmt: skip
    np.testing.assert_allclose([f.value for f in found.findings], expected, rtol=1e-9)
    assert [bool(f.met) for f in found.findings] == [e >= 0.1 for e in expected]
    near = standards.torsional_separation(two_discs(c=0.0), (low, high), line_frequency=60.0)
    assert len(near.findings) == 1 and near.findings[0].place == "torsional 1, motor 2x"
    assert float(near.findings[0].value) == pytest.approx(min(expected))
    # within the range: negative, by how far it is to the way out
    inside = standards.torsional_separation(two_discs(c=0.0), (0.8 * FIRST, 1.5 * FIRST))
    assert float(inside.findings[0].value) == pytest.approx(-0.25) and not bool(inside.met)
    # at one speed: 10 % above or below it
    for part, met in ((0.89, True), (0.91, False), (1.09, False), (1.12, True)):
        one = standards.torsional_separation(
            two_discs(c=0.0),
            (FIRST / part, FIRST / part),
            (TorsionalExcitation("motor 1x", 1.0),),
        )
        assert bool(one.met) == met
        assert float(one.findings[0].value) == pytest.approx(abs(part - 1), rel=1e-9)


def geared(wheel_radius=0.15):
    gears = {
        "motor": jr.Rotor(1.0, 4.0, 4.0),
        "s1": jr.Coupling([0] * 5 + [5e5]),
        "pinion": jr.Rotor(1.0, 0.1, 0.1),
        "mesh": jr.GearMesh((0.05, wheel_radius), jr.elements.KelvinVoigt(1e15), teeth=23.0),
        "wheel": jr.Rotor(1.0, 3.0, 3.0),
        "s2": jr.Coupling([0] * 5 + [2e6]),
        "pump": jr.Rotor(1.0, 9.0, 9.0),
    }
    return jr.Machine.in_line(gears, fixed={n: HELD for n in ("motor", "pinion", "wheel", "pump")})


def test_a_geared_line():
    """Reflected to the motor's shaft, n = 1/3: inertias and stiffness of the slow shaft by n²; three discs
    in a row. Each shaft excites at its own speed, the teeth at 23 times the pinion's."""
    n2 = (0.05 / 0.15) ** 2
    a, b, c = 4.0, 0.1 + n2 * 3.0, n2 * 9.0
    k, q = 5e5, n2 * 2e6
    half = 0.5 * (k * (1 / a + 1 / b) + q * (1 / b + 1 / c))
    root = np.sqrt(half**2 - k * q * (a + b + c) / (a * b * c))
    expected = np.sqrt([half - root, half + root])
    speeds = 190.0, 215.0
    machine = geared()
    told = standards.torsional_excitations(machine)
    assert [(e.name, e.order, e.shaft) for e in told] == [
        ("motor 1x", 1.0, "motor"), ("motor 2x", 2.0, "motor"),
        ("wheel 1x", 1.0, "wheel"), ("wheel 2x", 2.0, "wheel"), ("mesh teeth", 23.0, "pinion"),
    ]  # fmt: skip
    found = standards.torsional_separation(machine, speeds, each=True, count=2)
    own = np.array([1.0, 2.0, 1 / 3, 2 / 3, 23.0])
    margins = [
        max(1 - w / (o * speeds[0]), w / (o * speeds[1]) - 1)
        for w, o in itertools.product(expected, own)
    ]
    # the mesh, at 1e15 N/m, still yields by some 1e-7
    np.testing.assert_allclose([f.value for f in found.findings], margins, rtol=5e-7, atol=2e-7)
    assert {bool(f.met) for f in found.findings} == {True, False}


def test_five_discs_as_published():
    """TOR-01, Friswell et al. (2010), ex. 9.7.1: the separation from a shaker of 100 Hz by the frequencies as
    printed, to their digits."""
    printed = np.array([81.21, 141.21, 378.95, 536.36])
    line = {}
    for i, j in enumerate((0.0035, 0.0035, 0.0035, 0.15, 0.05)):
        line[f"disc {i}"] = jr.Rotor(1.0, j, j)
        if i < 4:
            line[f"shaft {i}"] = jr.Coupling([0] * 5 + [(12e3, 12e3, 14e3, 10e3)[i]])
    machine = jr.Machine.in_line(line, fixed={f"disc {i}": HELD for i in range(5)})
    shaker = TorsionalExcitation("shaker", frequency=2 * np.pi * 100.0)
    found = standards.torsional_separation(machine, (1.0, 1.0), (shaker,), count=4)
    np.testing.assert_allclose(
        [f.value for f in found.findings], np.abs(printed / 100 - 1), atol=0.0051 / 100
    )


# The S-N curve, and what is counted by it

CURVE = SNCurve([4e8, 2e8, 1e8], [1e3, 1e5, 1e7], ultimate=8e8)


def test_the_curve_is_straight_on_logarithmic_scales():
    assert float(CURVE.damage(4e8)) == pytest.approx(1e-3)
    assert float(CURVE.damage(np.sqrt(4e8 * 2e8))) == pytest.approx(1e-4)
    assert float(CURVE.damage(0.5e8)) == pytest.approx(1e-9)  # the last line goes on
    assert float(CURVE.damage(8e8)) == pytest.approx(1e-1)
    assert float(CURVE.damage(0.0)) == 0.0
    assert float(CURVE.damage(2e8, 4e8)) == pytest.approx(1e-3)  # Goodman: counts twice
    assert np.isinf(CURVE.damage(1.0, 8e8))
    for n in (1e2, 1e3, 1e4, 3e6, 1e9):
        assert float(1 / CURVE.damage(CURVE.allowed(n))) == pytest.approx(n, rel=1e-9)
    flat = SNCurve([4e8, 1e8], [1e3, 1e7], endless=True)
    assert float(flat.damage(0.99e8)) == 0.0 and float(flat.damage(1e8)) == pytest.approx(1e-7)
    assert float(flat.allowed(1e12)) == pytest.approx(1e8)
    slope = jax.grad(CURVE.damage)(3e8)
    h = 3e3
    assert float(slope) == pytest.approx(
        float(CURVE.damage(3e8 + h) - CURVE.damage(3e8 - h)) / (2 * h), rel=1e-6
    )


@pytest.mark.parametrize(
    "given, words",
    [
        (([1e8, 2e8], [1e3, 1e6]), "amplitudes must fall from point to point"),
        (([2e8, 1e8], [1e6, 1e3]), "cycles must rise from point to point"),
        (([2e8, 1e8], [1e3]), "cycles must be two positive numbers at least"),
        (([2e8, 1e8], [1e3, 1e4, 1e5]), "equally long, but have 2 and 3 entries"),
        (([2e8, -1e8], [1e3, 1e4]), "amplitudes must be two positive numbers"),
        (([2e8, 1e8], [1e3, 1e4], -1.0), "ultimate must be positive"),
    ],
)
def test_no_curve(given, words):
    with pytest.raises(jr.InputError, match=words):
        SNCurve(*given)


def test_starts_by_miner():
    """A swing that dies away, whose half cycles are known: each crest to the next trough; sums by hand."""
    tops = 3000.0 * 0.9 ** np.arange(40) * (-1.0) ** np.arange(40)
    history = np.r_[0.0, tops, 0.0]
    curve = SNCurve([3000.0, 1500.0], [1e3, 1e3 * 2.0**5], of="torque")
    # a history that converges closes by rainflow into halves of neighbours
    ranges = np.abs(np.diff(history))
    expected = np.sum(0.5 * (0.5 * ranges / 3000.0) ** 5 * 1e-3)
    got = standards.cycle_damage(history, curve)
    assert float(got) == pytest.approx(expected, rel=1e-3)
    found = standards.starts_allowed(history, curve, 2000.0, "shaft")
    assert float(found.findings[-1].value) == pytest.approx(1 / float(got))
    assert float(found.findings[0].value) == 3000.0
    assert bool(found.findings[-1].met) == (1 / expected >= 2000)
    none = standards.starts_allowed(np.zeros(20), curve, 10.0)
    assert np.isinf(none.findings[-1].value) and bool(none.met)
    with pytest.raises(jr.InputError, match="torque must be a list of numbers"):
        standards.cycle_damage("high", curve)


def test_a_start_resonates():
    """60 Hz, 1800 rpm, a mode of 20 Hz: 1500 rpm."""
    rpm = np.pi / 30
    assert float(
        standards.start_resonance(2 * np.pi * 20.0, 1800 * rpm, 60.0)
    ) / rpm == pytest.approx(1500.0)


def test_shear_stress():
    """16 T/(pi d³), and of a hollow shaft by the polar moment of area."""
    assert float(standards.shear_stress(1e3, 0.05)) == pytest.approx(16e3 / np.pi / 0.05**3)
    polar = np.pi / 32 * (0.05**4 - 0.03**4)
    assert float(standards.shear_stress(1e3, 0.05, 0.03, 1.7)) == pytest.approx(
        1.7 * 1e3 * 0.025 / polar
    )


# Where the separation is not met

MET = TorsionalExcitation("motor 2x", 2.0)
RANGE = 0.4 * FIRST, 0.6 * FIRST


def by_hand(w, torque=10.0, k=STIFF, c=DAMP, j=J1):
    """Amplitude in the shaft of two discs."""
    dynamic = np.array(
        [
            [k + 1j * w * c - w**2 * j, -k - 1j * w * c],
            [-k - 1j * w * c, k + 1j * w * c - w**2 * J2],
        ]
    )
    a = np.linalg.solve(dynamic, [torque, 0])
    return abs((k + 1j * w * c) * (a[1] - a[0]))


def test_torque_at_a_meeting():
    machine = two_discs()
    met = standards.torque_at_meeting(machine, MET, 10.0, "motor", "shaft", RANGE)
    assert float(met.frequency) == pytest.approx(FIRST, rel=1e-9)
    assert float(met.speed) == pytest.approx(FIRST / 2, rel=1e-9)
    assert float(met.torque) == pytest.approx(by_hand(FIRST), rel=1e-8)
    # beside the range: at its nearer end
    met = standards.torque_at_meeting(
        machine, MET, 10.0, "motor", "shaft", (0.3 * FIRST, 0.4 * FIRST)
    )
    assert float(met.torque) == pytest.approx(by_hand(0.8 * FIRST), rel=1e-8)
    curve = SNCurve([4e8, 1e8], [1e3, 1e6])
    found = standards.torsional_life(
        machine, MET, 1e4, "motor", "shaft", RANGE, curve, 1.0, diameter=0.06, concentration=1.5
    )
    stress, life = found.findings
    expected = 1.5 * 16 * by_hand(FIRST, 1e4) / (np.pi * 0.06**3)
    exponent = 3 / np.log10(4)
    cycles = 1e3 * (expected / 4e8) ** -exponent
    assert float(stress.value) == pytest.approx(expected, rel=1e-8)
    assert float(life.value) == pytest.approx(cycles / (3600 * FIRST / 2 / np.pi), rel=1e-7)
    assert bool(stress.met) == bool(life.met)

    def hours(m):
        given = (MET, 1e4, "motor", "shaft", RANGE, curve, 1.0)
        found = standards.torsional_life(m, *given, diameter=0.06, concentration=1.5)
        return float(found.findings[1].value)

    def decades(c):
        return -exponent * np.log(by_hand(FIRST, 1e4, c=c))

    # what `assess` tells of a number that is not traced
    (slopes,) = derivatives([(Term(1.0, machine, "undeformed", Numbers(hours, None)),)])
    wanted = (decades(DAMP + 1e-3) - decades(DAMP - 1e-3)) / 2e-3
    assert slopes["shaft.damping"][5] / float(life.value) == pytest.approx(wanted, rel=1e-6)
    with pytest.raises(jr.InputError, match="`shaft`: is no plain Shaft: give the diameter"):
        standards.torsional_life(machine, MET, 1e4, "motor", "shaft", RANGE, curve, 1.0)
    with pytest.raises(jr.InputError, match="mode: there are 2 torsional motions, but mode is 5"):
        standards.torque_at_meeting(machine, MET, 1.0, "motor", "shaft", RANGE, 5)


def test_gradients():
    """Margin, amplitude at the meeting and the damage of a start by stiffness, damping and inertia: forward,
    reverse and central differences."""
    curve = SNCurve([3000.0, 1500.0], [1e3, 1e5], of="torque")
    wave = jnp.asarray(np.sin(np.arange(200) * 0.4) * np.exp(-np.arange(200) / 90))

    def numbers(x):
        k, c, j = STIFF * x[0], DAMP * x[1], J1 * x[2]
        machine = two_discs(k, c, j)
        margin = standards.torsional_separation(machine, RANGE, (MET,), count=1).findings[0]
        met = standards.torque_at_meeting(machine, MET, 10.0, "motor", "shaft", RANGE)
        damage = standards.cycle_damage(25.0 * met.torque * wave, curve)
        return jnp.stack([margin.room, met.torque, jnp.log(damage)])

    slopes = assert_derivatives_agree(numbers, np.ones(3), rtol=1e-6, step=1e-4)
    # the nearer way out is upwards: w/(1.2 FIRST) - 1, and w goes with the root of the stiffness
    assert slopes[0, 0] == pytest.approx(0.5 / 1.2, rel=1e-6)
    # of which twice the exponent of the curve times the torque's
    exponent = 2 / np.log10(2)
    np.testing.assert_allclose(slopes[2], exponent * slopes[1] / by_hand(FIRST), rtol=1e-6)


def test_wrong_arguments():
    machine = two_discs()
    with pytest.raises(jr.InputError, match="speeds must be .low, high. in rad/s"):
        standards.torsional_separation(machine, (200.0, 100.0))
    with pytest.raises(jr.InputError, match="`wing 1x`: shaft: there is no station `wing`"):
        standards.torsional_separation(
            machine, (1.0, 2.0), (TorsionalExcitation("wing 1x", 1.0, "wing"),)
        )
    with pytest.raises(jr.InputError, match="`nothing`: give an order or a frequency above 0"):
        standards.torsional_separation(machine, (1.0, 2.0), (TorsionalExcitation("nothing"),))
    with pytest.raises(jr.InputError, match="there is no shaft, coupling or gear `shift`"):
        standards.torque_at_meeting(machine, MET, 1.0, "motor", "shift", RANGE)


def test_interference_diagram():
    """Two discs between 0.45 and 0.48 of their frequency, rpm and Hz: twice the speed crosses within 10 % of
    operation and gets a cross where it does, once the speed is clear; the line's frequency, at 0.95 of it,
    too near at all speeds."""
    from jaxrotor.plot import torsional_interference

    line = 0.95 * FIRST / (2 * np.pi)
    told = standards.torsional_excitations(two_discs(c=0.0), line)[:3]
    ax = torsional_interference(two_discs(c=0.0), (0.45 * FIRST, 0.48 * FIRST), told)
    hertz, rpm = FIRST / 2 / np.pi, 30 / np.pi
    marks = {
        drawn.get_label(): drawn.get_xydata() for drawn in ax.lines if drawn.get_marker() in "Xo"
    }
    np.testing.assert_allclose(
        marks["separation below 10 %"],
        [[0.5 * FIRST * rpm, hertz], [0.465 * FIRST * rpm, hertz]],
        rtol=1e-9,
    )
    assert "clear" not in marks  # once the speed meets it at twice the speeds of operation
    names = {text.get_text() for text in ax.texts}
    assert {"motor 1x", "line frequency", f"torsional 1, {hertz:.4g} Hz"} <= names
    low, high = ax.collections[1].get_paths()[0].get_extents().get_points()[:, 1]
    assert (low, high) == pytest.approx((1.8 * 0.45 * hertz, 2.2 * 0.48 * hertz))
    ax.figure.canvas.draw()
