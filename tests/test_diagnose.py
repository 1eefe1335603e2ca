"""Spectra, orders, orbits and sections of signals whose make-up is known."""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxrotor as jr
from jaxrotor import plot
from jaxrotor.commands.diagnostic_figures import diagnosis
from jaxrotor.diagnostics.orbit import ellipse
from jaxrotor.objectives.measure import Seen
from jaxrotor.plot.style import figure_of
from jaxrotor.study.diagnosis import KINDS, Diagnosis

RATE = 5000.0
TURN = 2 * np.pi


@pytest.fixture(autouse=True)
def closed_figures():
    yield
    plt.close("all")


def run_up(sense=1.0, start=20.0, rate=30.0, seconds=6.0):
    """Time, angle and speed of a shaft that gains `rate` rad/s²."""
    t = np.arange(int(seconds * RATE)) / RATE
    return t, sense * (start * t + rate * t**2 / 2), sense * (start + rate * t)


def steady(turns=40, samples=50):
    """Angle and sample rate of a shaft at constant speed, marks on the samples."""
    return TURN / samples * np.arange(turns * samples + 1), 50.0 * samples


# Full spectrum: circles stand apart by their sense.


@pytest.mark.parametrize("samples", [1000, 1001])
@pytest.mark.parametrize("window", ["hann", "boxcar", "flattop"])
def test_circles_of_both_senses_stand_at_their_radius(samples, window):
    t = np.arange(samples) / 1000.0
    lines = np.array([50, -20, 90]) * 1000.0 / samples  # whole periods
    z = sum(r * np.exp(1j * (TURN * f * t + 0.3)) for r, f in zip((3.0, 2.0, 0.5), lines))
    found = jr.diagnostics.full_spectrum(z.real + 7.0, z.imag - 2.0, 1000.0, window)
    for r, f in zip((3.0, 2.0, 0.5), lines):
        k = np.argmin(np.abs(found.frequency - f))
        assert found.frequency[k] == pytest.approx(f, abs=1e-9)
        assert found.amplitude[k] == pytest.approx(r, rel=1e-12)
    assert found.frequency[0] < 0 < found.frequency[-1] and np.all(np.diff(found.frequency) > 0)
    mean = found.amplitude[np.argmin(np.abs(found.frequency))]
    assert mean < 1e-12  # taken out
    assert found.peak(1.0, 400.0) == pytest.approx((lines[0], 3.0))


def test_straight_and_elliptic_motion_are_two_circles():
    t = np.arange(1000) / 1000.0
    found = jr.diagnostics.full_spectrum(4 * np.cos(TURN * 50 * t), np.sin(TURN * 50 * t), 1000.0)
    both = [found.amplitude[np.argmin(np.abs(found.frequency - f))] for f in (50, -50)]
    np.testing.assert_allclose(both, [2.5, 1.5], rtol=1e-12)  # (a + b)/2, (a - b)/2
    straight = jr.diagnostics.full_spectrum(np.cos(TURN * 50 * t), np.zeros(1000), 1000.0)
    assert straight.peak(40, 60)[1] == pytest.approx(0.5) == straight.peak(-60, -40)[1]


def test_between_lines_windows_show_as_much_as_told():
    t = np.arange(1000) / 1000.0
    z = np.exp(1j * TURN * 50.5 * t)
    worst = {
        w: jr.diagnostics.full_spectrum(z.real, z.imag, 1000.0, w).amplitude.max()
        for w in ("hann", "flattop")
    }
    assert worst["hann"] == pytest.approx(8 / (3 * np.pi), abs=1e-3)  # 1.42 dB, Harris 1978
    assert worst["flattop"] == pytest.approx(1.0, abs=1.2e-3)


