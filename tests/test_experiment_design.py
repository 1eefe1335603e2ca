"""Which sensors and runs tell most: against closed solutions, exhaustive search and `identify`."""

import itertools

import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.identification.selection import judge_of

M, E, ANGLE, K, C = 2.0, 2e-5, 0.7, 1.2e5, 60.0
REST = (1e5, 1e3, 1e3, 0.0)  # along the shaft, about x, y and it
UNKNOWNS = [
    jr.Unknown("d.unbalance.eccentricity", positive=True),
    jr.Unknown("d.unbalance.angle", circular=True),
    jr.Unknown("bearing.stiffness[0]", positive=True, also={"bearing.stiffness[1]": 1.0}),
    jr.Unknown("bearing.damping[0]", also={"bearing.damping[1]": 1.0}),
]
PATHS = [u.path for u in UNKNOWNS]
RATE = 1000.0


def rotor(e=E, angle=ANGLE, k=K, c=C):
    """A disc on two equal springs, turned at a given speed; in resonance at 39 Hz."""
    return jr.Machine(
        {
            "d": jr.Rotor(M, 0.02, 0.012, unbalance=jr.Unbalance(e, angle)),
            "bearing": jr.LinearSupport([k, k, *REST], [c, c, 1.0, 1.0, 1.0, 0.0]),
        },
        {"bearing": "d"},
        prescribed={"d": {"phi": jr.ConstantSpeed(100.0)}},
    )


def probe(angle, std=0.01, **more):
    sensor = jr.sensors.ProximityProbe("d", angle)
    return jr.Channel(sensor, "V", 8000.0, noise=jr.sensors.Noise(std), **more)


# of all runs, so that they are one program
PLAN = jr.Plan(2, 6, 250.0, 320.0, 1e-6, 5e-5)


def at(hertz, initial, samples):
    """A run at constant speed."""
    simulation = jr.Simulation((samples - 1) / RATE, RATE, initial, step=PLAN)
    return jr.identification.CandidateRun(simulation, {"d.phi.speed": 2 * np.pi * hertz})


# ---- the periodic whirl, whose information is known -------------------------------------------------------


def whirl(hertz, angle, std):
    """Information on e, angle, k, c of a probe along `angle`, over 200 samples of whole turns: the whirl is
    r = e m w^2 / (k - m w^2 + i c w) exp(i (w t + alpha)), of which it sees the real part of
    exp(-i angle) r, and the mean product of two such waves is half the real part of theirs."""
    w = 2 * np.pi * hertz
    stiff = K - M * w**2 + 1j * C * w
    r = E * M * w**2 / stiff * np.exp(1j * (ANGLE - angle))
    slopes = 8000.0 / std * np.array([r / E, 1j * r, -r / stiff, -1j * w * r / stiff])
    return 0.5 * 200 * np.real(np.outer(slopes.conj(), slopes))


@pytest.fixture(scope="module")
def steady():
    sensors = {"x": probe(0.0), "y": probe(np.pi / 2), "poor": probe(0.3, 0.1)}
    runs = {f"{hz} Hz": at(hz, "steady", 200) for hz in (25, 40, 50)}
    return jr.experiment_design(rotor(), UNKNOWNS, sensors, runs, choose=1)


def test_information_of_a_periodic_whirl(steady):
    """To the tolerance that the runs are planned for, 5e-5 of the path, and its like for their slopes."""
    for i, (angle, std) in enumerate(((0.0, 0.01), (np.pi / 2, 0.01), (0.3, 0.1))):
        for j, hertz in enumerate((25, 40, 50)):
            expected = whirl(hertz, angle, std)
            size = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
            np.testing.assert_allclose(steady.information[i, j] / size, expected / size, atol=1e-3)
    whole = sum(whirl(hz, 0.0, 0.01) for hz in (25, 40, 50))
    np.testing.assert_allclose(
        list(steady.expected(["x"]).values()), np.sqrt(np.linalg.inv(whole).diagonal()), rtol=2e-3
    )


