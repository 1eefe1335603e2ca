"""Identification from synthetic runs whose truth is known."""

import jax
import numpy as np
import pytest

import jaxrotor as jr
import jaxrotor.identification.simulated as simulated_module

TRUTH = {
    "d.unbalance.eccentricity": 2e-5,
    "d.unbalance.angle": 0.7,
    "bearing.stiffness[0]": 1.2e5,
    "bearing.damping[0]": 60.0,
}
SENSORS = {
    "probe": jr.Channel(
        jr.sensors.ProximityProbe("d", 0.3), unit="V", sensitivity=8000.0, delay=2e-4
    ),
    "housing": jr.Channel(jr.sensors.Accelerometer("d", (0, 1, 0))),
}
KNOWN = [
    jr.Unknown("d.unbalance.eccentricity", positive=True),
    jr.Unknown("d.unbalance.angle", circular=True),
    jr.Unknown("bearing.stiffness[0]", positive=True, also={"bearing.stiffness[1]": 1.0}),
    jr.Unknown("bearing.damping[0]", bounds=(1.0, 1e3), also={"bearing.damping[1]": 1.0}),
]
END, RATE = 0.5, 1000.0
REST = (1e5, 1e3, 1e3, 0.0)  # along the shaft, about x, y and it


def rotor(values=TRUTH, **extra):
    """A disc on two springs, run up through its resonance at 39 Hz by its drive."""
    e, angle, k, c = values.values()
    machine = jr.Machine(
        {
            "d": jr.Rotor(2.0, 0.02, 0.012, unbalance=jr.Unbalance(e, angle)),
            "bearing": jr.LinearSupport([k, k, *REST], [c, c, 1.0, 1.0, 1.0, 0.0]),
        },
        {"bearing": "d"},
        prescribed={"d": {"phi": jr.CosineRamp(speed=400.0, duration=END)}},
    )
    return machine.set(extra)


def noisy(level):
    """`SENSORS` with noise of so much of what each sees."""
    size = {"probe": 1.5, "housing": 5.0}
    return {
        name: jr.Channel(
            c.sensor,
            c.unit,
            c.sensitivity,
            delay=c.delay,
            noise=jr.sensors.Noise(level * size[name]),
        )
        for name, c in SENSORS.items()
    }


def simulated(machine):
    return jr.simulate(machine, END + 2 / RATE, RATE, "undeformed")


@pytest.fixture(scope="module")
def run():
    return simulated(rotor())


def trial(run, sensors=SENSORS, seed=None):
    return jr.MeasuredRun(record(run, sensors, seed), initial="undeformed")


def record(run, sensors=SENSORS, seed=None, name="run"):
    """The probe at full rate with a gap, the housing at half of it."""
    t = np.arange(int(END * RATE) + 1) / RATE
    times = {"probe": t, "housing": t[::2]}
    keys = dict(zip(sensors, jax.random.split(jax.random.key(seed or 0), len(sensors))))
    series = {}
    for key, channel in sensors.items():
        at = times[key]
        clean = channel.measure(run, at) if seed is None else channel.recorded(run, keys[key], at)
        values = np.array(clean)
        if key == "probe":
            values[100:130] = np.nan
        series[key] = jr.sensors.Series(at, values, channel.recorded_in)
    return jr.Record(series, name)


def wrong(**changes):
    """All of it 50 % wrong, the angle by 2.6 rad."""
    return rotor({**dict(zip(TRUTH, (3e-5, 0.7 - 2.6, 0.6e5, 30.0))), **changes})


@pytest.fixture(scope="module")
def found(run):
    stages = (jr.identification.Orders(turns=4.0), jr.identification.Time())
    starts = [{"d.unbalance.angle": 0.7 - 2.6 + a} for a in (np.pi / 2, np.pi, 1.5 * np.pi)]
    return jr.identify(wrong(), KNOWN, SENSORS, trial(run), stages=stages, starts=starts)


