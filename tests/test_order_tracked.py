"""Vectors that turn with the shaft: as a tracking filter shows them, and what is identified from them."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.commands.cli import main
from jaxrotor.sensors import Accelerometer, Noise, ProximityProbe, TrackingFilter

MASS, STIFFNESS, DAMPING, ECCENTRICITY, HEAVY = 2.0, 1.2e5, 60.0, 2e-5, 0.7
RATE = 2000.0


def rotor(spin, across=STIFFNESS, eccentricity=ECCENTRICITY):
    """A disc on springs, its heavy spot at `HEAVY`."""
    rest = (1e5, 1e3, 1e3, 0.0)
    return jr.Machine(
        {
            "disc": jr.Rotor(MASS, 0.02, 0.012, unbalance=jr.Unbalance(eccentricity, HEAVY)),
            "springs": jr.LinearSupport([STIFFNESS, across, *rest], [DAMPING, DAMPING, 1, 1, 1, 0]),
        },
        {"springs": "disc"},
        prescribed={"disc": {"phi": spin}},
    )


def whirl(speed):
    """Complex amplitude of x + iy of a round Jeffcott rotor, from its heavy spot's place: the closed form."""
    w = abs(speed)
    return ECCENTRICITY * MASS * w**2 / (STIFFNESS - MASS * w**2 + 1j * w * DAMPING)


@pytest.fixture(scope="module")
def steady():
    return {
        speed: jr.simulate(rotor(jr.ConstantSpeed(speed)), 3.0, RATE, "running")
        for speed in (150.0, -150.0)
    }


@pytest.mark.parametrize("speed", [150.0, -150.0])
def test_steady_whirl(steady, speed):
    """What a probe at 0.3 rad shows of a round whirl, in both senses of rotation, by the closed form: the
    high spot passes the probe when the heavy spot has, later by the lag of the response."""
    angle, mark = 0.3, 0.4
    z, sense = whirl(speed), np.sign(speed)
    lag = sense * (angle - HEAVY) - np.angle(z) - sense * mark  # rad, from the pulse to the peak
    expected = np.abs(z) * np.exp(1j * lag)
    probe = ProximityProbe("disc", angle)
    for filter_, factor in (
        (TrackingFilter(probe, "disc", mark=mark), 1.0),
        (TrackingFilter(probe, "disc", mark=mark, turns=4, unit="um"), 1e6),
        (TrackingFilter(probe, "disc", mark=mark, unit="mil", reading="peak-to-peak"), 2 / 25.4e-6),
        (TrackingFilter(probe, "disc", mark=mark, reading="rms"), np.sqrt(0.5)),
    ):
        seen = filter_.measure(steady[speed], [1.5, 2.7])
        np.testing.assert_allclose(seen, factor * expected, rtol=1e-6)
    lead = TrackingFilter(probe, "disc", mark=mark, lag=False)
    np.testing.assert_allclose(lead.measure(steady[speed], [2.0])[0], np.conj(expected), rtol=1e-6)
    less = TrackingFilter(probe, "disc", mark=mark, subtracted=[1e-6, -2e-6])
    seen = less.measure(steady[speed], [2.0])[0]
    np.testing.assert_allclose(seen, expected - (1e-6 - 2e-6j), rtol=1e-6)
    response = jr.unbalance_response(rotor(jr.ConstantSpeed(speed)), ("disc.x", "disc.y"), [speed])
    linear = TrackingFilter(probe, "disc", mark=mark).over_speed(
        response.values, response.frequencies
    )
    np.testing.assert_allclose(linear[0], expected, rtol=1e-8)


def test_runout_and_acceleration(steady):
    """Over a run and from the response: runout turns with the shaft, an acceleration is w² times as large."""
    run = steady[150.0]
    outputs = ("disc.x", "disc.y", "disc.z")
    response = jr.unbalance_response(rotor(jr.ConstantSpeed(150.0)), outputs, [150.0])
    for sensor, count in (
        (ProximityProbe("disc", 0.3, [[3e-6, -2e-6], [1e-6, 0.0]]), 2),
        (Accelerometer("disc", (1.0, 2.0, 0.0)), 3),
    ):
        tracked = TrackingFilter(sensor, "disc", mark=-0.8)
        assert sensor.watched() == outputs[:count]
        linear = tracked.over_speed(response.values[:, :count], response.frequencies)
        np.testing.assert_allclose(tracked.measure(run, [2.0])[0], linear[0], rtol=1e-6)


