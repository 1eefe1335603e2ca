"""`jaxrotor optimize`: from a study to the best design, figures and a study that runs."""

import json
import re
from pathlib import Path

import diffrax
import jax
import matplotlib.image
import numpy as np
import pytest
from scipy.optimize import minimize

import jaxrotor as jr
from jaxrotor.commands.cli import main

DAMPER = Path("configs/tuned_damper.toml").read_text()
J, K, RING = 1.8, 45e3, 0.18
W = 2 * np.pi * np.linspace(5, 60, 20001)


def magnified(stiffness, damping, own=6.0):
    """The highest torque in the coupling and twist of the ring, per torque on the compressor: by hand."""
    s = 1j * W
    rubber = stiffness + damping * s
    ring = -RING * s**2 / (RING * s**2 + rubber)  # per twist of the compressor
    twist = 1 / (J * s**2 + own * s + K - rubber * ring)
    return highest(np.abs((K + own * s) * twist)), highest(np.abs(ring * twist))


def highest(values):
    """The top of the parabola through the highest value and its neighbours."""
    k = int(np.argmax(values))
    before, here, after = values[k - 1 : k + 2]
    return here + (after - before) ** 2 / (8 * (2 * here - before - after))


WRITTEN = {"history.png", "history.csv", "summary.json", "study_optimized.toml"}


def optimised(folder, text, *more):
    """Exit status, and what stands in the folder."""
    (folder / "study.toml").write_text(text)
    status = main(["optimize", str(folder / "study.toml"), "--out", str(folder / "best"), *more])
    names = {p.name for p in (folder / "best").iterdir()}
    return status, json.loads((folder / "best/summary.json").read_text()), names


def drawn(path):
    """A picture is there, and shows both designs in their colours."""
    pixels = matplotlib.image.imread(path)[..., :3].reshape(-1, 3)
    for colour in ("#D55E00", "#0072B2"):
        own = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
        assert np.sum(np.abs(pixels - own).max(axis=1) < 0.2) > 100, colour


def test_tuned_damper_under_its_bound(tmp_path, capsys):
    """Both peaks by SciPy's search on the formulas above."""
    status, told, names = optimised(tmp_path, DAMPER)
    said = capsys.readouterr().out
    assert status == 0 and "holds the design" in said and "came to rest" in said
    assert names == WRITTEN | {"response.png"}
    found = [told["parameters"][f"damper.{x}"]["after"] for x in ("stiffness", "damping")]
    bound = 2.2e-4

    def ends(x):
        return magnified(*np.exp(x))

    want = minimize(
        lambda x: ends(x)[0],
        np.log([3500.0, 12.0]),
        method="SLSQP",
        constraints=[{"type": "ineq", "fun": lambda x: 1e4 * (bound - ends(x)[1])}],
        options=dict(ftol=1e-13, maxiter=300),
    )
    np.testing.assert_allclose(found, np.exp(want.x), rtol=1e-3)
    assert told["objective"]["after"] == pytest.approx(want.fun, rel=1e-5)
    assert told["objective"]["before"] == pytest.approx(magnified(5e3, 3.0)[0], rel=1e-6)
    (held,) = told["constraints"]
    assert held["active"] and held["value"] == pytest.approx(bound, rel=1e-6)
    # its price, by what SciPy finds where the bound is a little wider
    wider = minimize(
        lambda x: ends(x)[0],
        want.x,
        method="SLSQP",
        constraints=[{"type": "ineq", "fun": lambda x: 1e4 * (1.005 * bound - ends(x)[1])}],
        options=dict(ftol=1e-13, maxiter=300),
    )
    assert held["price"] == pytest.approx((wider.fun - want.fun) / (0.005 * bound), rel=0.02)
    again = jr.load(tmp_path / "best/study_optimized.toml")
    assert again.machine.get("damper.stiffness") == pytest.approx(found[0], rel=1e-14)
    assert again.machine.get("damper.damping") == pytest.approx(found[1], rel=1e-14)
    assert again.machine.get("damper.inertia") == RING
    assert again.optimize.constraints[0].limit == pytest.approx(bound)
    drawn(tmp_path / "best/history.png")
    drawn(tmp_path / "best/response.png")


