"""Pictures and summaries: of any machine, and with the numbers that belong in them."""

import numpy as np
import pytest
from helpers import at_instants

import jaxrotor as jr
from jaxrotor import plot
from jaxrotor.commands.observations import amplitude, falls_to, turn_mean
from jaxrotor.commands.run_report import summary, summary_table, write_report
from jaxrotor.diagnostics.spectrum import power_spectral_density
from jaxrotor.plot.curves import Curve, chart
from jaxrotor.plot.lanes import positions
from jaxrotor.plot.style import band, turning_points
from jaxrotor.study.quantities import quantities, read_quantity


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
    ax = plot.draw_machine(branched())
    words = [text.get_text() for text in ax.texts]
    for name in ("motor", "hub", "fan", "pump"):
        assert name in words
    assert any(w.startswith("brake") for w in words) and any("Ø20" in w for w in words)


def geared():
    """A motor, a coupling without a length, and two rotors joined by gears: the second turns backward."""
    mesh = jr.GearMesh((0.1, 0.3), jr.elements.KelvinVoigt(1e8, 1e3))
    return jr.Machine(
        {
            "motor": jr.Rotor(20.0, 0.4, 0.3),
            "coupling": jr.ElasticMatrix(1e3 * np.eye(12), np.zeros((12, 12))),
            "pinion": jr.Rotor(3.0, 0.01, 0.01),
            "mesh": mesh,
            "wheel": jr.Rotor(20.0, 0.9, 0.5),
            "shaft": jr.Shaft(length=0.4, diameter=0.05),
            "fan": jr.Rotor(20.0, 2.0, 1.0),
        },
        {
            "coupling": ("motor", "pinion"),
            "mesh": ("pinion", "wheel"),
            "shaft": ("wheel", "fan"),
        },
    )


def twelve():
    """Twelve rotors side by side, with names, shafts and supports to be told apart."""
    line = {}
    for k in range(12):
        line[f"impeller {k + 1}"] = jr.Rotor(2.0, 0.012 / (1 + k % 3), 0.008 / (1 + k % 3))
        line[f"shaft {k + 1}"] = jr.Shaft(length=0.05, diameter=0.05)
    line.popitem()
    foot = jr.LinearSupport([1e6, 1e6, 1e6, 1e3, 1e3, 0])
    return jr.Machine.in_line(
        line, {f"bearing {k}": (foot, f"impeller {k}") for k in (1, 6, 7, 12)}
    )


def sixty():
    """Far more stations than have room for their names; each end is on a support."""
    parts = {}
    for k in range(60):
        parts[f"station {k}"] = jr.Node()
        if k < 59:
            parts[f"element {k}"] = jr.FiniteElementShaft(0.03, 0.08, elements=1)
    spring = jr.LinearSupport([1e7, 1e7, 0, 0, 0, 0])
    hung = {f"support {k}": (spring, f"station {k}") for k in range(0, 60, 5)}
    return jr.Machine.in_line(parts, hung)


@pytest.mark.parametrize("build", [branched, geared, twelve, sixty])
def test_no_words_of_a_drawing_run_into_each_other(build):
    ax = plot.draw_machine(build())
    figure = ax.figure
    renderer = figure.canvas.get_renderer()
    boxes = [(t.get_text(), t.get_window_extent(renderer)) for t in ax.texts if t.get_text()]
    assert len(boxes) > 5
    for i, (name, box) in enumerate(boxes):
        for other, against in boxes[i + 1 :]:
            assert not box.overlaps(against), (name, other)


def test_of_many_stations_few_are_named():
    """The drawing stays one of a machine, and no column of words."""
    ax = plot.draw_machine(sixty())
    width, height = ax.figure.get_size_inches()
    names = [t.get_text() for t in ax.texts if t.get_text().startswith("station")]
    assert height < 0.7 * width and 20 < len(names) < 60


def test_what_gears_drive_stands_beside_its_driver():
    where = positions(geared())
    assert where["wheel"][0] == where["pinion"][0] and where["wheel"][1] == where["pinion"][1] + 1
    assert where["fan"] == (pytest.approx(where["wheel"][0] + 0.4), where["wheel"][1])


def test_parts_without_a_length_do_not_lie_in_each_other():
    """Wide rotors joined by couplings: there is air between their discs."""
    wide = jr.Rotor(10.0, 0.5, 1.0)
    loose = jr.ElasticMatrix(1e3 * np.eye(12), np.zeros((12, 12)))
    machine = jr.Machine.in_line({"a": wide, "c": loose, "b": wide})
    where = positions(machine)
    width = np.sqrt(12 * 1.0 / 10.0 - 3 * 2 * 0.5 / 10.0)  # of the disc with these inertias
    assert where["b"][0] - where["a"][0] > 1.1 * width