def test_window_in_a_run_up():
    """Against the integral over the window, done by NumPy on the samples; derivatives in both modes."""
    machine = rotor(jr.CosineRamp(speed=400.0, duration=1.0))
    step = 1e-4

    def vectors(eccentricity):
        changed = machine.set({"disc.unbalance.eccentricity": eccentricity})
        run = jr.simulate(changed, 1.2, RATE, "undeformed", step=step)
        return TrackingFilter(ProximityProbe("disc", 0.3), "disc", turns=3).measure(run, [0.8, 1.0])

    run = jr.simulate(machine, 1.2, RATE, "undeformed", step=step)
    t, phi = np.asarray(run.t), np.asarray(run["disc"].phi)
    x = np.asarray(run["disc"].x) * np.cos(0.3) + np.asarray(run["disc"].y) * np.sin(0.3)
    from scipy.interpolate import make_interp_spline

    angle, seen = make_interp_spline(t, phi, 5), make_interp_spline(t, x, 5)
    for at, vector in zip((0.8, 1.0), vectors(ECCENTRICITY)):
        edges = [
            np.interp(angle(at) + side * 3 * np.pi, phi, t) for side in (-1, 1)
        ]  # near enough: corrected below
        for _ in range(3):
            edges = [
                e - (angle(e) - angle(at) - s * 3 * np.pi) / angle(e, 1)
                for e, s in zip(edges, (-1, 1))
            ]
        fine = np.linspace(*edges, 200001)
        theta = angle(fine)
        whole = np.trapezoid(seen(fine) * np.exp(1j * theta) * angle(fine, 1), fine)
        np.testing.assert_allclose(vector, 2 * whole / (6 * np.pi), rtol=2e-5)

    parts = lambda e: jnp.stack([(v := vectors(e)).real, v.imag])  # noqa: E731
    forward = jax.jacfwd(parts)(ECCENTRICITY)
    np.testing.assert_allclose(jax.jacrev(parts)(ECCENTRICITY), forward, rtol=1e-8)
    h = 1e-8
    central = (parts(ECCENTRICITY + h) - parts(ECCENTRICITY - h)) / (2 * h)
    np.testing.assert_allclose(forward, central, rtol=1e-6)


KNOWN = [
    jr.Unknown("springs.stiffness[0]", positive=True),
    jr.Unknown("springs.stiffness[1]", positive=True),
    jr.Unknown("springs.damping[0]", positive=True, also={"springs.damping[1]": 1.0}),
    jr.Unknown("a.mark", circular=True, also={"b.mark": 1.0}),
]


@pytest.fixture(scope="module")
def identified():
    """Trial masses in one plane at several speeds, two probes, noise of a fiftieth."""
    sensors = {
        name: TrackingFilter(
            ProximityProbe("disc", angle), "disc", mark=0.4, unit="um", noise=Noise(0.5)
        )
        for name, angle in (("a", 0.3), ("b", 0.3 + np.pi / 2))
    }
    spin = jr.ConstantSpeed(150.0)
    truth = rotor(spin, across=1.0e5)
    speeds = np.repeat([120.0, 170.0, 210.0, 260.0, 320.0], 2)
    trial = np.tile([1e-5, 3e-5], 5)
    rng = np.random.default_rng(1)
    vectors = {name: [] for name in sensors}
    for speed, eccentricity in zip(speeds, trial):
        machine = rotor(spin, 1.0e5, eccentricity)
        response = jr.unbalance_response(machine, ("disc.x", "disc.y"), [speed])
        for name, one in sensors.items():
            seen = complex(one.over_speed(response.values, response.frequencies)[0])
            vectors[name].append(seen + 0.5 * complex(*rng.normal(size=2)))
    guess = truth.set(
        {
            "springs.stiffness": [1.3e5, 1.1e5, 1e5, 1e3, 1e3, 0],
            "springs.damping": [90, 90, 1, 1, 1, 0],
        }
    )
    start = {
        name: TrackingFilter(one.sensor, "disc", mark=0.2, unit="um", noise=one.noise)
        for name, one in sensors.items()
    }
    data = jr.MeasuredResponse(
        speeds,
        vectors,
        {"disc.unbalance.eccentricity": trial},
        name="trial masses",
        at="undeformed",
    )
    return jr.identify(guess, KNOWN, start, data, progress=False)