def test_which_sensor_is_best(steady):
    """In a circular whirl both good probes tell the same, so the first is taken; the poor one is last, and
    brings one part in 201 beside both."""
    assert steady.chosen == ("x",) and [steady.names[c] for c in steady.order] == ["x", "y", "poor"]
    assert steady.spreads[0] == np.inf  # nothing is known beforehand
    assert steady.spreads[2] / steady.spreads[1] == pytest.approx(0.5**0.5, rel=1e-3)
    assert steady.spreads[3] / steady.spreads[2] == pytest.approx((200 / 201) ** 0.5, rel=1e-4)
    assert steady.further["poor"] / steady.spread == pytest.approx((100 / 101) ** 0.5, rel=1e-4)
    np.testing.assert_allclose(steady.shares[2], 0.01 / 2.01, rtol=1e-2)
    assert steady.std == steady.expected(["x"]) and steady.stds.shape == (4, 4)
    assert steady.blind == () and steady.warnings == ()
    with pytest.raises(jr.InputError, match="did you mean 'poor'"):
        steady.expected(["por"])


def test_it_prints(steady):
    words = str(steady)
    assert "1 of 3 sensors chosen, in each of 3 runs (25 Hz, 40 Hz, 50 Hz)" in words
    assert " ".join(words.split("\n")[7].split()[:3]) == "bearing.stiffness[0] 120000 N/m"
    assert "or +  y       0.0649 %  0.707  all -29 %" in words


@pytest.fixture(scope="module")
def uncalibrated():
    """Probes along x and y, of which the first one's sensitivity is not known."""

    def design(unknowns, sensors=("x", "y"), **how):
        probes = {"x": probe(0.0), "y": probe(np.pi / 2)}
        chosen = {name: probes[name] for name in sensors}
        runs = {"25 Hz": at(25, "undeformed", 200)}
        unknowns = [*UNKNOWNS[:2], jr.Unknown(f"{unknowns}.sensitivity", positive=True)]
        return jr.experiment_design(rotor(), unknowns, chosen, runs, **how)

    return design


def test_what_no_candidate_sees(uncalibrated):
    """A probe of unknown sensitivity alone tells its product with the eccentricity; the angle, which is seen
    all the same, is judged by."""
    found = uncalibrated("x", ("x",))
    assert [set(d) for d in found.blind] == [{"d.unbalance.eccentricity", "x.sensitivity"}]
    assert found.blind == found.blind_to_all
    assert "none of the candidates sees +1" in str(found) and "hold one of these" in str(found)
    assert np.isinf(found.std["x.sensitivity"]) and np.isfinite(found.std["d.unbalance.angle"])
    assert found.spread == pytest.approx(found.std["d.unbalance.angle"], rel=1e-6)
    with pytest.raises(jr.InputError, match="no candidate sees `d.unbalance.ecc"):
        uncalibrated("x", ("x",), criterion="d.unbalance.eccentricity")


def test_nobody_misses_the_sensitivity_of_what_is_not_used(uncalibrated):
    """The calibrated probe comes first; what is not known of the other is no loss while it is not used."""
    found = uncalibrated("x", choose=1)
    assert found.chosen == ("y",) and found.blind == () and found.warnings == ()
    assert found.blind_to_all == () and np.isinf(found.std["x.sensitivity"])
    assert np.isfinite(found.std["d.unbalance.eccentricity"]) and np.isfinite(found.spread)
    assert np.isfinite(found.std_of_all["x.sensitivity"])


# ---- a transient: what identify states, and how estimates scatter ------------------------------------------


SENSORS = {
    "x": probe(0.0),
    "slanted": probe(0.8, 0.02, delay=1e-3),
    "housing": jr.Channel(
        jr.sensors.Accelerometer("d", (0, 1, 0)), noise=jr.sensors.Noise(0.03, 1e-3)
    ),
    "tacho": jr.Channel(jr.sensors.Tachometer("d"), noise=jr.sensors.Noise(0.1)),
}


@pytest.fixture(scope="module")
def transient():
    runs = {"30 Hz": at(30, "undeformed", 200), "45 Hz": at(45, "undeformed", 200)}
    return jr.experiment_design(rotor(), UNKNOWNS, SENSORS, runs, choose=3, of="pairs")


def test_identify_states_what_was_expected(transient):
    """On the record without its noise, so that the estimate is the truth."""
    run = at(30, "undeformed", 200)
    machine = rotor().set(run.conditions)
    response = jr.simulate(machine, 0.202, RATE, "undeformed", step=PLAN)
    t = np.arange(200) / RATE
    series = {
        name: jr.sensors.Series(t, np.asarray(channel.measure(response, t)), channel.recorded_in)
        for name, channel in SENSORS.items()
    }
    data = jr.MeasuredRun(jr.Record(series), run.simulation, run.conditions)
    found = jr.identify(rotor(), UNKNOWNS, SENSORS, data)
    expected = transient.expected([f"{name} of 30 Hz" for name in SENSORS])
    for path, value in zip(PATHS, (E, ANGLE, K, C)):
        assert found.std[path] == pytest.approx(expected[path], rel=1e-6)
        assert found.values[path] == pytest.approx(value, rel=1e-6)