def test_distances_fill_their_panels_where_gears_turn_backward():
    """Over the size of each rotor's own speed: no half of a panel is empty."""
    machine = geared()
    t = np.linspace(0.0, 1.0, 40)
    q, v = np.zeros((40, 4, 6)), np.zeros((40, 4, 6))
    for k, ratio in enumerate((1.0, 1.0, -1 / 3, -1 / 3)):
        q[:, k, 0] = 1e-4 * t
        v[:, k, 5] = 150.0 * ratio * t
    run = at_instants(machine, q, v, t)
    for name, ax in zip(("motor", "fan"), plot.distances(run, ["motor", "fan"])):
        x = np.concatenate([line.get_xdata() for line in ax.lines if len(line.get_xdata()) == 40])
        low, high = ax.get_xlim()
        assert x.min() >= 0 and (x.max() - x.min()) / (high - low) > 0.85
        assert ax.get_xlabel() == f"speed of {name}, rad/s"


def test_six_torques_at_most():
    """The largest, in the machine's order; all where they are named."""
    line = {}
    for k in range(9):
        line[f"d{k}"] = jr.Rotor(1.0, 0.01, 0.008)
        line[f"s{k}"] = jr.Shaft(length=0.1, diameter=0.01)
    line.popitem()
    t = np.linspace(0.0, 1.0, 20)
    q = np.zeros((20, 9, 6))
    twists = np.array([1, 9, 2, 8, 3, 7, 6, 5]) * 1e-3
    q[:, 1:, 5] = t[:, None] * np.cumsum(twists)
    run = at_instants(jr.Machine.in_line(line), q, 0 * q, t)
    (ax,) = plot.torques(run)
    names = [text.get_text() for text in ax.get_legend().get_texts()]
    assert names == [f"s{k}" for k in (1, 3, 4, 5, 6, 7)]
    assert "6 largest of 8" in ax.get_title(loc="left")
    (ax,) = plot.torques(run, [f"s{k}" for k in range(8)])
    looks = {(line.get_color(), line.get_linestyle()) for line in ax.lines}
    assert len(looks) == 8


def test_bands_let_through_what_is_behind():
    """A dense oscillation: its fill and its trace are faint, its edges are not."""
    import matplotlib.pyplot as plt

    t = np.linspace(0.0, 1.0, 8001)
    _, ax = plt.subplots()
    band(ax, t, np.sin(2 * np.pi * 400 * t), "#0072B2", "x")
    (fill,) = ax.collections
    assert fill.get_alpha() <= 0.25
    edges = [line for line in ax.lines if len(line.get_xdata()) and not line.get_alpha()]
    assert sorted(round(float(np.median(e.get_ydata()))) for e in edges) == [-1, 1]
    _, ax = plt.subplots()
    band(ax, t, np.sin(20 * t), "#0072B2", "x")
    assert not ax.collections and len(ax.lines) == 1


def test_the_disc_is_drawn_to_scale(two_rotor):
    """Main's radius is sqrt(2 Jp/m) = 78.5 mm, its width 39.9 mm."""
    ax = plot.draw_machine(two_rotor())
    sizes = [(p.get_width(), p.get_height()) for p in ax.patches if hasattr(p, "get_width")]
    assert any(
        w == pytest.approx(0.0401, rel=0.01) and h == pytest.approx(0.157, rel=0.01)
        for w, h in sizes
    )


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


def test_shafts_of_several_parts_are_drawn_and_summed_up():
    """A stepped, tapered shaft by finite elements: drawn section by section, with the support at a
    station inside it where that station is."""
    shaft = jr.FiniteElementShaft([0.2, 0.1], [0.02, 0.03], [0.0, 0.01], [0.02, 0.02], elements=2)
    machine = jr.Machine.in_line(
        {"a": jr.Node(), "shaft": shaft, "b": jr.Rotor(1.0, 2e-3, 1e-3)},
        {"foot": (jr.LinearSupport([1e6, 1e6, 1e6, 1e3, 1e3, 0]), "shaft.3")},
    )
    where = positions(machine)
    want = {"a": 0, "shaft.1": 0.1, "shaft.2": 0.2, "shaft.3": 0.25, "b": 0.3}
    assert {k: z for k, (z, _) in where.items()} == pytest.approx(want)
    assert {lane for _, lane in where.values()} == {0}
    ax = plot.draw_machine(machine)
    words = " ".join(text.get_text() for text in ax.texts)
    assert "300 mm, Ø20 to 30" in words and "foot (LinearSupport)" in words
    assert "shaft.element 4" in quantities(machine)