def test_response_identified(identified):
    truth = dict(zip(identified.paths, (1.2e5, 1.0e5, 60.0, 0.4)))
    for path, (low, high) in identified.intervals(0.999).items():
        assert low < truth[path] < high
        assert identified.std[path] < 0.05 * truth[path]
    assert not identified.warnings
    assert [c.over for c in identified.channels] == ["speed"] * 2
    assert np.iscomplexobj(identified.channels[0].residual)


def test_intervals_cover(identified):
    """A hundred records with fresh noise: the stated intervals hold the truth as often as they say."""
    replicas = jr.identification.bootstrap(identified, 100, seed=3)
    covered = np.array(list(replicas.coverage.values()))
    assert (covered >= 0.88).all() and 0.90 <= covered.mean() <= 0.99
    assert np.allclose(list(replicas.spread.values()), 1.0, atol=0.25)


def test_drawn(identified):
    panels = identified.plot.fits()
    assert panels.shape == (2, 3) and panels[-1, -1].get_xlabel() == "speed, rpm"
    assert "um" in panels[0, 0].get_ylabel() and "degrees" in panels[0, 1].get_ylabel()
    fit = identified.channels[0]
    seen, told = (line.get_ydata() for line in panels[0, 1].lines)  # over rising speed
    turned = np.exp(1j * np.radians(np.subtract(seen, told)))
    ratio = (fit.measured / fit.simulated)[np.argsort(fit.t, kind="stable")]
    np.testing.assert_allclose(turned, ratio / abs(ratio), rtol=1e-9)


@pytest.mark.parametrize(
    "make, words",
    [
        (
            lambda: jr.MeasuredResponse([100.0, 200.0], {"a": [1 + 1j]}),
            "a: needs a value for each of the 2 speeds, but has shape",
        ),
        (lambda: jr.MeasuredResponse([100.0], {}), "holds no vectors"),
        (lambda: jr.MeasuredResponse([100.0], {"a": ["x"]}), "must be numbers"),
        (lambda: jr.MeasuredResponse([100.0], {"a": [np.nan]}), "has no value"),
        (lambda: jr.MeasuredResponse([np.inf], {"a": [1.0]}), "speeds"),
        (
            lambda: jr.MeasuredResponse([1.0, 2.0], {"a": [1, 2]}, {"disc.mass": [1.0, np.nan]}),
            "conditions: disc.mass: is nan in row 2",
        ),
        (
            lambda: asked(TrackingFilter(ProximityProbe("disc", 0.0), "disc", unit="kg")),
            "unit must be a multiple of m, but is 'kg'",
        ),
        (
            lambda: asked(TrackingFilter(ProximityProbe("disc", 0.0), "disc", unit="quux")),
            "unit must be a multiple of m, but is 'quux'",
        ),
        (lambda: TrackingFilter(ProximityProbe("disc", 0.0), "disc", order=0), "order"),
        (
            lambda: asked(jr.Channel(ProximityProbe("disc", 0.0))),
            "steady vectors are what a TrackingFilter records, but it is a Channel",
        ),
        (
            lambda: in_a_run(jr.Channel(ProximityProbe("disc", 0.0)), 1 + 1j),
            "holds vectors: record them by a TrackingFilter, but the channel is a Channel",
        ),
        (
            lambda: in_a_run(TrackingFilter(ProximityProbe("disc", 0.0), "disc"), 1.0),
            "holds no vectors, but the channel is a TrackingFilter",
        ),
        (
            lambda: asked(TrackingFilter(ProximityProbe("disc", 0.0), "disk")),
            "no such|did you mean|disk",
        ),
        (
            lambda: asked(TrackingFilter(jr.sensors.Tachometer("disc"), "disc")),
            "Tachometer at order 1 cannot be told from an unbalance response",
        ),
    ],
)
def test_refused(make, words):
    with pytest.raises(jr.InputError, match=words):
        make()