def test_estimates_scatter_as_expected(transient):
    """4000 records with noise, estimated by least squares on central differences of plain simulations: their
    scatter is known to 1.1 %, four times of which is allowed."""
    truth = np.array([E, ANGLE, K, C])
    steps = 1e-4 * np.array([E, 1.0, K, C])
    t, columns = np.arange(200) / RATE, []
    for h in np.diag(steps):
        ends = []
        for theta in (truth + h, truth - h):
            speed = {"d.phi.speed": 2 * np.pi * 30}
            run = jr.simulate(rotor(*theta).set(speed), 0.202, RATE, "undeformed", step=PLAN)
            told = [SENSORS[n].measure(run, t) / SENSORS[n].noise.std for n in ("x", "housing")]
            ends.append(np.concatenate(told))
        columns.append((ends[0] - ends[1]) / 2)
    noise = np.random.default_rng(0).normal(size=(400, 4000))
    estimates = np.linalg.lstsq(np.array(columns).T, noise, rcond=None)[0]
    scatter = estimates.std(axis=1) * steps
    expected = transient.expected(["x of 30 Hz", "housing of 30 Hz"])
    np.testing.assert_allclose(scatter, list(expected.values()), rtol=0.045)


def spreads_of(information, kind):
    """By the definitions, in relative coordinates."""
    covariance = np.linalg.inv(information)
    size = np.linalg.eigvalsh(covariance)
    return {
        "D": np.prod(size) ** (0.5 / len(size)),
        "A": np.mean(size) ** 0.5,
        "E": size.max() ** 0.5,
    }[kind]


def test_chosen_pairs_are_the_best_of_all(transient):
    """All 56 choices of three of eight, from the information that is told in SI units."""
    sizes = np.array([E, 1.0, K, C])
    each = (transient.information * np.outer(sizes, sizes)).reshape(8, 4, 4)
    sets = list(itertools.combinations(range(8), 3))

    def value(members):
        information = each[list(members)].sum(axis=0)
        seen = np.linalg.eigvalsh(information)[0] > 1e-6 * np.trace(information)
        return spreads_of(information, "D") if seen else np.inf

    values = [value(members) for members in sets]
    best = sets[int(np.argmin(values))]
    assert set(transient.chosen) == {transient.names[c] for c in best}
    assert transient.spread == pytest.approx(min(values), rel=1e-6)
    # and what a fourth would bring
    chosen = [transient.names.index(name) for name in transient.chosen]
    for name, spread in transient.further.items():
        fourth = value((*chosen, transient.names.index(name)))
        assert spread == pytest.approx(fourth, rel=1e-6)
    assert "tacho of 30 Hz" in transient.further and "no gain" in str(transient)
    assert any("`housing`: its noise is correlated" in w for w in transient.warnings)


@pytest.mark.parametrize("kind", ["D", "A", "E"])
def test_exchange_meets_exhaustive_search(kind):
    """Forty random cases, each four of nine candidates that see one direction or two of three: the best of
    126 sets in nine of ten at least, and never beyond half as much again (sets that one exchange does not
    better exist)."""
    losses = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        slopes = [rng.normal(size=(rng.integers(1, 3), 3)) * rng.lognormal() for _ in range(9)]
        base = np.zeros((0, 3))
        judge = judge_of(base, slopes, np.eye(3), kind)
        chosen = judge.best(4)
        of = lambda members, s=slopes: spreads_of(  # noqa: E731
            sum(s[c].T @ s[c] for c in members), kind
        )
        best = min(map(of, itertools.combinations(range(9), 4)))
        assert judge.spread(chosen) == pytest.approx(of(chosen), rel=1e-6)
        losses.append(of(chosen) / best - 1)
    losses = np.array(losses)
    assert np.mean(losses < 1e-9) >= 0.9 and losses.max() < 0.5