# Order tracking: amplitudes and phases on a run-up, exact but for splines.


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_orders_of_a_run_up(sense):
    t, phi, speed = run_up(sense)
    signal = 2 * np.cos(phi - 0.5) + 0.7 * np.cos(2.5 * phi + 1) + 0.4 * np.cos(7 * phi) + 0.3
    found = jr.diagnostics.order_tracking(signal, phi, RATE, (1, 2.5), turns=4)
    exact = np.array([2 * np.exp(-0.5j), 0.7 * np.exp(1j)])
    np.testing.assert_allclose(found.amplitude, np.tile(exact, (len(found.time), 1)), atol=1e-8)
    np.testing.assert_allclose(found.mean, 0.3, atol=1e-9)
    # the mean speed under constant acceleration is that of the middle
    np.testing.assert_allclose(found.speed, sense * (20.0 + 30.0 * found.time), rtol=1e-10)
    np.testing.assert_allclose(found.phase[:, 0], -0.5, atol=1e-8)
    np.testing.assert_allclose(found.magnitude[:, 1], 0.7, atol=1e-8)


def test_orders_from_standstill_and_overlapping_blocks():
    t, phi, _ = run_up(start=0.0)
    signal = 2 * np.cos(phi - 0.5) + np.cos(40 * phi)
    found = jr.diagnostics.order_tracking(signal, phi, RATE, (1, 2), turns=3, every=1)
    np.testing.assert_allclose(found.amplitude[:, 0], 2 * np.exp(-0.5j), atol=2e-6)
    np.testing.assert_allclose(found.amplitude[:, 1], 0, atol=2e-6)
    assert len(found.time) == int(phi[-1] / TURN) - 2


@pytest.mark.parametrize("samples, error", [(5, 3e-4), (10, 3e-6), (20, 5e-8)])
def test_the_error_between_samples_is_as_told(samples, error):
    phi = TURN / (samples * 1.0027) * np.arange(60 * samples)
    found = jr.diagnostics.order_tracking(np.cos(phi), phi, 1000.0)
    assert 0.1 * error < np.abs(found.amplitude[1:-1] - 1).max() < error


def test_neighbouring_orders_are_told_apart_and_a_window_keeps_strangers_out():
    phi, rate = steady(80)
    signal = np.cos(phi) + 0.5 * np.cos(1.1 * phi + 0.2)
    both = jr.diagnostics.order_tracking(signal, phi, rate, (1.0, 1.1), turns=10)
    np.testing.assert_allclose(both.amplitude, np.tile([1, 0.5 * np.exp(0.2j)], (8, 1)), atol=1e-9)
    ringing = np.cos(phi) + np.cos(3.31 * phi)
    plain, hann = (
        np.abs(
            jr.diagnostics.order_tracking(ringing, phi, rate, 1.0, 8, window=w).amplitude - 1
        ).max()
        for w in ("boxcar", "hann")
    )
    assert hann < 2e-3 < 0.01 < plain


def test_tracking_and_the_domain_of_identification_agree():
    phi, rate = steady(60)
    signal = 1.5 * np.cos(phi + 0.7) + 0.2 * np.cos(2 * phi)
    t = np.arange(phi.size) / rate
    series = jr.sensors.Series(t, signal)
    compared = jr.identification.Orders((1.0,), turns=8.0).compare(
        series, lambda s: np.interp(s, t, phi), "probe"
    )
    cosine, sine = np.asarray(compared(signal)).reshape(2, -1)
    found = jr.diagnostics.order_tracking(signal, phi, rate, turns=8)
    assert np.mean(cosine + 1j * sine) == pytest.approx(found.amplitude[0, 0], rel=1e-3)


# Waterfall.