ASKED = """
title = "a disc on a shaft"
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "2 kg"
polar_inertia = "0.018 kg*m^2"
transverse_inertia = "0.010 kg*m^2"
unbalance = { eccentricity = "0.1 mm" }
[[machine.line]]
name = "shaft"
kind = "FiniteElementShaft"
length = "300 mm"
diameter = "12 mm"
elements = 2
rayleigh = ["0 1/s", "0.2 ms"]
[[machine.line]]
name = "motor"
kind = "PrescribedSpin"
profile = { kind = "CosineRamp", speed = "200 rad/s", duration = "0.1 s" }
[[machine.attachments]]
name = "air"
kind = "FanLoad"
at = "disc"
coefficient = "1e-4 N*m*s^2/rad^2"
[simulation]
t_end = "0.1 s"
sample_rate = "1 kHz"
[report]
main = "disc"
figures = ["machine", "vibration"]
[[figures]]
title = "Whirl"
x = "motor.speed"
y = ["disc.radial", "shaft.1.x", "shaft.element 1.torque", "air.torque"]
units = ["rpm", "um"]
"""


def test_a_study_draws_what_it_asks_for(tmp_path):
    (tmp_path / "disc.toml").write_text(ASKED)
    study = jr.load(tmp_path / "disc.toml")
    run = study.run(progress=False)
    names = [p.name for p in write_report(study, run, tmp_path / "out")]
    assert names == ["01_machine.png", "02_vibration_disc.png", "whirl.png", "summary.json"]
    # the quantities themselves, from the response's arrays
    q, v = (np.asarray(x) for x in (run["disc"].position, run["disc"].velocity))
    speed = v[:, 5] + 0.5 * (v[:, 3] * q[:, 4] + q[:, 3] * v[:, 4])  # chi'
    expected = {
        "disc.radial": (np.hypot(run["disc"].x, run["disc"].y), "m"),
        "shaft.1.x": (run["shaft.1"].position[:, 0], "m"),
        "air.torque": (-1e-4 * speed * np.abs(speed), "N*m"),
        "motor.reaction_torque": (run["motor"].reaction[:, 5], "N*m"),
        "t": (np.arange(101) / 1000, "s"),
    }
    for path, (values, unit) in expected.items():
        got = read_quantity(run, path)
        np.testing.assert_allclose(got[0], values, rtol=1e-12, atol=1e-15)
        assert got[1] == unit
    # everything that a study may name can be read
    for part, known in quantities(study.machine).items():
        for quantity in known:
            assert read_quantity(run, f"{part}.{quantity}")[0].shape == run.t.shape


def test_a_chart_has_a_panel_for_each_unit():
    t = np.linspace(0.0, 1.0, 2001)
    x = Curve("time", t, "s")
    curves = [
        Curve("a", 2e-3 * t, "m"),
        Curve("torque", 2e4 * t, "N*m"),
        Curve("b", -1e-3 * t, "m"),
        Curve("speed", 100 * np.pi * t, "rad/s"),
    ]
    axes = chart(x, curves, "All", units=["rpm"])
    labels = [ax.get_ylabel() for ax in axes]
    assert labels == ["displacement, mm", "torque, kN·m", "speed, rpm"]
    assert axes[-1].get_xlabel() == "time, s" and axes[0].get_title(loc="left") == "All"
    ends = {line.get_label(): line.get_ydata()[-1] for ax in axes for line in ax.lines}
    assert [ends[k] for k in ("a", "b", "torque", "speed")] == pytest.approx([2, -1, 20, 3000])


def test_a_dense_oscillation_is_drawn_in_its_envelope():
    t = np.linspace(0.0, 1.0, 8001)
    wave = t * np.sin(2 * np.pi * 400 * t)
    # a hundredth of the range is 0.02: what is smaller does not count
    assert 2 * 380 < len(turning_points(wave)) < 2 * 400
    assert len(turning_points(np.ones(9))) == 0
    (ax,) = chart(Curve("time", t, "s"), [Curve("w", wave, "N")], "Dense")
    (fill,) = ax.collections
    at, outline = np.concatenate([path.vertices for path in fill.get_paths()]).T
    near = np.abs(at - 0.5) < 1e-3
    assert outline[near].max() == pytest.approx(0.5, rel=0.03)
    assert outline[near].min() == pytest.approx(-0.5, rel=0.03)
    (ax,) = chart(Curve("time", t, "s"), [Curve("w", np.sin(20 * t), "N")], "Slow")
    assert not ax.collections


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