def test_without_noise(found):
    for path, value in TRUTH.items():
        rel, absolute = (0, 1e-6) if "angle" in path else (1e-6, 0)
        assert found.values[path] == pytest.approx(value, rel=rel, abs=absolute)
    assert found.stopped and all(len(h) <= 20 for h in found.histories.values())
    assert found.machine.get("bearing.stiffness")[1] == pytest.approx(1.2e5, rel=1e-6)  # the tie
    assert found.blind == ()


def test_plans_of_other_values_are_equal():
    """So programs that hold a plan are compiled once for all starts of a search."""
    one, two = (jr.plan(machine, END, RATE) for machine in (rotor(), wrong()))
    assert one.error != two.error and one == two and hash(one) == hash(two)


def test_slopes_are_those_of_central_differences(found):
    from jaxrotor.identification.simulated import records, records_and_slopes

    u = np.array([0.1, -0.2, 0.05, 0.3])
    _, slopes = records_and_slopes(found.problem.simulated, u[None])
    for i, h in enumerate(1e-5 * np.eye(4)):
        up, down = (records(found.problem.simulated, u + s * h) for s in (1, -1))
        for a, b, slope in zip(up, down, slopes):
            central = np.asarray(a - b)[5:] / 2e-5
            size = np.nanmax(np.abs(central))
            np.testing.assert_allclose(slope[0, 5:, i], central, atol=1e-7 * size)


@pytest.fixture(scope="module")
def found_in_noise(run):
    """From a record with 5 % noise."""
    sensors = noisy(0.05)
    return jr.identify(rotor(), KNOWN, sensors, trial(run, sensors, 7))


def test_with_noise(run, found_in_noise):
    """5 % noise: an interval for each, the truth within four standard deviations, a residual that is white;
    a held-out run is met, and another machine's is not."""
    sensors, found = noisy(0.05), found_in_noise
    for path, value in TRUTH.items():
        assert abs(found.values[path] - value) < 4 * found.std[path]
        low, high = found.intervals()[path]
        assert low < found.values[path] < high
    assert found.warnings == ()
    assert all(c.white > 0.01 and c.sized > 0.01 for c in found.channels)
    again = found.predicted(trial(run, sensors, 8))
    assert all(c.white > 1e-3 and c.sized > 1e-3 for c in again)
    other = simulated(rotor({**TRUTH, "d.unbalance.eccentricity": 4e-5}))
    assert all(c.sized < 1e-6 for c in found.predicted(trial(other, sensors, 8)))


def test_noise_of_unknown_size(run, monkeypatch):
    """Each channel's noise is found from its residual, with no place simulated twice: but for a cost that was
    tried and found lower, whose slopes follow."""
    simulations = []

    def watched(name):
        own = getattr(simulated_module, name)

        def told(what, u):
            simulations.append((np.asarray(u).tobytes(), name))
            return own(what, u)

        monkeypatch.setattr(simulated_module, name, told)

    watched("_records")
    watched("_records_and_slopes")
    sensors = noisy(0.05)
    unknown = {
        k: jr.Channel(c.sensor, c.unit, c.sensitivity, delay=c.delay) for k, c in sensors.items()
    }
    found = jr.identify(rotor(), KNOWN, unknown, trial(run, sensors, 9))
    for fit in found.channels:
        assert fit.std == pytest.approx(float(sensors[fit.channel].noise.std), rel=0.1)
    assert len(set(simulations)) == len(simulations) > 5
    for i, (place, name) in enumerate(simulations):
        before = [other for other, _ in simulations[:i]]
        assert name == "_records_and_slopes" or place not in before


def test_intervals_cover_the_truth(found_in_noise):
    """60 records with 5 % noise in one batch: coverage of the 95 % intervals and spread of the estimates."""
    replicas = jr.identification.bootstrap(found_in_noise, 60, seed=1)
    for path, part in replicas.coverage.items():
        assert 0.85 <= part <= 1.0, path  # 60 of them: three standard deviations
    for path, ratio in replicas.spread.items():
        assert 0.7 < ratio < 1.3, path


