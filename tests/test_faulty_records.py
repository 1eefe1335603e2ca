"""Twenty records with something wrong: what is said of each."""

import re
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
import scipy.interpolate

import jaxrotor as jr
from jaxrotor.identification.identify import asked
from jaxrotor.identification.problem import pose
from jaxrotor.identification.simulated import as_vectors, records

END, RATE = 0.4, 300.0
# a coarse step, for records and searches alike: what is judged here is no solver
RUN: Any = dict(initial="undeformed", step=1 / RATE, solver=jr.ETD4RK())
REST = (1e5, 1e3, 1e3, 0.0)  # along the shaft, about x, y and it
NOISE = {"right": 0.03, "top": 0.03, "housing": 0.1, "speed": 1.0, "vector": 0.3}
KNOWN = [
    jr.Unknown("d.unbalance.eccentricity", positive=True),
    jr.Unknown("d.unbalance.angle", circular=True),
    jr.Unknown("bearing.stiffness[0]", positive=True, also={"bearing.stiffness[1]": 1.0}),
    jr.Unknown("bearing.damping[0]", bounds=(1.0, 1e3), also={"bearing.damping[1]": 1.0}),
]


TRUTH = dict(zip((one.path for one in KNOWN), (2e-5, 0.7, 1.2e5, 60.0)))


def machine(e=2e-5, angle=0.7, k=1.2e5, c=60.0):
    """A disc on two springs, run up through its resonance at 39 Hz by its drive."""
    return jr.Machine(
        {
            "d": jr.Rotor(2.0, 0.02, 0.012, unbalance=jr.Unbalance(e, angle)),
            "bearing": jr.LinearSupport([k, k, *REST], [c, c, 1.0, 1.0, 1.0, 0.0]),
        },
        {"bearing": "d"},
        prescribed={"d": {"phi": jr.CosineRamp(speed=400.0, duration=END)}},
    )


def sensors():
    right, top = (jr.sensors.ProximityProbe("d", angle) for angle in (0.3, 0.3 + np.pi / 2))
    chains = {
        "right": (right, "V", 8000.0),
        "top": (top, "V", 8000.0),
        "housing": (jr.sensors.Accelerometer("d", (0, 1, 0)), "", 1.0),
        "speed": (jr.sensors.Tachometer("d"), "", 1.0),
    }
    found = {
        name: jr.Channel(sensor, unit, size, noise=jr.sensors.Noise(NOISE[name]))
        for name, (sensor, unit, size) in chains.items()
    }
    noise = jr.sensors.Noise(NOISE["vector"])
    found["vector"] = jr.sensors.TrackingFilter(top, "d", unit="um", noise=noise)
    return found


SENSORS = sensors()


@pytest.fixture(scope="module")
def good():
    """name -> instants and values, with noise."""
    t = np.arange(int(END * RATE) + 1) / RATE
    times = {name: t[24:120:3] if name == "vector" else t for name in SENSORS}
    blank = {
        name: jr.sensors.Series(at, (1j if name == "vector" else 1.0) * np.ones(len(at)))
        for name, at in times.items()
    }
    # by the program that serves all the searches below
    data = jr.MeasuredRun(jr.Record(blank), **RUN)
    bench, space, _, _, trials = asked(machine(), KNOWN, SENSORS, data)
    planned = [trial.planned(bench.machine) for trial in trials]
    simulated = pose(bench, space, planned, jr.identification.Time(), None).simulated
    rng, found = np.random.default_rng(3), {}
    for (name, at), record in zip(times.items(), records(simulated, jnp.zeros(len(KNOWN)))):
        noisy = np.asarray(record) + NOISE[name] * rng.standard_normal(len(record))
        found[name] = (at, as_vectors(noisy) if name == "vector" else noisy)
    return found


def identified(good, loss="squares", **changes):
    """With other instants and values of some channels."""
    series = {
        name: jr.sensors.Series(*(good | changes)[name], channel.recorded_in)
        for name, channel in SENSORS.items()
    }
    data = jr.MeasuredRun(jr.Record(series), **RUN)
    return jr.identify(machine(2.1e-5, 0.6, 1.18e5, 65.0), KNOWN, SENSORS, data, loss=loss)


def late(delay):
    return lambda t, v: scipy.interpolate.CubicSpline(t, v)(np.clip(t - delay, t[0], t[-1]))


def spiked(t, v):
    v[[9, 92]] += [4.0, -4.0]
    return v


def held(t, v):
    v[72:87] = v[72]
    return v


@pytest.fixture(scope="module")
def clean(good):
    return identified(good)


def test_nothing_is_said_of_a_good_record(clean):
    assert clean.suspects == () and clean.warnings == ()