def test_waterfall_follows_the_speed():
    t, phi, speed = run_up(start=100.0, rate=40.0)
    found = jr.diagnostics.waterfall(3 * np.cos(phi) + np.cos(2 * phi), speed, RATE, segment=1000)
    assert not found.full and found.amplitude.shape == (found.time.size, found.frequency.size)
    top = found.frequency[np.argmax(found.amplitude, axis=1)]
    np.testing.assert_allclose(top, found.speed / TURN, atol=RATE / 1000 / 2 + 1e-9)
    np.testing.assert_allclose(found.speed, 100.0 + 40.0 * found.time, rtol=1e-12)
    np.testing.assert_allclose(found.along(1.0), 3.0, rtol=0.16)  # of a Hann window, and smeared
    assert np.isnan(found.along(500.0)).all()


def test_a_waterfall_at_constant_speed_is_exact_and_full_with_two_signals():
    phi, rate = steady(80)
    speed = np.full(phi.size, TURN * 50.0)
    x, y = np.cos(phi) + 2, np.sin(phi) + 0.25 * np.cos(2 * phi)
    found = jr.diagnostics.waterfall(x, speed, rate, y=y, segment=500)
    assert found.full
    np.testing.assert_allclose(found.along(1.0), 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.along(-1.0), 0.0, atol=1e-12)
    np.testing.assert_allclose(found.along(-2.0), 0.125, rtol=1e-12)
    single = jr.diagnostics.waterfall(y, speed, rate, segment=500)
    np.testing.assert_allclose(single.along(2.0), 0.25, rtol=1e-12)
    np.testing.assert_allclose(single.amplitude[:, 0], 0.0, atol=1e-12)