RECORD = """
file = "bode.csv"
time = "t"
[channels.polar]
column = "size"
unit = "um"
phase = "lag"
[channels.turns]
column = "size"
unit = "um"
phase = { column = "lag", unit = "rad" }
[channels.cartesian]
column = "re"
imaginary = "im"
unit = "mil"
"""


def written(folder, text=RECORD):
    (folder / "bode.csv").write_text(
        "t,size,lag,re,im\n0,1,0,3,4\n0.1,2,90,5,6\n0.2,1,180,7,8\n0.3,,45,9,10\n0.4,2,-90,1,1\n"
    )
    (folder / "bode.toml").write_text(text)
    return jr.read_record(folder / "bode.toml")


def test_vectors_from_a_file(tmp_path):
    record = written(tmp_path)
    np.testing.assert_allclose(record["polar"].values, [1, 2j, -1, np.nan, -2j], atol=1e-12)
    np.testing.assert_allclose(record["turns"].values[1], 2 * np.exp(90j), atol=1e-12)
    np.testing.assert_allclose(record["cartesian"].values[:2], [3 + 4j, 5 + 6j])
    assert record["polar"].valid.sum() == 4


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('phase = "lag"', 'phase = "lagg"', "polar: phase: `bode.csv` has no such column"),
        ('unit = "rad"', 'unit = "m"', "turns: phase: its unit"),
        (
            'imaginary = "im"',
            'imaginary = "im"\nphase = "lag"',
            "has phase and imaginary: keep one",
        ),
        ('imaginary = "im"', 'imaginary = { colum = "im" }', "imaginary: .*colum"),
    ],
)
def test_vectors_refused(tmp_path, old, new, words):
    with pytest.raises(jr.InputError, match=words):
        written(tmp_path, RECORD.replace(old, new))


MACHINE = """
[machine]
prescribed = { disc = { phi = { kind = "ConstantSpeed", speed = "150 rad/s" } } }
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "2 kg"
polar_inertia = "0.02 kg*m^2"
transverse_inertia = "0.012 kg*m^2"
[[machine.attachments]]
name = "springs"
kind = "LinearSupport"
at = "disc"
stiffness = ["1e5 N/m", "1e5 N/m", "1e5 N/m", "1e3 N*m/rad", "1e3 N*m/rad", "0 N*m/rad"]
damping = ["60 N*s/m", "60 N*s/m", "1 N*s/m", "1 N*m*s/rad", "1 N*m*s/rad", "0 N*m*s/rad"]
[simulation]
t_end = "1 s"
sample_rate = "1 kHz"
"""
# The same, from a worse start, its unbalance told but for its size.
BALANCED = (
    MACHINE.replace('"0.012 kg*m^2"', '"0.012 kg*m^2"\nunbalance = { angle = "0.7 rad" }')
    .replace('["1e5 N/m", "1e5 N/m"', '["1.3e5 N/m", "1.1e5 N/m"')
    .replace("60 N*s/m", "90 N*s/m")
)


def test_a_study_has_tracking_filters(tmp_path):
    """From TOML: the sensor with its filter, and records of vectors; an unknown kind is told."""
    written(tmp_path)
    study = tmp_path / "study.toml"
    text = (
        MACHINE
        + """
[identify]
records = ["bode.toml"]
[identify.sensors.polar]
kind = "TrackingFilter"
sensor = { kind = "ProximityProbe", station = "disc", angle = "45 deg" }
shaft = "disc"
unit = "um"
mark = "10 deg"
[[identify.unknowns]]
path = "springs.stiffness[0]"
positive = true
"""
    )
    study.write_text(text)
    channel = jr.load(study).identify.sensors["polar"]
    assert isinstance(channel, TrackingFilter) and channel.unit == "um"
    np.testing.assert_allclose(channel.mark, np.radians(10))
    study.write_text(text.replace('"TrackingFilter"', '"TrackingFiltre"'))
    with pytest.raises(jr.InputError, match="kind names no channel .*did you mean .TrackingFilter"):
        jr.load(study)


def asked(channel, values=(1 + 1j,) * 9):
    """`identify` with that channel, as far as it goes before anything runs."""
    data = jr.MeasuredResponse(np.arange(1.0, 10.0), {"a": values})
    return jr.identify(rotor(jr.ConstantSpeed(1.0)), ["springs.damping[0]"], {"a": channel}, data)