# channel, what is wrong with it, what is said of it
FITTED = {
    "wrong sign": ("right", lambda t, v: -v, "`right` of `run` looks inverted: turn its direction"),
    "wrong sign of an accelerometer": ("housing", lambda t, v: -v, "`housing` of `run` looks inverted"),
    "g for m/s^2": ("housing", lambda t, v: v / 9.80665, r"9\.\d+ times too little \(g and m/s\^2\?\)"),
    "mm for m": ("housing", lambda t, v: 1e3 * v, r"1\d\d\d|9\d\d times too much \(m, mm and um\?\)"),
    "mil for um": ("vector", lambda t, v: v / 25.4, r"25\.\d times too little \(mil and um, .*vector.unit"),
    "peak-to-peak": ("vector", lambda t, v: 2 * v, r"(1\.9\d|2|2\.0\d) times .*peak-to-peak"),
    "wrong sensitivity": ("top", lambda t, v: 1.6 * v, r"1\.(5[6-9]|6|6[1-4]) times too much: see `top.sens"),
    "gap voltage": ("top", lambda t, v: v - 9.2, r"offset of -9\.2 V: .*`top.bias`"),
    "late": ("top", late(3e-3), r"comes (2\.[89]\d?|3|3\.[01]\d?) ms late: .*`top.delay`"),
    "early": ("housing", late(-2e-3), r"comes (1\.[89]\d?|2|2\.[01]\d?) ms early"),
    "spikes": ("right", spiked, r"holds 2 spikes, the first at 0\.03 s: .*loss=.huber"),
    "dead": ("housing", lambda t, v: 0 * v + 0.3, "`housing` of `run` never changes: is it connected"),
    "filled gap": ("right", held, r"holds still from 0\.24 to 0\.2867 s: a gap filled"),
    "speed of another shaft": ("speed", lambda t, v: 0.37 * v, r"2\.7 times too little \(another shaft"),
    "pulses a turn": ("speed", lambda t, v: 2 * v, r"2 times too much \(two pulses a turn\? another"),
    "lag for lead": ("vector", lambda t, v: np.conj(v), "looks conjugated: a lag taken for a lead"),
    "wrong mark": ("vector", lambda t, v: 1j * v, r"looks turned by (89|90|91) degrees: .*`vector.mark`"),
    "slow roll": ("vector", lambda t, v: v + 8 - 6j, r"constant vector of (9|10)\S* um at -3\d degrees"),
}  # fmt: skip


@pytest.mark.parametrize("channel, fault, words", FITTED.values(), ids=FITTED)
def test_fitted(good, channel, fault, words):
    t, values = good[channel]
    (said,) = identified(good, **{channel: (t, fault(t, values.copy()))}).suspects
    assert f"`{channel}` of `run`" in said
    assert re.search(words, said), said


def test_swapped(good):
    found = identified(good, right=good["top"], top=good["right"])
    assert found.suspects == (
        "`right` and `top` of `run` look swapped: name their columns the other way round",
    )
    assert found.suspects[0] in found.warnings and found.suspects[0] in str(found)


def test_several(good):
    """Two channels wrong of five, each in its own way."""
    (t, right), (_, housing) = good["right"], good["housing"]
    said = identified(good, right=(t, -right), housing=(t, housing + 6.0)).suspects
    assert len(said) == 2 and "inverted" in said[0] and "an offset of" in said[1], said


def test_spikes_and_losses(good, clean):
    """5 % of spikes, all to one side: squares are led astray, robust losses are not, and say the same as
    squares without them."""
    rng = np.random.default_rng(1)
    changes = {}
    for name in ("right", "top", "housing"):
        t, values = good[name]
        out = rng.random(len(t)) < 0.05
        size = 80 * NOISE[name] * rng.uniform(0.5, 1.5, len(t))
        changes[name] = (t, values + out * size * np.sign(values))
    astray = identified(good, **changes)
    off = [abs(astray.values[p] - x) / clean.std[p] for p, x in TRUTH.items()]
    assert max(off) > 4
    found = identified(good, "student", **changes)  # by way of Huber's
    for path, x in TRUTH.items():
        assert abs(found.values[path] - x) < 3.5 * found.std[path], path
        assert 0.75 < found.std[path] / clean.std[path] < 1.6
    same = identified(good, "huber")
    for path in TRUTH:
        assert abs(same.values[path] - clean.values[path]) < 0.7 * clean.std[path]
        assert same.std[path] == pytest.approx(clean.std[path], rel=0.2)
    assert same.warnings == ()


T = np.arange(20) / 10


@pytest.mark.parametrize(
    "t, values, words",
    [
        (np.where(T == 0.7, np.nan, T), T, "the instant in row 8 is nan: every value needs its time"),
        (np.where(T == 0.7, 0.6, T), T, r"row 8 is at 0\.6 s again 0\.6 s \(1 such rows\)"),
        (T[::-1], T, "time must rise"),
        (T, np.where(T == 0.7, np.inf, T), "the value in row 8 is infinite"),
        (T, T[1:], "as many values as instants"),
        (T, np.full(20, np.nan), "has 0 values; 4 at least are needed: is the right column"),
    ],
    ids=["NaN time", "twice", "backwards", "infinite", "ragged", "empty"],
)  # fmt: skip
def test_refused(t, values, words):
    with pytest.raises(jr.InputError, match=words):
        jr.sensors.Series(t, values, "V")


def test_another_kind_of_unit(good):
    series = {"housing": jr.sensors.Series(*good["housing"], "mm/s")}
    with pytest.raises(jr.InputError, match="is in mm/s, but the channel records m/s"):
        jr.identify(machine(), KNOWN, SENSORS, jr.Record(series))