def test_ctrl_c_keeps_the_best_so_far(tmp_path, monkeypatch, capsys):
    """Written as a whole, marked unfinished: a study that has by the formulas above what the summary says."""
    from jaxrotor.optimization import search

    tell, looks = search.tell, []

    def stopped(*given):
        if len(looks) == 4:
            raise KeyboardInterrupt
        looks.append(1)
        return tell(*given)

    monkeypatch.setattr(search, "tell", stopped)
    status, told, names = optimised(tmp_path, DAMPER)
    said = capsys.readouterr()
    assert status == 130 and "! the search was interrupted" in said.out
    assert "Interrupted: the best design so far, unfinished, is in" in said.err
    assert told["interrupted"] and not told["converged"] and told["evaluations"] == 4
    assert names == WRITTEN | {"response.png"}
    again = jr.load(tmp_path / "best/study_optimized.toml").machine
    torque, twist = magnified(*(float(again.get(f"damper.{x}")) for x in ("stiffness", "damping")))
    assert told["objective"]["after"] == pytest.approx(torque, rel=1e-6)
    assert told["constraints"][0]["value"] == pytest.approx(twist, rel=1e-6)


def test_settings_of_the_simulation_reach_its_runs(tmp_path, monkeypatch):
    class Asked(Exception):
        pass

    def asked(machine, simulation, **more):
        raise Asked(simulation)

    own = 'sample_rate = "500 Hz"\nsolver = "Kvaerno5"\nrtol = 1e-5\natol = 1e-8'
    (tmp_path / "step.toml").write_text(STEP.replace('sample_rate = "500 Hz"', own))
    monkeypatch.setattr("jaxrotor.optimization.experiment.simulate", asked)
    with pytest.raises(Asked) as told:
        main(["optimize", str(tmp_path / "step.toml"), "--out", str(tmp_path / "best")])
    (run,) = told.value.args
    assert (run.t_end, run.sample_rate, run.rtol, run.atol) == (2.0, 500.0, 1e-5, 1e-8)
    assert isinstance(run.solver, diffrax.Kvaerno5)


def test_tuned_damper_as_published(tmp_path, capsys):
    """Nothing else damped and no bound: the exact H-infinity optimum of Nishihara & Asami (2002), from two
    starts."""
    text = DAMPER.split("[[optimize.constraints]]")[0]
    text = text.replace('"6 N*m*s/rad"', '"0 N*m*s/rad"')
    text = text.replace(
        "[[optimize.unknowns]]",
        '[optimize]\nstarts = [{ "damper.stiffness" = "3 kN*m/rad", "damper.damping" = "12 N*m*s/rad" }]\n'
        "[[optimize.unknowns]]",
        1,
    )
    status, told, _ = optimised(tmp_path, text, "--quiet")
    said = capsys.readouterr().out
    assert status == 0 and "ResponsePeaks" not in said
    mu, r = 0.1, np.sqrt(4 + 0.3)
    f = 2 / (1 + mu) * np.sqrt(
        2 * (16 + 23 * mu + 9 * mu**2 + 2 * (2 + mu) * r) / (64 + 80 * mu + 27 * mu**2) / 3
    )  # fmt: skip
    zeta = np.sqrt((8 + 9 * mu - 4 * r) / (1 + mu)) / 4
    height = np.sqrt(((8 + 9 * mu) ** 2 * (16 + 9 * mu) - 128 * r**3) / (3 * (32 + 27 * mu)))
    tuned = f * np.sqrt(K / J)
    assert told["objective"]["after"] == pytest.approx(height / (3 * mu), rel=1e-7)
    after = {path: one["after"] for path, one in told["parameters"].items()}
    assert after["damper.stiffness"] == pytest.approx(RING * tuned**2, rel=1e-5)
    assert after["damper.damping"] == pytest.approx(2 * RING * tuned * zeta, rel=1e-5)


