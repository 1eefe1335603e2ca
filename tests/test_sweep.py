"""Sweeps in memory: every member is the run that `simulate` would have made of it."""

import warnings
from types import SimpleNamespace

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import jaxrotor as jr
from jaxrotor.sweeps import batch
from jaxrotor.sweeps.batch import placed, shares_linear
from jaxrotor.sweeps.function import batched
from jaxrotor.sweeps.sweep import asked, set_up

RUN = dict(t_end=0.06, sample_rate=1000.0, initial="undeformed")
TRACES = []


class Stiffening(jr.AbstractAttachment):
    """A spring k x (1 + |x|²/s²) that notes each time its law is traced."""

    k: jax.Array = jr.parameter("N/m")
    s: jax.Array = jr.parameter("m", positive=True)

    def forces(self, t, motions, state):
        TRACES.append(1)
        ((q, _),) = motions
        x = q[:2]
        pull = -self.k * x * (1 + jnp.sum(x**2) / self.s**2)
        return (jnp.concatenate([pull, jnp.zeros(4)]),)


class LargestAngle(jr.objectives.AbstractMeasure):
    """A user's own: it wants the whole response."""

    unit: str = eqx.field(static=True, default="rad")

    def __call__(self, response):
        return jnp.max(jnp.abs(response["disc"].psi))


def disc_on_a_shaft(**extra):
    return jr.Machine.in_line(
        {
            "disc": jr.Rotor(2.0, 0.018, 0.010, unbalance=jr.Unbalance(1e-4, inclination=1e-3)),
            "shaft": jr.Shaft(length=0.3, diameter=0.012, rayleigh=(1.0, 2e-4)),
            "motor": jr.PrescribedSpin(jr.CosineRamp(speed=150.0, duration=0.05)),
        },
        attachments={
            "load": (jr.Force(jr.Step(0.0205, 30.0)), "disc"),
            "spring": (Stiffening(1e3, 1e-3), "disc"),
            **extra,
        },
        gravity=(0.0, -9.81, 0.0),
    )


SHARED = {
    "disc.unbalance.eccentricity": np.linspace(2e-5, 2e-4, 7),
    "load.value.after": np.array([30.0, 10, 50, 0, 20, 5, 30]),
    "motor.profile.speed": np.array([150.0, 100, 130, 50, 149, 20, 150]),
}
OWN = {
    "shaft.diameter": 0.012 * np.array([0.8, 1.2, 1.0, 0.9, 1.1]),
    "shaft.rayleigh[1]": 2e-4 * np.array([2.0, 0.5, 1.0, 2.0, 0.5]),
    "spring.k": np.array([1e3, 2e3, 0.0, 4e3, 1e3]),
}
OUTPUTS = {
    "peak": jr.objectives.PeakValue(jr.sensors.Radial("disc"), start=0.01),
    "rms": jr.objectives.RootMeanSquare(jr.sensors.ProximityProbe("disc", 0.0)),
    "x": jr.sweeps.TimeSeries(jr.sensors.ProximityProbe("disc", 0.0), every=7),
    "over": jr.sweeps.OverSpeed(jr.sensors.Radial("disc"), "disc", [0.0, 10, 60, 120, 160]),
    "mass": jr.objectives.TotalMass(),
}


@pytest.fixture(scope="module")
def machine():
    return disc_on_a_shaft()


@pytest.fixture(scope="module")
def plan(machine):
    return jr.plan(machine, 0.06, 1000.0)


def single(machine, values, row, outputs, **run):
    """By `simulate`, one after the other."""
    own = placed(machine, {path: jnp.asarray(x[row]) for path, x in values.items()})
    response = jr.simulate(own, **{**RUN, **run})
    return {
        name: np.asarray(
            one(own if isinstance(one, jr.objectives.AbstractMachineMeasure) else response)
        )
        for name, one in outputs.items()
    }