def test_what_cannot_be_seen(run):
    """Without eccentricity the angle means nothing; stiffness of a spring and its double tie likewise."""
    machine = rotor({**TRUTH, "d.unbalance.eccentricity": 0.0}, **{"d.unbalance.inclination": 1e-3})
    found = jr.identify(machine, ["d.unbalance.angle"], SENSORS, trial(run))
    assert found.blind == ({"d.unbalance.angle": 1.0},)
    assert np.isinf(found.std["d.unbalance.angle"])
    assert "the data cannot see `d.unbalance.angle`" in str(found)
    pair = [
        jr.Unknown("probe.sensitivity", positive=True),
        jr.Unknown("d.unbalance.eccentricity", positive=True),
    ]
    alone = jr.Record({"probe": record(run)["probe"]})
    found = jr.identify(rotor(), pair, SENSORS, jr.MeasuredRun(alone, initial="undeformed"))
    assert [set(d) for d in found.blind] == [{"probe.sensitivity", "d.unbalance.eccentricity"}]
    assert any("the data cannot see +1" in w for w in found.warnings)


def test_a_wrong_model_is_noticed(run):
    """The truth has stiffer springs across; the model holds both alike."""
    sensors = noisy(0.01)
    truth = rotor(**{"bearing.stiffness": np.array([1.2e5, 1.5e5, *REST])})
    data = trial(simulated(truth), sensors, 4)
    found = jr.identify(rotor(), KNOWN, sensors, data)
    assert any("is not white" in w for w in found.warnings)
    assert any("larger than its noise" in w for w in found.warnings)
    free = [
        *KNOWN[:2],
        jr.Unknown("bearing.stiffness[0]"),
        jr.Unknown("bearing.stiffness[1]"),
        KNOWN[3],
    ]
    stages = (jr.identification.Orders(turns=4.0), jr.identification.Time())
    right = jr.identify(rotor(), free, sensors, data, stages=stages)
    assert right.warnings == () and right.bic < found.bic and right.aic < found.aic


def test_several_runs_a_prior_and_a_delay(run):
    """Two runs with another drive; a clock's offset is found beside the stiffness; a prior alone decides what
    the data cannot see."""
    sensors = {"probe": SENSORS["probe"]}
    slow = {"d.phi.speed": 250.0}
    other = simulated(rotor(**slow))
    data = [
        jr.MeasuredRun(
            jr.Record({"probe": record(r)["probe"]}, name),
            initial="undeformed",
            conditions=conditions,
        )
        for r, name, conditions in ((run, "fast", {}), (other, "slow", slow))
    ]
    unknowns = [
        KNOWN[2],
        jr.Unknown("probe.delay", start=0.0, scale=1e-4),
        jr.Unknown("gravity[2]", start=1.0, prior=(2.0, 0.1)),
    ]
    machine = rotor({**TRUTH, "bearing.stiffness[0]": 0.6e5})
    stages = (jr.identification.Orders(turns=4.0), jr.identification.Time())
    found = jr.identify(machine, unknowns, sensors, data, stages=stages)
    assert found.values["bearing.stiffness[0]"] == pytest.approx(1.2e5, rel=1e-6)
    assert found.values["probe.delay"] == pytest.approx(2e-4, abs=1e-9)
    assert found.values["gravity[2]"] == pytest.approx(2.0, rel=1e-6)
    assert {c.run for c in found.channels} == {"fast", "slow"}


def test_correction_from_what_was_found(found):
    """The identified static unbalance, taken out in two planes: the machine no longer whirls."""
    correction = jr.identification.correction(found, "d", (-0.02, 0.03))
    assert correction.unbalance.sum() == pytest.approx(-2.0 * 2e-5 * np.exp(0.7j), rel=1e-6)
    assert (correction.std.real >= 0).all() and correction.grade(2.0, 400.0) < 1e-3