STEP = """
title = "A disc on a spring, let go"
[machine.fixed]
disc = ["x", "y", "z", "psi", "theta"]
[[machine.line]]
name = "end"
kind = "PrescribedSpin"
profile = { kind = "ConstantSpeed", speed = "0 rpm" }
[[machine.line]]
name = "spring"
kind = "Coupling"
stiffness = ["0 N/m", "0 N/m", "0 N/m", "0 N*m/rad", "0 N*m/rad", "40 N*m/rad"]
damping = ["0 N*s/m", "0 N*s/m", "0 N*s/m", "0 N*m*s/rad", "0 N*m*s/rad", "0.5 N*m*s/rad"]
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "5 kg"
polar_inertia = "0.1 kg*m^2"
transverse_inertia = "0.06 kg*m^2"
[[machine.attachments]]
name = "load"
kind = "Torque"
at = "disc"
value = { kind = "Step", before = "4 N*m", after = "0 N*m", time = "0.1 s" }
[simulation]
t_end = "2 s"
sample_rate = "500 Hz"
[optimize]
iterations = 40
[[optimize.unknowns]]
path = "spring.damping[5]"
positive = true
[[optimize.objective]]
measure = { kind = "Integral", power = 2, sensor = { kind = "Twist", first = "end", second = "disc" } }
over = "mean"
[[optimize.constraints]]
at_most = "5 N*m"
[optimize.constraints.measure]
kind = "PeakValue"
start = "0.2 s"
sensor = { kind = "Signal", element = "spring", name = "torque" }
[optimize.variations]
spread = 0.5
count = 6
paths = ["disc.polar_inertia"]
"""


def test_a_run_of_several_machines(tmp_path, capsys):
    """Let go from T/k, the twist has the integral of squares (T/k)² (t0 + c/(2 k) + J/(2 c)): the least mean
    over machines is at c² = k mean(J)."""
    status, told, names = optimised(tmp_path, STEP)
    assert status == 0
    assert names == WRITTEN | {"before_after.png"}
    study = jr.load(tmp_path / "study.toml")
    (term,) = study.optimize.objective.terms
    inertias = 0.1 * np.asarray(term[1].variations.factors["disc.polar_inertia"])
    assert inertias.size == 6 and inertias[0] == 0.1 and np.ptp(inertias) > 0.05
    c = np.sqrt(40 * inertias.mean())
    least = (4 / 40) ** 2 * (0.1 + c / 40 / 2 + inertias.mean() / c / 2)
    after = told["parameters"]["spring.damping[5]"]["after"]
    assert after == pytest.approx(c, rel=2e-3)  # trapezoids of 2 ms
    assert told["objective"]["after"] == pytest.approx(least, rel=1e-4)
    assert told["objective"]["unit"] == "(rad)**2*s"
    (held,) = told["constraints"]
    assert not held["active"] and held["limit"] == 5.0
    assert "spring, torque" in held["name"]
    again = jr.load(tmp_path / "best/study_optimized.toml").machine
    assert again.get("spring.damping")[5] == pytest.approx(after, rel=1e-14)
    drawn(tmp_path / "best/before_after.png")
    drawn(tmp_path / "best/history.png")