@pytest.fixture(scope="module")
def singles(machine, plan):
    """Of `SHARED`; the step is the same for all, and one of them says that it is long for it (rightly: its
    error is 9e-5 of the peak)."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "the run's own estimate of its error")
        return [single(machine, SHARED, row, OUTPUTS, step=plan) for row in range(7)]


def assert_alike(found, expected, row, rtol=1e-9):
    for name, value in expected.items():
        scale = np.nanmax(np.abs(value))
        got = np.asarray(found[name])[row]
        np.testing.assert_allclose(got, value, rtol=rtol, atol=rtol * scale, err_msg=name)


# Members


@pytest.mark.parametrize("chunk, order", [(1, 1), (3, 1), (16, 1), (100, -1)])
def test_members_are_single_runs(machine, plan, singles, chunk, order):
    cases = {path: x[::order] for path, x in SHARED.items()}
    found = jr.sweep(machine, cases, OUTPUTS, chunk=chunk, step=plan, **RUN)
    assert found.attrs["linear_part"] == "shared"
    assert found["x"].dims == ("case", "x_time") and found["x"].sizes["x_time"] == 9
    np.testing.assert_allclose(found["x_time"], 1e-3 * np.arange(0, 61, 7))
    np.testing.assert_allclose(found["over_speed"], [5, 35, 90, 140])
    assert list(found["case"]) == list(range(7)) and not np.any(found["failure"] != "")
    assert found["peak"].attrs["units"] == "m" and found["rms"].attrs["units"] == "m"
    for row, expected in enumerate(singles[::order]):
        assert_alike(found, expected, row)


def test_stiff_parameters(machine, plan):
    found = jr.sweep(machine, OWN, OUTPUTS, chunk=3, step=plan, **RUN)
    assert found.attrs["linear_part"] == "one for each case"
    for row in range(5):
        assert_alike(found, single(machine, OWN, row, OUTPUTS, step=plan), row)


def test_which_parameters_share_the_linear_part(machine):
    """It is A of the machine at half its top speed: what multiplies coordinates or rates is in it."""
    shares = {
        path: shares_linear(machine, 75.0, {path: np.array([0.9, 1.0, 1.1]) * base})
        for path, base in {
            "disc.unbalance.eccentricity": 1e-4,
            "load.value.after": 30.0,
            "motor.profile.speed": 150.0,
            "shaft.diameter": 0.012,
            "shaft.rayleigh[1]": 2e-4,
            "spring.k": 1e3,
            "disc.mass": 2.0,
        }.items()
    }
    assert list(shares.values()) == [True] * 3 + [False] * 4


def test_a_grid_comes_back_over_its_axes(machine, plan):
    axes = {
        "motor.profile.speed": SHARED["motor.profile.speed"][[0, 1]],
        "disc.unbalance.eccentricity": SHARED["disc.unbalance.eccentricity"][:3],
    }
    cases = jr.Cases.grid(axes)
    assert cases.how == "a grid, 2 x 3" and len(cases) == 6
    tied = cases.tied({"disc.unbalance.inclination": "disc.unbalance.eccentricity"})
    outputs = {"x": OUTPUTS["x"], "peak": OUTPUTS["peak"]}
    run = RUN | dict(initial="static")
    found = jr.sweep(machine, tied, outputs, step=plan, **run)
    assert found["peak"].dims == tuple(axes) and found["x"].dims == (*axes, "x_time")
    one = found.sel({"motor.profile.speed": 100.0}).isel({"disc.unbalance.eccentricity": 2})
    assert_alike(
        one.expand_dims("one"), single(machine, tied.values, 5, outputs, step=plan, **run), 0
    )
    np.testing.assert_array_equal(
        found["disc.unbalance.inclination"][1], axes["disc.unbalance.eccentricity"]
    )
    assert found["motor.profile.speed"].attrs["units"] == "rad/s"


def test_no_compilation_from_chunk_to_chunk_nor_from_values_to_values(machine, plan):
    run = dict(outputs={"peak": OUTPUTS["peak"]}, chunk=2, step=plan, **RUN)
    jr.sweep(machine, {"load.value.after": np.arange(4.0)}, **run)
    before = len(TRACES)
    found = jr.sweep(machine, {"load.value.after": np.linspace(5.0, 50.0, 4)}, **run)
    layout = len(TRACES) - before  # the shapes of the results are asked once a sweep
    before = len(TRACES)
    longer = jr.sweep(machine, {"load.value.after": np.linspace(5.0, 50.0, 19)}, **run)
    assert len(TRACES) - before == layout <= 12
    np.testing.assert_array_equal(found["peak"], longer["peak"][::6])


# Steps


def test_those_that_need_finer_steps_run_together(machine):
    """The stiffer the cubic spring, the shorter the steps that the pilot asks for."""
    cases = {"spring.s": np.array([1e-3, 4e-6, 3e-4, 4.1e-6, 1e-3])}
    outputs = {"rms": OUTPUTS["rms"], "x": OUTPUTS["x"]}
    found = jr.sweep(machine, cases, outputs, chunk=2, **RUN)
    steps = found["steps_a_sample"].values
    assert steps[0] == steps[2] == steps[4] < steps[1] == steps[3]
    for row in (0, 1, 3):
        own = single(machine, cases, row, outputs, step=5e-5)
        scale = np.max(np.abs(own["x"]))
        assert np.max(np.abs(found["x"].values[row] - own["x"])) < 2e-3 * scale


def free_rotor():
    return jr.Machine(
        {
            "rotor": jr.Rotor(2.0, 0.018, 0.010, unbalance=jr.Unbalance(1e-4, inclination=0.01)),
            "springs": jr.LinearSupport(
                [4e4, 4e4, 4e4, 90.0, 90.0, 0], [40.0, 40, 40, 0.1, 0.1, 0]
            ),
            "torque": jr.Torque(18.0),
        },
        {"springs": "rotor", "torque": "rotor"},
    )


def test_a_line_without_a_drive_is_planned_for_the_speed_that_it_reaches():
    """18 N*m on 0.018 kg*m² for 0.25 s: 250 rad/s, which nobody said beforehand."""
    machine = free_rotor()
    run = dict(t_end=0.25, sample_rate=200.0, initial="undeformed")
    cases = {"torque.value.level": np.array([2.0, 18.0, 9.0])}
    outputs = {
        "speed": jr.objectives.PeakValue(jr.sensors.Tachometer("rotor")),
        "x": jr.sweeps.TimeSeries(jr.sensors.ProximityProbe("rotor", 0.0)),
    }
    found = jr.sweep(machine, cases, outputs, **run)
    assert not np.any(found["failure"] != "")
    np.testing.assert_allclose(
        found["speed"], cases["torque.value.level"] / 0.018 * 0.25, rtol=0.02
    )
    for row in (0, 1):
        fine = single(machine, cases, row, outputs, step=1e-4, **run)
        np.testing.assert_allclose(
            found["x"][row], fine["x"], atol=2e-4 * np.max(np.abs(fine["x"]))
        )


def test_a_state_brings_the_speed_that_is_planned_for():
    machine = free_rotor().set({"torque.value.level": 0.0})
    v = np.zeros((1, 6))
    v[0, 5] = 400.0
    state = jr.State(np.zeros((1, 6)), v)
    cases = jr.Cases({"rotor.unbalance.eccentricity": [1e-4, 2e-4]})
    outputs = {"peak": jr.objectives.PeakValue(jr.sensors.Radial("rotor"))}
    setup, steps = set_up(machine, cases, outputs, jr.Simulation(0.05, 200.0, state))
    assert np.all(steps >= 400.0 / 200.0 / 0.26)
    assert float(setup.run.linearised_at) == pytest.approx(200.0)


def test_the_rows_speed_counts_not_the_machines_own():
    """A drive that stands still, whose speed is what is swept: each row can whirl steadily."""
    still = disc_on_a_shaft().set({"load.value.after": 0.0})
    parts = still.elements() | {"motor": jr.PrescribedSpin(jr.ConstantSpeed(0.0))}
    line = {name: parts[name] for name in ("disc", "shaft", "motor")}
    cases = {"motor.profile.speed": [80.0, 120.0]}
    outputs = {"peak": jr.objectives.PeakValue(jr.sensors.Radial("disc"))}
    how = jr.Simulation(0.05, 1000.0, "steady")
    setup, _ = asked(jr.Machine.in_line(line), cases, outputs, how)
    assert setup.run.count == 51
    with pytest.raises(jr.InputError, match='"steady" needs a speed other than 0 rad/s'):
        asked(jr.Machine.in_line(line), {"motor.profile.speed": [0.0, 120.0]}, outputs, how)


# Kinds of machines


def test_a_sampled_controller(plan):
    loop = jr.elements.SampledTorque(jr.elements.PD(20.0, 0.3), 0.002, delay=0.001)
    machine = disc_on_a_shaft(loop=(loop, ("disc", "motor")))
    cases = {"loop.controller.stiffness": np.array([0.0, 20.0, 40.0])}
    outputs = {"twist": jr.sweeps.TimeSeries(jr.sensors.Tachometer("disc")), "own": LargestAngle()}
    found = jr.sweep(machine, cases, outputs, step=plan, **RUN)
    assert np.ptp(found["twist"].values, axis=0).max() > 1e-3
    for row in range(3):
        assert_alike(found, single(machine, cases, row, outputs, step=plan), row)
    turning = machine.set({"motor": jr.PrescribedSpin(jr.ConstantSpeed(9.0))})
    with pytest.raises(jr.InputError, match='"steady" needs a motion that repeats'):
        jr.sweep(turning, cases, outputs, **RUN | dict(initial="steady"))


def setup_with(solver, machine):
    return SimpleNamespace(run=SimpleNamespace(solver=solver), machine=machine)


def test_a_part_that_is_not_smooth():
    machine = jr.Machine.in_line(
        {
            "motor": jr.PrescribedSpin(jr.CosineRamp(20.0, 0.05)),
            "joint": jr.Coupling(phi=jr.elements.Backlash(0.02, 800.0, 0.5)),
            "disc": jr.Rotor(1.0, 0.02, 0.02),
        },
        attachments={"brake": (jr.Torque(-3.0), "disc")},
    )
    cases = {"joint.phi.gap": np.array([0.01, 0.02, 0.1])}
    outputs = {"speed": jr.sweeps.TimeSeries(jr.sensors.Tachometer("disc"))}
    found = jr.sweep(machine, cases, outputs, **RUN)
    assert found.attrs["solver"] == "Rosenbrock" and not np.any(found["failure"] != "")
    # an implicit solver calls LAPACK at each step: shared among devices of a processor, it would hang
    assert batch.solves_as_it_runs(setup_with(jr.Rosenbrock(), machine))
    assert not batch.solves_as_it_runs(setup_with(jr.ETD4RK(), machine))
    run = dict(solver=diffrax.Tsit5(), step=1e-4)
    fixed = jr.sweep(machine, cases, outputs, **RUN, **run)
    np.testing.assert_allclose(found["speed"], fixed["speed"], atol=2e-3)
    assert np.ptp(fixed["speed"].values, axis=0).max() > 1.0
    assert_alike(fixed, single(machine, cases, 1, outputs, **run), 1)
    run["step"] = jr.Plan(1, 6, 0.0, 0.0, 0.0, 0.0)
    with pytest.raises(jr.InputError, match="a Plan is for the exponential solvers"):
        jr.sweep(machine, cases, outputs, **RUN, **run)


def test_measures_of_machines_need_no_run(machine, monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("this sweep has nothing to run")

    monkeypatch.setattr(batch, "march_through", refuse)
    masses = np.array([1.0, 2.0, 3.5])
    found = jr.sweep(machine, {"disc.mass": masses}, {"mass": jr.objectives.TotalMass()})
    # a shaft without mass of its own; the motor has none
    np.testing.assert_allclose(np.diff(found["mass"]), np.diff(masses), rtol=1e-12)


# Members that fail


def test_a_member_that_fails_fails_alone(machine, plan):
    """A force greater than numbers can bear, a third through the run."""
    forces = SHARED["load.value.after"].copy()
    forces[1] = 1e200
    bad = SHARED | {"load.value.after": forces}
    run = dict(outputs=OUTPUTS, chunk=16, step=plan, **RUN)
    expected, found = (jr.sweep(machine, cases, **run) for cases in (SHARED, bad))
    others = [0, 2, 3, 4, 5, 6]
    for name in OUTPUTS:
        np.testing.assert_array_equal(found[name][others], expected[name][others])
    assert list(np.flatnonzero(found["failure"] != "")) == [1]
    for name in ("peak", "rms", "mass", "over"):
        assert np.all(np.isnan(found[name][1])), name
    when = float(found["failed_at"][1])
    assert 0.0205 < when <= 0.024
    assert str(found["failure"].values[1]) == f"not finite from t = {when:g} s on"
    # the series keeps what came before
    np.testing.assert_array_equal(found["x"][1, :3], expected["x"][1, :3])
    assert list(np.isfinite(found["x"][1].values)) == [t < when for t in found["x_time"]]


def test_a_speed_beyond_numbers_has_no_step_and_harms_no_other(machine):
    speeds = SHARED["motor.profile.speed"].copy()
    speeds[1] = 1e200
    bad = SHARED | {"motor.profile.speed": speeds}
    run = dict(outputs=OUTPUTS, chunk=7, **RUN)
    expected, found = (jr.sweep(machine, cases, **run) for cases in (SHARED, bad))
    assert "no step was found" in str(found["failure"].values[1])
    assert np.isnan(found["peak"][1]) and np.all(np.isnan(found["x"][1]))
    others = [0, 2, 3, 4, 5, 6]
    steps, same = (x["steps_a_sample"].values for x in (found, expected))
    assert steps[1] == -1 and list(steps[others]) == list(same[others])
    # another place in the chunk, another rounding
    for row in others:
        assert_alike(found, {"x": expected["x"].values[row]}, row, rtol=1e-11)


def test_whirl_is_periodic_or_there_is_none():
    """50 turns a second are 20 samples each; a spring beyond numbers holds no whirl."""
    machine = jr.Machine.in_line(
        {
            "disc": jr.Rotor(2.0, 0.018, 0.010, unbalance=jr.Unbalance(1e-4)),
            "shaft": jr.Shaft(length=0.3, diameter=0.012, rayleigh=(1.0, 2e-4)),
            "motor": jr.PrescribedSpin(jr.ConstantSpeed(2 * np.pi * 50)),
        },
        attachments={"spring": (Stiffening(1e3, 1e-3), "disc")},
    )
    cases = {"spring.k": np.array([1e3, 1e300, 2e3])}
    plan = jr.Plan(4, 6, 50 * np.pi, 100 * np.pi, 0.0, 0.0)
    outputs = {"x": jr.sweeps.TimeSeries(jr.sensors.ProximityProbe("disc", 0.0))}
    found = jr.sweep(machine, cases, outputs, step=plan, **RUN | dict(initial="steady"))
    assert "no periodic whirl was found" in str(found["failure"].values[1])
    assert found["failed_at"].values[1] == 0.0
    for x in found["x"].values[[0, 2]]:
        assert np.ptp(x) > 1e-5
        np.testing.assert_allclose(x[20:], x[:-20], atol=1e-6 * np.ptp(x))


# Tables


DRAWN = {
    "a": stats.norm(5.0, 0.2),
    "b": stats.uniform(1.0, 3.0),
    "c": stats.lognorm(0.3),
    "d": stats.weibull_min(2.0),
}


@pytest.mark.parametrize("method", ["sobol", "latin", "random"])
def test_samples_have_their_distributions_and_correlations(method):
    wanted = {("a", "b"): 0.7, ("c", "a"): -0.4}
    cases = jr.Cases.sampled(DRAWN, 4096, method, seed=3, correlations=wanted)
    assert len(cases) == 4096 and "seed 3" in cases.how
    for name, law in DRAWN.items():
        assert stats.kstest(cases.values[name], law.cdf).pvalue > 1e-3, name
    scores = np.stack([stats.norm.ppf(law.cdf(cases.values[n])) for n, law in DRAWN.items()])
    R = np.corrcoef(scores)
    expected = np.eye(4)
    expected[0, 1] = expected[1, 0] = 0.7
    expected[0, 2] = expected[2, 0] = -0.4
    np.testing.assert_allclose(R, expected, atol=4 / np.sqrt(4096))
    again = jr.Cases.sampled(DRAWN, 4096, method, seed=3, correlations=wanted)
    other = jr.Cases.sampled(DRAWN, 4096, method, seed=4, correlations=wanted)
    for name in DRAWN:
        np.testing.assert_array_equal(cases.values[name], again.values[name])
        assert np.all(cases.values[name] != other.values[name])


def test_sobol_points_and_hypercubes_are_even():
    """Each of n equal slices holds one value of a Latin hypercube, and of 2^k Sobol points."""
    for method in ("sobol", "latin"):
        u = stats.norm(5.0, 0.2).cdf(jr.Cases.sampled(DRAWN, 64, method).values["a"])
        assert sorted((64 * u).astype(int)) == list(range(64))
    for count in (1, 3, 100):
        assert len(jr.Cases.sampled(DRAWN, count)) == count


@pytest.mark.parametrize(
    "arguments, sentence",
    [
        (dict(count=0), "count must be a whole number, 1 at least, but is 0"),
        (dict(count=2.5), "count must be a whole number, 1 at least, but is 2.5"),
        (dict(seed=-1), "seed must be a whole number, 0 at least, but is -1"),
        (dict(method="halton"), "method must be 'sobol' or 'latin' or 'random'"),
        (dict(distributions={"a": 3.0}), "`a`: must be a frozen distribution such as"),
        (dict(distributions={"a": stats.norm}), "`a`: must be a frozen distribution such as"),
        (dict(distributions={}), "distributions: must be a mapping"),
        (dict(distributions={"a": stats.cauchy(0, 1e308)}), "`a` must be finite, but value"),
        (dict(correlations={("a", "e"): 0.5}), "correlations: `e` is not swept"),
        (dict(correlations={("a", "b"): 1.5}), "must lie between -1 and 1, but is 1.5"),
        (dict(correlations={("a", "a"): 0.5}), "pairs of two paths"),
        (dict(correlations={("a", "b"): 0.5, ("b", "a"): 0.1}), "is given twice, as 0.5 and 0.1"),
        (
            dict(correlations={("a", "b"): 0.9, ("b", "c"): 0.9, ("a", "c"): -0.9}),
            "together they contradict one another",
        ),
    ],
)
def test_bad_samples_are_told(arguments, sentence):
    with pytest.raises(jr.InputError, match=sentence.replace("(", r"\(")):
        jr.Cases.sampled(**{"distributions": DRAWN, "count": 8, **arguments})


def test_bad_ties_are_told():
    cases = jr.Cases({"a": [1.0, 2.0], "b": [3.0, 4.0]})
    assert list(cases.tied({"c": "a"}).values["c"]) == [1.0, 2.0]
    with pytest.raises(jr.InputError, match="`c`: follows `x`, which is not swept"):
        cases.tied({"c": "x"})
    with pytest.raises(jr.InputError, match="`b`: is swept itself and cannot follow `a`"):
        cases.tied({"b": "a"})


ONE = {"disc.mass": [1.0, 2.0]}
MASS = {"mass": jr.objectives.TotalMass()}


@pytest.mark.parametrize(
    "cases, arguments, sentence",
    [
        ({"dics.mass": [1.0]}, {}, "did you mean"),
        ({"disc.colour": [1.0]}, {}, "colour"),
        ({"disc": [1.0]}, {}, "is a part with several parameters"),
        ({"load.direction": [1.0]}, {}, "has 3 entries: name one"),
        ({"load.direction[9]": [1.0]}, {}, "there is no such entry"),
        ({}, {}, "no parameter is swept"),
        ({"disc.mass": []}, {}, "must be a list of numbers"),
        ({"disc.mass": 3.0}, {}, "must be a list of numbers"),
        ({"disc.mass": "heavy"}, {}, "must be a list of numbers, but is 'heavy'"),
        ({"disc.mass": [1.0, np.nan]}, {}, "must be finite, but value 2 is nan"),
        ({"disc.mass": [1.0, 2.0], "load.value.after": [1.0]}, {}, "give one for each case"),
        (
            {"disc.mass": [1.0, 3.0, -2.0]},
            {},
            "case 3: `disc`: mass must be positive, but is -2 kg",
        ),
        ([1.0], {}, "cases: must be a mapping"),
        (ONE, dict(outputs={}), "outputs: name one at least"),
        (ONE, dict(outputs=[jr.objectives.TotalMass()]), "outputs must be a mapping"),
        (ONE, dict(outputs={"m": "mass"}), "`m` must be a measure"),
        (
            ONE,
            dict(outputs={"failure": jr.objectives.TotalMass()}),
            "`failure` is taken by the sweep itself",
        ),
        (
            ONE,
            dict(outputs={"disc.mass": jr.objectives.TotalMass()}),
            "is taken by the sweep itself",
        ),
        (ONE, dict(outputs={"a/b": jr.objectives.TotalMass()}), "is no name of an output"),
        (ONE, dict(chunk=0), "chunk must be a whole number, 1 at least, but is 0"),
        (ONE, dict(chunk=2.0), "chunk must be a whole number, 1 at least, but is 2.0"),
        (ONE, dict(client=3), "client must be a distributed.Client of Dask, but is 3"),
        (ONE, dict(solver="Tsit5"), "solver must be a solver of diffrax"),
        (ONE, dict(step=-1.0), "step must be a Plan or positive and finite"),
        (ONE, dict(t_end=-1.0), "t_end must be positive and finite"),
        (ONE, dict(rtol="tight"), "rtol must be a number"),
        (
            ONE,
            dict(
                outputs={"p": jr.objectives.PeakValue(jr.sensors.Radial("disc"))}, initial="resting"
            ),
            'initial must be "static", "running", "steady"',
        ),
        (
            ONE,
            dict(
                outputs={"p": jr.objectives.PeakValue(jr.sensors.Radial("dics"))},
                initial="undeformed",
                step=1e-3,
            ),
            "dics",
        ),
    ],
)
def test_bad_input_is_told_before_anything_runs(machine, cases, arguments, sentence):
    with pytest.raises(jr.InputError) as caught:
        jr.sweep(machine, cases, **{"outputs": MASS, **RUN, **arguments})
    assert sentence in str(caught.value)


def test_parameters_that_bound_each_other_are_checked_together():
    """Bores of 20 mm are too wide for the shaft as it is, not for those of the table."""
    machine = jr.Machine.in_line(
        {
            "disc": jr.Rotor(2.0, 0.018, 0.010),
            "shaft": jr.FiniteElementShaft(0.3, 0.015, inner_diameter=0.0, elements=1),
            "motor": jr.PrescribedSpin(jr.ConstantSpeed(10.0)),
        }
    )
    outer = [p for p in machine.parameters() if p.startswith("shaft.") and "diameter" in p]
    inner, outer = sorted(outer, key=lambda p: "inner" not in p)[:2]
    wide = {outer: [0.03, 0.04], inner: [0.02, 0.03]}
    found = jr.sweep(machine, wide, {"mass": jr.objectives.TotalMass()})
    assert found["mass"].shape == (2,)
    with pytest.raises(jr.InputError, match="case 2: "):
        jr.sweep(
            machine, {outer: [0.03, 0.02], inner: [0.02, 0.03]}, {"mass": jr.objectives.TotalMass()}
        )


# Gradients


def test_the_gradient_of_a_percentile_over_the_batch(machine, plan, singles):
    """By the length of the shaft, which is in the linear part that all cases share, in reverse mode."""
    peaks = batched(machine, SHARED, {"peak": OUTPUTS["peak"]}, step=plan, **RUN)

    @jax.jit
    @jax.value_and_grad
    def worst(length):
        return jnp.percentile(peaks(machine.set({"shaft.length": length}))["peak"], 95.0)

    value, slope = worst(0.3)
    expected = np.percentile([one["peak"] for one in singles], 95.0)
    np.testing.assert_allclose(value, expected, rtol=1e-9)
    h = 1e-4
    sides = [float(worst(0.3 + k * h)[0]) for k in (-2, -1, 1, 2)]
    central = (sides[0] - 8 * sides[1] + 8 * sides[2] - sides[3]) / (12 * h)
    assert slope == pytest.approx(central, rel=1e-6)