# Orbits.


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_ellipse_of_a_filtered_orbit(way, sense):
    """Semi-axes 3 and 1 at 30°, run through with (1) or against the shaft's rotation (-1)."""
    angle, rate = steady()
    phi = sense * angle
    # with the rotation: the ellipse's own angle grows as the shaft's does, towards +phi or -phi
    z = np.exp(1j * np.pi / 6) * (3 * np.cos(phi - 0.4) + way * 1j * np.sin(phi - 0.4))
    noise = np.exp(2j * phi) + 5.0
    found = jr.diagnostics.filtered_orbit((z + noise).real, (z + noise).imag, phi, rate, 1.0)
    one = found.ellipse()
    assert (one.major, one.minor) == pytest.approx((3.0, 1.0), abs=1e-8)
    assert one.inclination == pytest.approx(np.pi / 6, abs=1e-8)
    assert one.precession == way
    assert abs(one.forward) == pytest.approx(2.0 if way > 0 else 1.0, abs=1e-8)
    np.testing.assert_allclose(found.centre, [5.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(found.keyphasor, [[z[0].real, z[0].imag]], atol=1e-8)
    assert found.speed == pytest.approx(sense * TURN * 50.0)
    exact = np.exp(1j * np.pi / 6) * (
        3 * np.cos(found.angle - 0.4) + way * 1j * np.sin(found.angle - 0.4)
    )
    np.testing.assert_allclose(found.x + 1j * found.y, exact, atol=1e-8)


def test_a_straight_line_and_a_circle():
    line = ellipse(3.0, -4.0)
    assert line.precession == 0 and line.major == pytest.approx(5.0)
    assert line.inclination == pytest.approx(np.arctan2(-4.0, 3.0))
    circle = ellipse(2.0, -2.0j)  # x = 2 cos, y = 2 sin
    assert circle.precession == 1 and circle.minor == pytest.approx(2.0) == circle.major
    assert ellipse(2.0, 2.0j).precession == -1


def test_orbits_with_half_orders_close_after_two_turns():
    phi, rate = steady(41)
    x, y = np.cos(phi) + 0.5 * np.cos(phi / 2), np.sin(phi) - 0.5 * np.sin(phi / 2)
    found = jr.diagnostics.filtered_orbit(x, y, phi, rate, (0.5, 1.0), turns=40)
    assert found.angle[-1] == pytest.approx(2 * TURN)
    np.testing.assert_allclose([found.x[-1], found.y[-1]], [found.x[0], found.y[0]], atol=1e-9)
    np.testing.assert_allclose(found.keyphasor, [[1.5, 0], [0.5, 0]], atol=1e-8)
    assert found.ellipse(0.5).precession == -1 and found.ellipse(1.0).precession == 1
    with pytest.raises(
        jr.InputError, match="`order`: must be one of the orbit's, 0.5, 1, but is 3"
    ):
        found.ellipse(3)


def test_the_orbit_as_it_is():
    phi, rate = steady(10)
    found = jr.diagnostics.orbit(np.cos(phi) + 3, np.sin(phi) - 1, phi, rate, turns=2)
    np.testing.assert_allclose(np.hypot(found.x, found.y), 1.0, atol=1e-8)
    np.testing.assert_allclose(found.keyphasor, [[1, 0], [1, 0]], atol=1e-8)
    np.testing.assert_allclose(found.centre, [3, -1], atol=1e-8)


def test_the_centreline_knows_no_order():
    t, phi, speed = run_up()
    x = 1e-3 * phi + np.cos(phi) + 0.3 * np.cos(2 * phi)
    y = -0.2 + np.sin(phi) + 0.2 * np.sin(9 * phi)
    found = jr.diagnostics.shaft_centreline(x, y, phi, RATE, turns=2)
    # of what grows with the angle, the value in the middle of the block's equal steps
    middle = 2 * TURN * (np.arange(found.x.size) + 0.5)
    np.testing.assert_allclose(found.x, 1e-3 * middle, atol=2e-5)
    np.testing.assert_allclose(found.y, -0.2, atol=1e-9)
    np.testing.assert_allclose(found.speed, 20.0 + 30.0 * found.time, rtol=1e-10)


# Sections.


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_sections_fall_onto_the_marks(sense):
    t, phi, _ = run_up(sense)
    section = jr.diagnostics.poincare(np.cos(phi + 0.2), np.sin(3 * phi), phi, RATE, phase=1.0)
    np.testing.assert_allclose(section.x, np.cos(1.2), atol=1e-8)
    np.testing.assert_allclose(section.v, np.sin(3.0), atol=1e-8)
    # 2 pi k + 1 reached under constant acceleration
    turned = TURN * np.arange(section.time.size) + (1.0 if sense > 0 else TURN - 1.0)
    exact = (-20.0 + np.sqrt(400.0 + 60.0 * turned)) / 30.0
    np.testing.assert_allclose(section.time, exact, atol=1e-11)
    np.testing.assert_allclose(
        jr.diagnostics.turn_instants(phi, RATE, phase=1.0), section.time, rtol=0, atol=1e-14
    )
    assert section.period() == 1


def test_the_period_of_a_section():
    phi, rate = steady(60)

    def period(order):
        return jr.diagnostics.poincare(np.cos(order * phi), np.sin(order * phi), phi, rate).period()

    assert period(1 / 2) == 2 and period(1 / 3) == 3 and period(2.0) == 1
    assert period(1 / np.sqrt(2)) == 0  # quasi-periodic
    every = jr.diagnostics.poincare(np.cos(phi / 2), np.sin(phi / 2), phi, rate, every=2)
    assert every.period() == 1 and every.x.size == 31


# What is refused.


def test_refusals_name_the_place_and_the_remedy():
    phi, rate = steady()
    x = np.cos(phi)
    back = np.where(np.arange(phi.size) < 1000, phi, phi[999] - (phi - phi[999]))
    cases = [
        (lambda: jr.diagnostics.full_spectrum(x, x[:-1], rate), "`y`: must have as many samples"),
        (lambda: jr.diagnostics.full_spectrum(x + 1j, x, rate), "`x`: must be real"),
        (
            lambda: jr.diagnostics.full_spectrum(x, x, -1.0),
            "sample_rate must be positive and finite, but is -1 Hz",
        ),
        (
            lambda: jr.diagnostics.full_spectrum(x, x, rate, "hamn"),
            "`window`: must be one that scipy",
        ),
        (
            lambda: jr.diagnostics.full_spectrum(x * np.nan, x, rate),
            "`x`: must be finite, but sample 0",
        ),
        (
            lambda: jr.diagnostics.order_tracking(x, back, rate),
            "`angle`: must rise .* after sample 999",
        ),
        (lambda: jr.diagnostics.order_tracking(x, phi % TURN, rate), "`angle`: must rise"),
        (
            lambda: jr.diagnostics.order_tracking(x, 0.001 * phi, rate),
            "`angle`: must make a whole turn",
        ),
        (
            lambda: jr.diagnostics.order_tracking(x, phi, rate, (1, 30)),
            "`sample_rate`: must give 4 samples",
        ),
        (
            lambda: jr.diagnostics.order_tracking(x, phi, rate, (1, 1.01)),
            "`orders`: must lie 1/4 from 0",
        ),
        (
            lambda: jr.diagnostics.order_tracking(x, phi, rate, (0, 1)),
            "`orders`: must be finite and above 0",
        ),
        (lambda: jr.diagnostics.order_tracking(x, phi, rate, (1, 1)), "`orders`: must differ"),
        (
            lambda: jr.diagnostics.order_tracking(x, phi, rate, turns=99),
            "`turns`: .* has 40 whole turns",
        ),
        (
            lambda: jr.diagnostics.order_tracking(x, phi, rate, turns=0.5),
            "turns must be a whole number, 1 at least, but is 0.5",
        ),
        (
            lambda: jr.diagnostics.waterfall(x, phi, rate, segment=9999),
            "`segment`: must not exceed",
        ),
        (
            lambda: jr.diagnostics.waterfall(x, phi, rate, overlap=1.0),
            "overlap must be 0 at least and below 1",
        ),
        (lambda: jr.diagnostics.orbit(x, x, phi, rate, turns=41), "`turns`: .* has 40 whole turns"),
        (lambda: jr.diagnostics.poincare(x, x, phi, rate, phase=np.inf), "phase must be finite"),
        (
            lambda: jr.diagnostics.poincare(x, x, phi, rate, every=60),
            "`every`: must leave two points",
        ),
        (lambda: jr.diagnostics.poincare(x, x[:5], phi, rate), "`v`: must be one row of 8 samples"),
    ]
    for call, words in cases:
        with pytest.raises(jr.InputError, match=words):
            call()


# Figures show the numbers.


def test_figures():
    t, phi, speed = run_up(start=60.0)
    x, y = 1e-5 * np.cos(phi), 0.5e-5 * np.sin(phi)
    spectrum = jr.diagnostics.full_spectrum(x, y, RATE)
    # a fan that turns backwards: what goes from y to x is forward, and its lines are named so
    turned = plot.full_spectrum(spectrum, speed=-150.0)
    assert "← forward | backward →" in turned.get_xlabel()
    names = {t.get_text(): t.xy[0] for t in turned.texts}
    assert names["1×"] < 0 < names["−1×"]
    ax = plot.full_spectrum(spectrum, speed=150.0)
    np.testing.assert_allclose(ax.lines[0].get_ydata(), 1e6 * spectrum.amplitude)
    assert {"1×", "−1×", "2×"} <= {t.get_text() for t in ax.texts} and "µm" in ax.get_ylabel()

    found = jr.diagnostics.waterfall(x, speed, RATE)
    ax = plot.waterfall_map(found, highest=100.0)
    assert ax.get_xlim() == (0, 100) and ax.get_ylabel() == "speed, rpm"
    shown = np.asarray(ax.collections[0].get_array())
    assert shown.max() == 0.0 and shown.min() == -60.0  # dB of the highest
    ax = plot.cascade(found, highest=100.0)
    assert len(ax.lines) >= len(found.speed)
    no_ramp = found._replace(speed=np.full_like(found.speed, 100.0))
    assert plot.waterfall_map(no_ramp).get_ylabel() == "time, s"

    track = jr.diagnostics.order_tracking(x, phi, RATE, (1, 2))
    top, bottom = plot.order_tracks(track)
    np.testing.assert_allclose(top.lines[0].get_ydata(), 10.0, rtol=1e-6)
    assert np.all(np.isnan(bottom.lines[1].get_ydata()))  # 2x is nothing: it has no phase

    one = jr.diagnostics.filtered_orbit(x, y, phi, RATE)
    _, ax = plot.orbits({"all": jr.diagnostics.orbit(x, y, phi, RATE), "1×": one})
    assert "forward, semi-axes 10 × 5 µm" in ax.get_title(loc="left")
    line = jr.diagnostics.shaft_centreline(x, y, phi, RATE)
    ax = plot.centreline(line, clearance=1e-4)
    assert "clearance 100 µm" in {a.get_label() for a in ax.lines}
    section = jr.diagnostics.poincare(x, y, phi, RATE)
    ax = plot.poincare(section)
    np.testing.assert_allclose(ax.collections[0].get_offsets()[:, 0], 1e6 * section.x)
    assert "repeats each turn" in ax.get_title(loc="left")


# Runs: against the linear response, and against the motion integrated by another program.


@pytest.fixture(scope="module")
def whirl():
    """A steady run at 300 rad/s, between its two critical speeds."""
    machine = jr.Machine(
        {
            "disc": jr.Rotor(2.0, 0.02, 0.012, unbalance=jr.Unbalance(2e-5)),
            "support": jr.LinearSupport([1.2e5, 2.5e5, 1e5, 1e3, 1e3, 0], [60, 90, 1, 1, 1, 0]),
        },
        {"support": "disc"},
        prescribed={"disc": {"phi": jr.ConstantSpeed(300.0)}},
    )
    return jr.simulate(machine, 0.25, 1000.0, initial="steady", speed=300.0)


def test_the_tracked_order_of_a_run_is_the_linear_response(whirl):
    speed, rate, run = 300.0, 1000.0, whirl["disc"]
    linear = np.asarray(
        jr.unbalance_response(whirl.machine, ["disc.x", "disc.y"], [speed]).values[0]
    )
    found = jr.diagnostics.filtered_orbit(run.x, run.y, run.phi, rate)
    np.testing.assert_allclose(found.amplitude[0], linear, rtol=2e-6)
    assert found.ellipse().precession == -1  # between the two critical speeds, 245 and 354 rad/s
    full = jr.diagnostics.full_spectrum(run.x, run.y, rate, "flattop")
    lines = [full.peak(*sorted((s * 30, s * 70)))[1] for s in (1, -1)]
    one = found.ellipse()
    np.testing.assert_allclose(lines, [abs(one.forward), abs(one.backward)], rtol=2e-3)


class Duffing(jr.AbstractAttachment):
    """Spring k1 x + k3 x³ and damper c along x."""

    k1: jax.Array = jr.parameter("N/m")
    k3: jax.Array = jr.parameter("N/m^3")
    c: jax.Array = jr.parameter("N*s/m")

    def forces(self, t, motions, state):
        ((q, v),) = motions
        force = self.k1 * q[0] + self.k3 * q[0] ** 3 + self.c * v[0]
        return (jnp.zeros(6).at[0].set(-force),)


def double_well(drive=None):
    """x'' + 0.3 x' - x + x³ = e w² cos wt."""
    return jr.Machine(
        {
            "disc": jr.Rotor(1.0, 1.0, 1.0, unbalance=jr.Unbalance(0.2)),
            "well": Duffing(-1.0, 1.0, 0.3),
        },
        {"well": "disc"},
        prescribed={"disc": {"phi": drive or jr.ConstantSpeed(1.2)}},
        fixed={"disc": ["y", "z", "psi", "theta"]},
    )


PROBE = jr.sensors.ProximityProbe("disc", 0.0)


def test_bifurcations_of_the_double_well():
    """Periods 1, 2 and 4 at forces of 0.2, 0.28 and 0.29 N and 1.2 rad/s (Jordan, Smith, Nonlinear Ordinary
    Differential Equations, 2007), and another speed; the points by scipy's DOP853."""
    speed, force = np.array([1.2, 1.2, 1.2, 1.5]), np.array([0.2, 0.28, 0.29, 0.2])
    drop, keep, phase = 100, 16, 0.6
    cases = {"disc.phi.speed": speed, "disc.unbalance.eccentricity": force / speed**2}
    found = jr.diagnostics.bifurcation(
        double_well(), cases, PROBE, "disc",
        drop=drop, keep=keep, phase=phase, initial="undeformed", progress=False,
    )  # fmt: skip
    assert found.period().tolist() == [1, 2, 4, 1]
    assert not np.any(found.failure != "") and found.path_unit == "rad/s" and found.unit == "m"
    np.testing.assert_allclose(found.speed, speed)
    end = (drop + keep + 1) * TURN / 1.2  # of the slowest, whose time all run
    for w, f, points in zip(speed, force, found.points):
        last = np.floor((w * end - phase) / TURN + 1e-9)
        marks = (TURN * (last - np.arange(keep)[::-1]) + phase) / w

        def rates(t, y, w=w, f=f):
            return [y[1], f * np.cos(w * t) - 0.3 * y[1] + y[0] - y[0] ** 3]

        exact = solve_ivp(
            rates, (0, end), [0, 0], method="DOP853", rtol=1e-11, atol=1e-12, t_eval=marks
        )
        np.testing.assert_allclose(points, exact.y[0], atol=3e-5)
    ax = plot.bifurcation(found, "x")
    np.testing.assert_allclose(ax.lines[0].get_xdata()[:keep], 1.2 * 30 / np.pi)
    assert ax.get_xlabel() == "speed, rpm" and ax.get_ylabel() == "x once a turn, mm"


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_sections_inside_a_run_and_their_derivatives(sense):
    once = jr.diagnostics.PoincareSamples(PROBE, "disc", 5, 0.7)
    t = jnp.arange(400) * 0.01
    marks = sense * 0.7 + TURN * np.arange(2, 7)  # the last before the end at 3.99 s, w = 10 rad/s

    def points(values):
        w, a = values
        seen = Seen(t, once.sensors(), (jnp.cos(a * t), sense * w * t))
        return once(seen)

    at = jnp.array([10.0, 7.0])
    np.testing.assert_allclose(points(at), np.cos(7.0 * marks / 10.0), atol=1e-9)
    slopes = -np.sin(0.7 * marks)[:, None] * np.stack([-7.0 * marks / 100, marks / 10], axis=1)
    for derivative in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(derivative(points)(at), slopes, atol=1e-7)
    few = jr.diagnostics.PoincareSamples(PROBE, "disc", 9, 0.7)
    found = few(Seen(t, few.sensors(), (jnp.cos(t), sense * 10.0 * t)))
    assert np.isnan(found).sum() == (2 if sense > 0 else 3)


def test_bifurcations_refuse():
    speeds = {"disc.phi.speed": [1.0, 2.0]}
    free = jr.Machine(
        {"disc": jr.Rotor(1.0, 1.0, 1.0), "well": Duffing(1.0, 1.0, 0.3)}, {"well": "disc"}
    )
    ramp = double_well(jr.CosineRamp(speed=2.0, duration=1.0))
    cases = [
        (
            lambda: jr.diagnostics.bifurcation(free, {"disc.mass": [1.0]}, PROBE, "disc"),
            "must have a drive",
        ),
        (
            lambda: jr.diagnostics.bifurcation(ramp, {"disc.mass": [1.0]}, PROBE, "disc"),
            "at constant speed",
        ),
        (
            lambda: jr.diagnostics.bifurcation(
                double_well(), {"disc.phi.speed": [1.0, 0.0]}, PROBE, "disc"
            ),
            "case 2",
        ),
        (
            lambda: jr.diagnostics.bifurcation(double_well(), speeds, "x", "disc"),
            "quantity must be an AbstractSensor, but is 'x'",
        ),
        (
            lambda: jr.diagnostics.bifurcation(double_well(), speeds, PROBE, "disk"),
            "`shaft`: there is no station `disk`",
        ),
        (
            lambda: jr.diagnostics.bifurcation(double_well(), speeds, PROBE, "disc", keep=1),
            "keep must be a whole number, 2 at least",
        ),
        (
            lambda: jr.diagnostics.PoincareSamples(PROBE, "disc", 0),
            "keep must be a whole number, 1 at least, but is 0",
        ),
    ]
    for call, words in cases:
        with pytest.raises(jr.InputError, match=words):
            call()


# Studies ask for them.


def test_a_study_draws_them(whirl):
    def wanted(kind, **more):
        return Diagnosis(title="Look", kind=kind, station="disc", **more)

    for kind in KINDS:
        fig = figure_of(diagnosis(whirl, wanted(kind, start="0 s")))
        titles = [ax.get_title(loc="left") for ax in fig.axes] + [fig.get_suptitle()]
        assert any("Look: disc" in title for title in titles)
    late = diagnosis(whirl, wanted("orbit", start="0.2 s"))
    assert "`turns`: must fit" in late.texts[0].get_text().replace("\n", " ")
    beyond = diagnosis(whirl, wanted("poincare", start="9 s"))
    assert "`start`: must lie within the run" in beyond.texts[0].get_text()


STUDY = """
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "6 kg"
polar_inertia = "0.019 kg*m^2"
transverse_inertia = "0.01 kg*m^2"
[[machine.line]]
name = "shaft"
kind = "Shaft"
length = "200 mm"
diameter = "12 mm"
[[machine.line]]
name = "motor"
kind = "PrescribedSpin"
profile = { kind = "ConstantSpeed", speed = "400 rad/s" }
[simulation]
t_end = "1 s"
sample_rate = "1 kHz"
[[figures]]
title = "A"
"""


@pytest.mark.parametrize(
    "lines, words",
    [
        ("kind = 'orbits'\nstation = 'disc'", 'figures "A".*kind must be one of.*`orbit`'),
        ("kind = 'orbit'", "station is missing"),
        ("kind = 'orbit'\nstation = 'dics'", 'station names none, "dics".*`disc`'),
        ("kind = 'orbit'\nstation = 'disc'\norders = [1, 1]", "orders must be a list of different"),
        ("kind = 'orbit'\nstation = 'disc'\norders = 2", "orders must be a list of different"),
        ("kind = 'orbit'\nstation = 'disc'\nclearance = '1 mm'", "clearance goes with kind"),
        ("kind = 'poincare'\nstation = 'disc'\norders = [1]", "orders say nothing to kind"),
        ("kind = 'orbit'\nstation = 'disc'\nstart = '-1 s'", "start must not be negative"),
        ("kind = 'orbit'\nstation = 'disc'\ny = ['disc.x']", "unknown|there is no `y`"),
    ],
)
def test_what_a_study_asks_for_is_checked(tmp_path, lines, words):
    path = tmp_path / "study.toml"
    path.write_text(STUDY + lines)
    with pytest.raises(jr.InputError, match=words):
        jr.load(path)
    path.write_text(STUDY + "kind = 'centreline'\nstation = 'disc'\nclearance = '0.2 mm'")
    (figure,) = jr.load(path).figures
    assert isinstance(figure, Diagnosis) and figure.clearance == pytest.approx(2e-4)
    assert figure.stem == "a"