@pytest.mark.parametrize(
    "change, words",
    [
        (("iterations", "iteration"), "there is no `iteration`: did you mean `iterations`"),
        (("iterations = 40", "iterations = 0"), "iterations must be a whole number, 1 at least"),
        (("iterations = 40", "tolerance = 2"), "tolerance must lie between 0 and 1, but is 2"),
        (('kind = "Integral"', 'kind = "Integrall"'), "entry 1`: measure.kind .*mean `Integral`"),
        (('kind = "Integral"', 'kind = "Rotor"'), 'kind "Rotor" is unknown'),
        (
            ('kind = "Integral"', 'kind = "json:JSONDecoder"'),
            "class derived from jaxrotor's AbstractMeasure or AbstractMachineMeasure",
        ),
        (('kind = "Twist"', 'kind = "Twists"'), "sensor.kind .*did you mean `Twist`"),
        (("power = 2", "power = 3"), "entry 1`: .*power must be 1 or 2, but is 3"),
        (('second = "disc"', 'second = "disk"'), "objective, entry 1`: .*did you mean `disc`"),
        (('"torque"', '"torqe"'), "constraints, entry 1`: .*did you mean `torque`"),
        (('"0.2 s"', '"3 s"'), "its window from 3 s holds nothing of the run"),
        (('"0.2 s"', '"3 m"'), "measure.start must be in s"),
        (('"torque" }', '"torque", unit = "N" }'), "torque is in N.m, but unit says N"),
        (('"5 N*m"', '"5 N"'), "entry 1: at_most` must be in N.m, but .5 N. is in N"),
        (('"5 N*m"', "5"), "at_most` must carry a unit"),
        (("at_most", "at_mots"), "there is no `at_mots`: did you mean `at_most`"),
        (("at_most", 'at_least = "0 N*m"\nat_most'), "at_most and at_least are given"),
        (('at_most = "5 N*m"', ""), "needs one of at_most, at_least and equal_to, but none is"),
        (('over = "mean"', 'over = "average"'), 'over must be "worst" or "mean"'),
        (('over = "mean"', 'weight = "1 kg"'), "weight` must be a number without a unit"),
        (("[[optimize.unknowns]]", "[[optimize.unknown]]"), "there is no `unknown`: did you mean"),
        (("[[optimize.objective]]", "[[optimize.objectives]]"), "there is no `objectives`: did"),
        (("[[optimize.objective]]", "[optimize.objective]"), r"write \[\[optimize.objective"),
        (('measure = { kind = "Integral"', 'mesure = { kind = "Integral"'), "no `mesure`"),
        (('path = "spring.damping[5]"', 'path = "sprung.damping[5]"'), "did you mean `spring`"),
        (('path = "spring.damping[5]"', 'path = "spring.damping"'), "has 6 entries: name one"),
        (("positive = true", 'start = "-1 N*m*s/rad"\npositive = true'), "starts at -1"),
        (("positive = true", 'bounds = ["1 m", "2 m"]'), "entry 1: bounds` must be in N.m.s/rad"),
        (("positive = true", 'prior = ["1 m", "2 m"]'), "there is no `prior`"),
        (("spread = 0.5", "spread = -0.5"), "spread must be above 0 and below 1, but is -0.5"),
        (("count = 6", "count = 1"), "count must be a whole number, 2 at least, but is 1"),
        (("count = 6", "seed = 1.5"), "seed must be a whole number"),
        (('["disc.polar_inertia"]', '["disc.polar"]'), "variations`: .*polar"),
        (('["disc.polar_inertia"]', '"disc.mass"'), "paths must be a list"),
        (("iterations = 40", 'optimiser = { kind = "adamm", learning_rate = 0.1 }'), "mean `adam`"),
        (("iterations = 40", 'optimiser = { kind = "adam" }'), "learning_rate is missing"),
        (("iterations = 40", 'optimiser = { kind = "lbfgs", learning_rate = 1 }'), "slopes alone"),
        (
            ("iterations = 40", 'optimiser = { kind = "adam", learning_rate = 0.1, b3 = 1 }'),
            "there is no `b3`",
        ),
        (("iterations = 40", 'optimiser = "adam"'), "must be a table such as"),
        (
            ("iterations = 40", 'starts = [{ "disc.mass" = "1 kg" }]'),
            "disc.mass` is not looked for",
        ),
        (
            ("iterations = 40", 'starts = [{ "spring.damping[5]" = "1 kg" }]'),
            "starts, entry 1: .*must be in N.m.s/rad",
        ),
        (
            ("iterations = 40", 'starts = [{ "spring.damping[5]" = "-1 N*m*s/rad" }]'),
            "starts, entry 1`: .*out of its bounds",
        ),
        (("[optimize.variations]", "[optimize.variation]"), "there is no `variation`"),
        (("iterations = 40", "iterations = 1000000000000"), "iterations must be a whole number"),
        (("[optimize.constraints.measure]", "[optimize.constraints.measures]"), "no `measures`"),
        (('kind = "PeakValue"', ""), "measure has no kind: write measure = .*PeakValue"),
    ],
)
def test_refused(tmp_path, monkeypatch, capsys, change, words):
    monkeypatch.chdir(tmp_path)
    text = STEP.replace(*change)
    assert text != STEP
    Path("step.toml").write_text(text)
    assert main(["optimize", "step.toml"]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said
    assert re.search(words, said), said
    assert not Path("results").exists()
    assert main(["check", "step.toml"]) == 2  # not only where it is asked for


MACHINE = '{ kind = "ResponsePeaks", input = "disc.phi", output = "disc.phi", start = "1 Hz", stop = "9 Hz" }'


@pytest.mark.parametrize(
    "change, words",
    [
        (("disc.phi", "disk.phi"), "disk.phi`: no such coordinate"),
        (('output = "disc.phi"', 'output = "spring.twist"'), "offers no such quantity"),
        (('"1 Hz"', '"1 kg"'), "measure.start must be in rad/s"),
        (('start = "1 Hz"', 'start = "10 Hz"'), "start and stop must rise"),
        (('start = "1 Hz", ', ""), 'measure.start is missing: write start = "1 rad/s"'),
        (('"ResponsePeaks"', '"ResponsePeak"'), "did you mean `ResponsePeaks`"),
        (('"2 mrad/(N*m)"', '"2 mm/N"'), "at_most` must be in rad/.N.m"),
    ],
)  # fmt: skip
def test_refused_of_the_machine(tmp_path, monkeypatch, capsys, change, words):
    monkeypatch.chdir(tmp_path)
    bound = f'[[optimize.constraints]]\nmeasure = {MACHINE}\nat_most = "2 mrad/(N*m)"\n'
    begin = STEP.split("[[optimize.constraints]]")[0].replace('over = "mean"\n', "")
    Path("step.toml").write_text(begin + bound.replace(*change))
    assert main(["optimize", "step.toml"]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said and re.search(words, said), said
    assert not Path("results").exists()


def test_all_faults_at_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = STEP.replace('"5 N*m"', '"5 N"').replace("spread = 0.5", "spread = 5")
    Path("step.toml").write_text(text.replace("damping[5]", "damping[7]"))
    assert main(["optimize", "step.toml"]) == 2
    said = capsys.readouterr().err
    assert "3 problems; nothing was run." in said
    assert all(line.startswith("step.toml: `optimize") for line in said.splitlines()[:3])


def test_a_study_without_the_section(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("step.toml").write_text(STEP.split("[optimize]")[0])
    assert main(["optimize", "step.toml"]) == 2
    assert "has no [optimize] section" in capsys.readouterr().err


def test_a_folder_of_other_things_is_refused_before_the_search(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("step.toml").write_text(STEP)
    Path("mine").mkdir()
    Path("mine/letter.txt").write_text("dear")

    def never(*_, **__):
        raise AssertionError("it was searched")

    monkeypatch.setattr("jaxrotor.commands.optimize.optimize", never)
    assert main(["optimize", "step.toml", "--out", "mine"]) == 2
    assert "holds files that no run wrote" in capsys.readouterr().err


def test_an_optimiser_of_optax_and_a_list_of_unknowns(tmp_path, monkeypatch):
    """Read as they are meant; what they find is `optimize`'s own."""
    monkeypatch.chdir(tmp_path)
    text = STEP.replace("iterations = 40", 'optimiser = { kind = "adam", learning_rate = 0.1 }')
    text = text.replace('"spring.damping[5]"', '"load.amplitudes"')
    text = text.replace('kind = "Torque"', 'kind = "EngineTorque"\nmean = "1 N*m"\norders = [1, 2]')
    load = 'amplitudes = ["2 N*m", "3 N*m"]'
    Path("step.toml").write_text(re.sub("value = {.*}", load, text))
    read = jr.load("step.toml").optimize
    assert [one.path for one in read.unknowns] == ["load.amplitudes"]
    state = read.options["optimiser"].init(jax.numpy.zeros(1))
    step, _ = read.options["optimiser"].update(jax.numpy.ones(1), state, jax.numpy.zeros(1))
    assert step[0] == pytest.approx(-0.1, rel=1e-6)  # Adam's first step is its rate