def in_a_run(channel, value):
    record = jr.Record({"a": jr.sensors.Series(np.linspace(0.0, 1.0, 9), np.full(9, value))})
    return jr.identify(rotor(jr.ConstantSpeed(1.0)), ["springs.damping[0]"], {"a": channel}, record)


STEADY = """
file = "trials.csv"
speed = { column = "n", unit = "rpm" }
at = "undeformed"
missing = -1
[vectors.a]
column = "a"
phase = { column = "a lag", unit = "deg" }
unit = "um"
[vectors.b]
column = "b re"
imaginary = "b im"
unit = "mil"
[conditions]
"disc.unbalance.eccentricity" = { column = "u", unit = "g*mm/kg" }
"""

BALANCING = (
    BALANCED
    + """
[identify]
responses = ["trials.toml"]
profile = false
[identify.sensors.a]
kind = "TrackingFilter"
sensor = { kind = "ProximityProbe", station = "disc", angle = "0.3 rad" }
shaft = "disc"
mark = "0.2 rad"
unit = "um"
noise = { std = 0.5 }
[identify.sensors.b]
kind = "TrackingFilter"
sensor = { kind = "ProximityProbe", station = "disc", angle = "1.8707963267948966 rad" }
shaft = "disc"
mark = "0.2 rad"
unit = "um"
noise = { std = 0.5 }
[[identify.unknowns]]
path = "springs.stiffness[0]"
positive = true
[[identify.unknowns]]
path = "springs.stiffness[1]"
positive = true
[[identify.unknowns]]
path = "springs.damping[0]"
positive = true
also = { "springs.damping[1]" = 1.0 }
[[identify.unknowns]]
path = "a.mark"
circular = true
also = { "b.mark" = 1.0 }
"""
)


def steady_files(folder, identified, steady=STEADY):
    """The vectors of `identified` as a balancer's table, and what says how it is to be read."""
    a, b = (c.measured for c in identified.channels)
    speeds, trial = identified.channels[0].t, np.tile([1e-5, 3e-5], 5)
    columns = [
        speeds * 30 / np.pi,
        np.abs(a),
        np.degrees(np.angle(a)),
        b.real / 25.4,
        b.imag / 25.4,
    ]
    rows = np.stack([*columns, 1e6 * trial], axis=1)
    heads = "n,a,a lag,b re,b im,u"
    np.savetxt(folder / "trials.csv", rows, "%.15g", ",", header=heads, comments="")
    (folder / "trials.toml").write_text(steady)
    (folder / "study.toml").write_text(BALANCING)
    return folder / "study.toml"


def test_a_study_of_steady_vectors(tmp_path, identified, monkeypatch, capsys):
    """Written as files and identified at the command line, the same vectors say the same."""
    study = steady_files(tmp_path, identified)
    monkeypatch.chdir(tmp_path)
    assert main(["identify", str(study), "--out", "out"]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    for path, value in identified.values.items():
        assert summary["parameters"][path]["value"] == pytest.approx(value, rel=1e-6)
    assert (tmp_path / "out" / "fit.png").is_file()
    assert "springs.stiffness[0]" in capsys.readouterr().out


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('"n", unit = "rpm"', '"n", unit = "kg"', "speed.*its unit"),
        ('speed = { column = "n", unit = "rpm" }', "", "speed is missing"),
        ('column = "a"\n', 'column = "aa"\n', "vectors.a: .*no such column.*did you mean"),
        ('unit = "mil"', "", "vectors.b: `unit` is missing"),
        ("g*mm/kg", "g*mm", "conditions: disc.unbalance.eccentricity: .*unit"),
        (
            "disc.unbalance.ecc",
            "disk.unbalance.ecc",
            "conditions: disk.*no element `disk`: did you mean `disc`",
        ),
        ('at = "undef', 'at = "unref', "trials.toml.*at must be"),
        ("[vectors.", "[vector.", "did you mean `vectors`"),
        ("trials.csv", "trial.csv", "trial.csv.*no such file"),
    ],
)
def test_steady_files_refused(tmp_path, identified, old, new, words):
    study = steady_files(tmp_path, identified, STEADY.replace(old, new))
    machine = jr.load(study).machine
    with pytest.raises(jr.InputError, match=words):
        jr.identification.read_response(tmp_path / "trials.toml", machine)