def test_saved(found, tmp_path):
    import json

    told = json.loads(found.save(tmp_path / "found.json").read_text())
    entry = told["parameters"]["bearing.stiffness[0]"]
    assert entry["unit"] == "N/m" and entry["value"] == pytest.approx(1.2e5)


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(parameters=["d.unbalance.excentricity"]), "did you mean"),
        (dict(parameters=["bearing.stiffness"]), "has 6 entries: name one, such as"),
        (dict(parameters=["bearing.stiffness[7]"]), "no such entry"),
        (dict(parameters=["d.unbalance"]), "is a part with several parameters"),
        (dict(parameters=["wheel.mass"]), "`wheel.mass`"),
        (dict(parameters=["d.mass", "d.mass"]), "looked for twice"),
        (dict(parameters=[]), "no parameter is looked for"),
        (dict(parameters=[jr.Unknown("d.mass", positive=True, circular=True)]), "choose one of"),
        (dict(parameters=[jr.Unknown("d.mass", bounds=(3.0, 4.0))]), "not between its bounds"),
        (dict(parameters=[jr.Unknown("d.mass", bounds=(3.0, 1.0))]), "bounds must rise"),
        (dict(parameters=[jr.Unknown("d.mass", start=-1.0, positive=True)]), "starts at -1"),
        (dict(parameters=[jr.Unknown("gravity[0]")]), "starts at zero: give `scale`"),
        (dict(parameters=[jr.Unknown("d.mass", prior=(1.0, 0.0))]), "standard deviation of its prior"),
        (dict(sensors={"d": SENSORS["probe"]}), "give the channel another name"),
        (dict(sensors={"probe": 3.0}), "must be a sensor or a Channel"),
        (dict(sensors={"housing": SENSORS["housing"]}), "probe.*no channel"),
        (dict(data=[]), "no data"),
        (dict(data=3.0), "must be Records, MeasuredRuns or MeasuredResponses"),
        (dict(stages=()), "name one at least"),
        (dict(stages=(jr.identification.Orders(turns=500.0),)), "too few for windows"),
        (dict(stages=(jr.identification.Frequencies(0.001, 0.01),)), "gaps|no line"),
        (dict(starts=[{"d.mass": 1.0}]), "is not looked for"),
        (dict(starts=[{"bearing.damping[0]": 1e4}]), "out of its bounds"),
        (dict(loss="cauchy"), "loss must be 'squares' or 'huber' or 'student', but is 'cauchy'"),
        (dict(shaft="wheel", stages=(jr.identification.Orders(),)), "wheel"),
    ],
)  # fmt: skip
def test_refused_before_anything_runs(run, change, words):
    given = dict(parameters=KNOWN, sensors=SENSORS, data=record(run)) | change
    with pytest.raises(jr.InputError, match=words):
        jr.identify(rotor(), **given)


def test_units_of_records(run):
    """A record in another unit of the same kind is converted, another kind refused."""
    one = record(run)["housing"]
    same = jr.Record({"housing": jr.sensors.Series(one.t, 1e3 * one.values, "mm/s^2")})
    same = jr.MeasuredRun(same, initial="undeformed")
    found = jr.identify(rotor(), KNOWN[:1], {"housing": SENSORS["housing"]}, same)
    assert found.values["d.unbalance.eccentricity"] == pytest.approx(2e-5, rel=1e-9)
    other = jr.Record({"housing": jr.sensors.Series(one.t, one.values, "mm/s")})
    with pytest.raises(jr.InputError, match="is in mm/s, but the channel records m/s"):
        jr.identify(rotor(), KNOWN[:1], {"housing": SENSORS["housing"]}, other)
    short = jr.Record({"housing": jr.sensors.Series(one.t[:4], one.values[:4])})
    with pytest.raises(jr.InputError, match="4 measured values cannot tell 4 parameters"):
        jr.identify(rotor(), KNOWN, {"housing": SENSORS["housing"]}, short)
