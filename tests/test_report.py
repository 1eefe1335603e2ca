"""Pictures and summaries: of any machine, and with the numbers that belong in them."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor import plot
from jaxrotor.measure.spectrum import power_spectral_density
from jaxrotor.plot.machine import positions
from jaxrotor.report import summary, summary_table
from jaxrotor.report.observations import amplitude, falls_to, turn_mean


def branched():
    """A shaft that forks: two branches to the right of `hub`, and a coupling without a length."""
    disc = jr.Rotor(2.0, 0.012, 0.008)
    return jr.Machine(
        {
            "motor": jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
            "stub": jr.Shaft(length=0.1, diameter=0.02, inner_diameter=0.01),
            "hub": disc,
            "upper": jr.Shaft(length=0.2, diameter=0.015),
            "fan": disc,
            "lower": jr.ElasticMatrix(1e3 * np.eye(12), np.zeros((12, 12))),
            "pump": jr.RigidBody(1.0, (0.01, 0.012, 0.02)),
            "brake": jr.Torque(-0.1),
        },
        {
            "stub": ("motor", "hub"),
            "upper": ("hub", "fan"),
            "lower": ("hub", "pump"),
            "brake": "pump",
        },
    )


def test_machines_are_placed_by_their_lengths(two_rotor):
    where = positions(two_rotor())
    want = {"second": 0.0, "left": 0.06, "main": 0.14, "right": 0.267, "end": 0.287}
    assert {k: z for k, (z, _) in where.items()} == pytest.approx(want)
    assert {lane for _, lane in where.values()} == {0}


def test_branches_get_lanes_of_their_own():
    where = positions(branched())
    assert where["fan"][0] == pytest.approx(0.3)
    assert where["fan"][1] != where["pump"][1]
    fig = plot.draw_machine(branched())
    words = [text.get_text() for text in fig.axes[0].texts]
    for name in ("motor", "hub", "fan", "pump"):
        assert name in words
    assert any(w.startswith("brake") for w in words) and any("Ø20" in w for w in words)
    plt.close(fig)


def test_the_disc_is_drawn_to_scale(two_rotor):
    """Main's radius is sqrt(2 Jp/m) = 78.5 mm, its width 39.9 mm."""
    fig = plot.draw_machine(two_rotor())
    sizes = [
        (p.get_width(), p.get_height()) for p in fig.axes[0].patches if hasattr(p, "get_width")
    ]
    assert any(
        w == pytest.approx(0.0401, rel=0.01) and h == pytest.approx(0.157, rel=0.01)
        for w, h in sizes
    )
    plt.close(fig)


def test_summary_says_where_the_peaks_are():
    machine = jr.Machine.in_line(
        {
            "disc": jr.Rotor(2.0, 0.018, 0.010, unbalance=jr.Unbalance(1e-4)),
            "shaft": jr.Shaft(length=0.3, diameter=0.012, rayleigh=(0.0, 2e-4)),
            "motor": jr.PrescribedSpin(jr.CosineRamp(speed=200.0, duration=0.1)),
        }
    )
    run = jr.simulate(machine, 0.1, 1000.0)
    found = summary(run)["stations"]["disc"]["radial_displacement_m"]
    r = np.hypot(np.asarray(run["disc"].x), np.asarray(run["disc"].y))
    assert found["peak"] == pytest.approx(r.max())
    assert found["time_s"] == pytest.approx(np.argmax(r) / 1000.0)
    assert found["speed_rad_s"] == pytest.approx(float(run["disc"].speed[np.argmax(r)]))
    assert f"{1e3 * r.max():.4g} mm" in summary_table(run)
    assert summary(run)["connectors"]["shaft"]["torque_Nm"]["peak"] > 0


def test_spectrum_keeps_the_variance_and_finds_the_line():
    """Parseval: a sine of amplitude 2 and noise of variance 0.25 have 2.25 together."""
    t = np.arange(40_000) / 1000.0
    noise = 0.5 * np.random.default_rng(0).standard_normal(t.size)
    f, density = power_spectral_density(3.0 + 2 * np.sin(2 * np.pi * 123.0 * t) + noise, 1000.0)
    assert np.trapezoid(density, f) == pytest.approx(2.25, rel=0.02)
    assert f[np.argmax(density)] == pytest.approx(123.0, abs=0.1)


@pytest.mark.parametrize(
    "signal, words",
    [(np.ones(5), "16 samples at least"), (np.r_[np.ones(40), np.nan], "sample 40")],
)
def test_spectrum_refuses(signal, words):
    with pytest.raises(jr.InputError, match=words):
        power_spectral_density(signal, 1000.0)


def test_what_observations_are_measured_with():
    t = np.arange(20_001) / 2000.0
    speed = np.full_like(t, 100.0)
    # the mean over a turn takes the once-per-turn ripple away and leaves the trend
    mean = turn_mean(t, 0.3 * t + np.sin(100.0 * t), speed)
    inside = slice(200, -200)
    np.testing.assert_allclose(mean[inside], 0.3 * t[inside], atol=2e-3)
    # an exponential falls to a third in ln 3 time constants; a floor above it never does
    decay = 0.2 + np.exp(-t / 0.8) * np.cos(300.0 * t)
    size = amplitude(t, decay)
    assert falls_to(t[200:], size[200:], 1 / 3) == pytest.approx(0.8 * np.log(3), rel=0.05)
    assert falls_to(t[200:], np.maximum(size[200:], 0.5), 1 / 3) == np.inf