def test_a_prior_counts(transient):
    """Before anything is measured it is all that is known; beside a record the informations add up."""
    unknowns = [*UNKNOWNS[:3], jr.Unknown(PATHS[3], prior=(C, 3.0), also=UNKNOWNS[3].also)]
    runs = {"30 Hz": at(30, "undeformed", 200), "45 Hz": at(45, "undeformed", 200)}
    found = jr.experiment_design(rotor(), unknowns, SENSORS, runs, of="runs", criterion=PATHS[3])
    assert found.spreads[0] == pytest.approx(3.0 / C, rel=1e-6)
    np.testing.assert_allclose(found.prior_information, np.diag([0, 0, 0, 1 / 9]), atol=1e-12)
    np.testing.assert_allclose(found.information, transient.information, rtol=1e-6)
    whole = transient.information.sum(axis=(0, 1)) + found.prior_information
    expected = np.sqrt(np.linalg.inv(whole).diagonal())
    np.testing.assert_allclose(list(found.std.values()), expected, rtol=1e-6)
    assert found.spread == pytest.approx(expected[3] / C, rel=1e-6)
    assert found.chosen[0] in ("30 Hz", "45 Hz") and "2 of 2 runs chosen" in str(found)


def test_it_is_drawn(transient):
    axes = transient.plot().ravel()
    assert len(axes) == 2 and axes[0].get_yscale() == "log"
    ticks = [tick.get_text() for tick in axes[1].get_yticklabels()]
    assert ticks == [transient.names[c] for c in transient.order]
    assert len(axes[1].patches) == 8 * 4  # a bar for each candidate and unknown


def test_a_run_that_does_not_stay_finite(transient):
    """Damping that drives, by a factor e each 0.07 ms."""
    wild = rotor(c=-60000.0)
    runs = {"wild": at(30, "undeformed", 200)}
    with pytest.raises(jr.ConvergenceError, match="run `wild`: does not stay finite at `x`"):
        jr.experiment_design(wild, UNKNOWNS, SENSORS, runs)


# ---- what is refused ---------------------------------------------------------------------------------------


RUN = jr.Simulation(0.2, RATE, "undeformed")


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(sensors={"x": jr.Channel(SENSORS["x"].sensor), "y": jr.sensors.Tachometer("d")}),
         "`x`: needs a noise, for how well a sensor tells.*\n.*`y`: needs a noise"),
        (dict(sensors={"x": probe(0.0, 0.0)}), "`x`: needs a noise"),
        (dict(sensors={}), "sensors: name one at least"),
        (dict(sensors={"x": 3.0}), "must be a sensor or a Channel"),
        (dict(sensors={"d": probe(0.0)}), "give the channel another name"),
        (dict(sensors=[probe(0.0)]), "sensors must be a mapping"),
        (dict(sensors={"x": jr.Channel(jr.sensors.Tachometer("e"), noise=jr.sensors.Noise(1.0))}), "`e`"),
        (dict(parameters=["d.unbalance.excentricity"]), "did you mean"),
        (dict(parameters=["y.delay"]), "`y.delay`"),
        (dict(parameters=[]), "no parameter is looked for"),
        (dict(runs={}), "runs: name one at least"),
        (dict(runs={"a": 3.0, "b": {"t_end": 1.0}}),
         "run `a`: must be a Simulation.*float\n.*run `b`: sample_rate must be given"),
        (dict(runs={"a": {"t_end": 1.0, "sample_rate": 100.0, "initial": "moving"}}), "run `a`: .*initial"),
        (dict(runs={"a": jr.identification.CandidateRun(RUN, {"d.phi.sped": 1.0})}), "run `a`: .*sped"),
        (dict(choose=0), "choose must be a whole number, 1 at least"),
        (dict(choose=5), "there are not 5 sensors to choose from, but 4"),
        (dict(choose=2, of="runs"), "there are not 2 runs to choose from, but 1"),
        (dict(of="probes"), "of must be 'sensors' or 'runs' or 'pairs'"),
        (dict(criterion="F"), "criterion must be 'D', 'A', 'E' or one of the unknowns"),
        (dict(criterion="bearing.stiffnes[0]"), "did you mean 'bearing.stiffness\\[0\\]'"),
        (dict(criterion=3), "criterion must be"),
        (dict(machine=3), "machine must be a Machine"),
    ],
)  # fmt: skip
def test_refused_before_anything_runs(monkeypatch, change, words):
    from jaxrotor.identification import fisher

    def never(*_):
        raise AssertionError("it runs")

    monkeypatch.setattr(fisher, "settled", never)
    given = dict(machine=rotor(), parameters=UNKNOWNS, sensors=SENSORS, runs={"a": RUN}) | change
    with pytest.raises(jr.InputError, match=words):
        jr.experiment_design(**given)
