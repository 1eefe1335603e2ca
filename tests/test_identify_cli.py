"""`jaxrotor identify`: from a study and a CSV file to estimates, figures and a study that runs."""

import importlib
import json
import re

import diffrax
import jax
import numpy as np
import optax
import pandas
import pytest

import jaxrotor as jr
from jaxrotor.commands.cli import main
from jaxrotor.identification.identify import _wrapped
from jaxrotor.search.instrumented import Instrumented
from jaxrotor.search.space import Space

RIG = """
title = "A disc on two springs"
[machine.elements.disc]
kind = "Rotor"
mass = "2 kg"
polar_inertia = "0.02 kg*m^2"
transverse_inertia = "0.012 kg*m^2"
unbalance = { eccentricity = "0.03 mm", angle = "-30 deg" }
[machine.elements.support]
kind = "LinearSupport"
stiffness = ["1.0e5 N/m", "1.0e5 N/m", "1e5 N/m", "1e3 N*m/rad", "1e3 N*m/rad", "0 N*m/rad"]
damping = ["60 N*s/m", "60 N*s/m", "1 N*s/m", "1 N*m*s/rad", "1 N*m*s/rad", "0 N*m*s/rad"]
[machine.connections]
support = "disc"
[machine.prescribed.disc]
phi = { kind = "CosineRamp", speed = "400 rad/s", duration = "1 s" }
[simulation]
t_end = "1 s"
sample_rate = "1 kHz"
initial = "undeformed"
[identify]
records = ["run.toml"]
stages = ["orders", "time"]
turns = 4
[identify.sensors.probe]
sensor = { kind = "ProximityProbe", station = "disc", angle = "17 deg" }
unit = "V"
sensitivity = 8000
noise = { std = 0.05 }
[[identify.unknowns]]
path = "disc.unbalance.eccentricity"
positive = true
[[identify.unknowns]]
path = "disc.unbalance.angle"
circular = true
[[identify.unknowns]]
path = "support.stiffness[0]"
positive = true
also = { "support.stiffness[1]" = 1.0 }
"""
RUN = """
file = "run.csv"
time = { column = "t", unit = "ms" }
[channels.probe]
column = "X1"
unit = "mV"
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.toml").write_text(RIG)
    (tmp_path / "run.toml").write_text(RUN)
    return tmp_path


def raising(function, call):
    """`function`, but for Ctrl-C in a call of it: the first is 1."""
    calls = []

    def instead(*args, **more):
        calls.append(1)
        if len(calls) == call:
            raise KeyboardInterrupt
        return function(*args, **more)

    return instead


def measure(study):
    """run.csv: what the probe would record of the rig with other values."""
    stiffness = np.array([1.2e5, 1.2e5, 1e5, 1e3, 1e3, 0])
    truth = study.machine.set(
        {
            "disc.unbalance.eccentricity": 2e-5,
            "disc.unbalance.angle": 0.7,
            "support.stiffness": stiffness,
        }
    )
    t = np.arange(1000) / 1000
    run = jr.simulate(truth, 1.01, 1000.0, "undeformed")
    measured = study.identify.sensors["probe"].recorded(run, jax.random.key(0), t)
    table = pandas.DataFrame({"t": 1e3 * t, "X1": 1e3 * np.asarray(measured)})
    table.to_csv("run.csv", index=False)


def test_from_file_to_file(place, monkeypatch, capsys):
    """A record in mV and ms, made with other values: found again, and written into a study that runs; before
    its profiles, which Ctrl-C does without."""
    from jaxrotor.commands import identify as identified

    measure(jr.load("rig.toml"))
    (place / "run.csv").write_text("rig 2, test 7\n" + (place / "run.csv").read_text())
    summary, seen = place / "results/rig_identify/summary.json", []
    identify, profiles = identified.identify, identified.likelihood_profiles

    def found(**asked):
        seen.append(identify(**asked))
        return seen[0]

    def after_writing(*given, **more):
        seen.append(json.loads(summary.read_text()))
        return profiles(*given, **more)

    monkeypatch.setattr(identified, "identify", found)
    monkeypatch.setattr(identified, "likelihood_profiles", after_writing)
    assert main(["identify", "rig.toml"]) == 0
    assert not seen[1]["interrupted"]
    assert seen[1]["parameters"]["support.stiffness[0]"].keys() >= {"value", "std", "interval_95"}
    said, noted = capsys.readouterr()
    assert "! `run.csv`: 1 line before the names of the columns left out" in noted
    assert "disc.unbalance.eccentricity" in said and "!" not in said
    assert "by profile" in said
    folder = place / "results/rig_identify"
    told = json.loads((folder / "summary.json").read_text())["parameters"]
    for path, value in (
        ("disc.unbalance.eccentricity", 2e-5),
        ("disc.unbalance.angle", 0.7),
        ("support.stiffness[0]", 1.2e5),
    ):
        assert abs(told[path]["value"] - value) < 4 * told[path]["std"]
        # so little noise: the cost is a parabola, and both intervals are one
        width = told[path]["interval_95"][1] - told[path]["interval_95"][0]
        np.testing.assert_allclose(
            told[path]["interval_95_by_profile"], told[path]["interval_95"], atol=0.02 * width
        )
    again = jr.load(folder / "rig_identified.toml").machine
    assert again.get("support.stiffness")[1] == pytest.approx(
        told["support.stiffness[0]"]["value"], rel=1e-12
    )
    assert again.get("disc.unbalance.angle") == pytest.approx(
        told["disc.unbalance.angle"]["value"], rel=1e-12
    )
    assert {p.name for p in folder.iterdir()} == {
        "fit.png",
        "correlation.png",
        "cost.png",
        "profile.png",
        "fit.csv",
        "summary.json",
        "rig_identified.toml",
    }
    monkeypatch.setattr(identified, "identify", lambda **_: seen[0])
    monkeypatch.setattr(identified, "likelihood_profiles", raising(profiles, 1))
    assert main(["identify", "rig.toml"]) == 130
    said = capsys.readouterr().err
    assert "the estimates are in results/rig_identify/, without profiles" in said
    again_told, first_told = json.loads(summary.read_text()), seen[1]
    again_told["made"].pop("date"), first_told["made"].pop("date")
    assert again_told == first_told


@pytest.mark.parametrize("when", ["fit._step_all", "identify.pose"])
def test_ctrl_c_keeps_the_estimates_so_far(place, monkeypatch, capsys, when):
    """In the third iteration; before the second stage has begun, when the first is near the truth."""
    measure(jr.load("rig.toml"))
    module = importlib.import_module(f"jaxrotor.identification.{when.split('.')[0]}")
    name, call = when.split(".")[1], 3 if "step" in when else 2
    monkeypatch.setattr(module, name, raising(getattr(module, name), call))
    assert main(["identify", "rig.toml"]) == 130
    out, err = capsys.readouterr()
    assert "Interrupted: the estimates so far, unfinished, are in results/rig_identify/." in err
    assert "! the search was interrupted" in out and "by profile" not in out
    folder = place / "results/rig_identify"
    told = json.loads((folder / "summary.json").read_text())
    assert told["interrupted"] and any("interrupted" in words for words in told["warnings"])
    (count,) = told["iterations"].values()  # of the first stage alone
    found = told["parameters"]["disc.unbalance.eccentricity"]["value"]
    again = jr.load(folder / "rig_identified.toml").machine
    assert again.get("disc.unbalance.eccentricity") == pytest.approx(found, rel=1e-12)
    assert not (folder / "profile.png").exists()
    if "step" in when:
        assert count == 2 and abs(found - 3e-5) > 1e-8  # it has moved
    else:
        assert found == pytest.approx(2e-5, rel=0.05)
        stiffness = told["parameters"]["support.stiffness[0]"]["value"]
        assert stiffness == pytest.approx(1.2e5, rel=0.05)


def test_ctrl_c_before_anything_is_found(place, monkeypatch, capsys):
    measure(jr.load("rig.toml"))
    monkeypatch.setattr("jaxrotor.identification.fit._looked_at", raising(None, 1))
    assert main(["identify", "rig.toml"]) == 130
    assert "Interrupted: nothing was written." in capsys.readouterr().err
    assert not (place / "results").exists()


def test_ctrl_c_keeps_what_an_optimiser_of_optax_has_met(monkeypatch):
    """Two members, whose costs fall by one in each iteration."""
    from jaxrotor.identification import descent

    def step(problem, optimiser, u, state, best, least):
        return u + 1, state, u, 10.0 - u[:, 0]

    starts = np.array([[0.0], [1.0]])
    monkeypatch.setattr(descent, "_step_all", raising(step, 1))
    with pytest.raises(KeyboardInterrupt):
        descent.descend(None, starts, optax.sgd(0.1), 5)
    monkeypatch.setattr(descent, "_step_all", raising(step, 3))
    fits = descent.descend(None, starts, optax.sgd(0.1), 5)
    assert [fit.u.tolist() for fit in fits] == [[1.0], [2.0]]
    assert [fit.costs.tolist() for fit in fits] == [[10.0, 9.0], [9.0, 8.0]]
    assert all(fit.interrupted and not fit.stopped for fit in fits)


def test_settings_of_the_simulation_reach_its_runs(place, monkeypatch):
    class Asked(Exception):
        pass

    def asked(machine, simulation, **more):
        raise Asked(simulation)

    own = 'sample_rate = "1 kHz"\nsolver = "Kvaerno5"\nrtol = 1e-5\natol = 1e-8'
    (place / "rig.toml").write_text(RIG.replace('sample_rate = "1 kHz"', own))
    (place / "run.csv").write_text(CSV)
    monkeypatch.setattr("jaxrotor.identification.simulated.simulate", asked)
    with pytest.raises(Asked) as told:
        main(["identify", "rig.toml"])
    (settings,) = told.value.args
    assert isinstance(settings.solver, diffrax.Kvaerno5)
    assert (settings.rtol, settings.atol) == (1e-5, 1e-8)
    assert (settings.sample_rate, settings.initial) == (1000.0, "undeformed")


def test_identified_angles_are_wrapped(place):
    """With those tied to them: the same directions, by sine and cosine."""
    study = jr.load("rig.toml")
    path, tied = "disc.unbalance.angle", "probe.sensor.angle"
    unknown = jr.Unknown(path, start=10.0, circular=True, also={tied: -2.0})
    bench = Instrumented(study.machine, study.identify.sensors)
    space = Space.of(bench, (unknown,))
    turned = _wrapped(space, space.set(bench, [10.0]))
    for name, angle in ((path, 10.0), (tied, -20.0)):
        want = np.arctan2(np.sin(angle), np.cos(angle))
        assert float(turned.get(name)) == pytest.approx(want, abs=1e-14)


@pytest.mark.parametrize(
    "change, words",
    [
        (("records = ", "recods = "), "there is no `recods`: did you mean `records`"),
        (('station = "disc"', 'station = "disk"'), "disk"),
        (('"17 deg"', '"17 mm"'), "sensor.angle must be in rad"),
        (('kind = "ProximityProbe"', 'kind = "Proximity"'), "did you mean `ProximityProbe`"),
        (('["orders", "time"]', '["order", "time"]'), "did you mean `orders`"),
        (('unbalance.eccentricity"', 'unbalance.excentricity"'), "entry 1.*eccentricity"),
        (("circular = true", 'start = "3 mm"'), "entry 2: start.*must be in rad"),
        (("circular = true", "circular = 1"), "circular must be true or false"),
        (("circular = true", 'bounds = "3 rad"'), "bounds must be two quantities"),
        (("turns = 4", "turns = 0.5"), "stages`: .*turns must be 1 at least"),
        (("turns = 4", 'shaft = "disk"'), "shaft names no station"),
        (("turns = 4", 'loss = "hubber"'), "loss must be one of the known.*did you mean `huber`"),
        (("std = 0.05", "std = -0.05"), "noise.std must be zero or positive"),
        (('records = ["run.toml"]', 'records = "run.toml"'), "records must be a list, but is"),
        (('records = ["run.toml"]', "records = [3]"), "entry 1`: must be a file's name or"),
        (
            ('["run.toml"]', '[{ file = "run.toml", conditions = { "disc.mas" = "3 kg" } }]'),
            "records, entry 1.*disc.mas",
        ),
        (
            ('["run.toml"]', '[{ file = "run.toml", conditions = { "disc.mass" = "3 m" } }]'),
            "records, entry 1: disc.mass` must be in kg",
        ),
        (("turns = 4", "profile = 1"), "profile must be true or false, but is 1"),
        (
            ('records = ["run.toml"]', 'records = ["walk.toml"]'),
            "walk.toml`: there is no such file",
        ),
        (("[identify]", "[other]"), "there is no `other`"),
    ],
)
def test_refused(place, capsys, change, words):
    (place / "rig.toml").write_text(RIG.replace(*change))
    assert main(["identify", "rig.toml"]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said
    assert re.search(words, said), said
    assert not (place / "results").exists()


CSV = "t,X1\n" + "".join(f"{k},{k % 7}\n" for k in range(40))
# what is wrong: in the study, in the record's description, in its table
SOUND = ("", "")


@pytest.mark.parametrize(
    "study, record, table, words",
    [
        (('positive = true', 'start = "0 mm"\npositive = true'), SOUND, SOUND, "starts at 0"),
        (("0.03 mm", "0 mm"), SOUND, SOUND, "eccentricity`: .* starts at 0: give `start`"),
        (("positive = true", 'bounds = ["1 mm", "2 mm"]'), SOUND, SOUND, "not between its bounds"),
        (("positive = true", 'bounds = ["2 mm", "1 mm"]'), SOUND, SOUND, "bounds must rise"),
        (("positive = true", 'prior = ["1 mm", "0 mm"]'), SOUND, SOUND, "deviation of its prior"),
        (("circular = true", 'circular = true\nbounds = ["-1 rad", "1 rad"]'), SOUND, SOUND, "one of pos"),
        (('angle"\n', 'eccentricity"\n'), SOUND, SOUND, "is looked for twice"),
        (('"support.stiffness[1]" = 1.0', '"support.stifness[1]" = 1.0'), SOUND, SOUND, "stifness"),
        (('"support.stiffness[1]" = 1.0', '"disc.mass" = -1.0'), SOUND, SOUND, "disc.*mass must"),
        (('station = "disc"', 'station = "support"'), SOUND, SOUND, "probe`: `support`: is no station"),
        (('station = "disc"', 'station = "disk"'), SOUND, SOUND, "probe`: .*did you mean `disc`"),
        (('["run.toml"]', '["walk.toml", "ride.toml"]'), SOUND, SOUND, "(?s)walk.toml`.*ride.toml`"),
        (SOUND, ('file = "run.csv"', 'file = "ran.csv"'), SOUND, "ran.csv"),
        (SOUND, ('"X1"', '"X2"'), SOUND, "X2.*X1"),
        (SOUND, ('"mV"', '"mm"'), SOUND, "is in mm, but the channel records V"),
        (SOUND, ('"mV"', '"mW2"'), SOUND, "`mW2` is no unit"),
        (SOUND, ("channels.probe", "channels.prob"), SOUND, "did you mean `probe`"),
        (SOUND, SOUND, ("t,X1\n", "t,X1\n-9,1\n"), "values before t = 0"),
        (SOUND, SOUND, ("\n20,", "\n20,x"), "row 21 of column `X1` in `run.csv`"),
        (('"orders", "time"', '{ low = "0.9 MHz", high = "1 MHz" }'), SOUND, SOUND, "has no line between"),
        (('"1 kHz"', '"1 kHz"\nsolver = "Kvaerno5"\nrtol = 2'), SOUND, SOUND, "rtol must be below 1"),
        (
            ('"run.toml"', '{ file = "run.toml", conditions = { "disc.mass" = "-3 kg" } }'),
            SOUND, SOUND, "disc.*mass must",
        ),
    ],
)  # fmt: skip
def test_check_finds_what_identify_refuses(place, capsys, study, record, table, words):
    """The same sentences, before anything runs."""
    for name, text, change in (
        ("rig.toml", RIG, study),
        ("run.toml", RUN, record),
        ("run.csv", CSV, table),
    ):
        assert change[0] in text
        (place / name).write_text(text.replace(*change, 1))
    said = []
    for command in ("check", "identify"):
        assert main([command, "rig.toml"]) == 2, command
        said.append(capsys.readouterr().err)
    assert said[0] == said[1] and "Traceback" not in said[0]
    assert re.search(words, said[0]), said[0]
    assert not (place / "results").exists()


def test_check_passes_a_sound_identification(place, capsys):
    (place / "run.csv").write_text(CSV)
    assert main(["check", "rig.toml"]) == 0
    assert "1 Rotor, 1 LinearSupport" in capsys.readouterr().out


@pytest.fixture(scope="module")
def bench():
    """The coupling's bench, identified from its two records as the study file says."""
    from jaxrotor.commands.identify import identify_study

    study = jr.load("configs/coupling_bench.toml")
    return study, identify_study(study)


def test_coupling_bench(bench):
    """The truth of experiments/synthetic.py, from 50 % wrong."""
    _, found = bench
    truth = (350.0, 2e4, 0.1, 250.0, 1.5)
    for path, value in zip(found.paths, truth):
        assert abs(found.values[path] - value) < 4 * found.std[path], path
        assert found.std[path] < 0.25 * value
    assert found.stopped and not any("white" in w or "larger" in w for w in found.warnings)
    assert {c.run for c in found.channels} == {"start", "load step"}


def test_coupling_bench_is_written_anew(bench, tmp_path):
    """Parameters of a law inside a list, too."""
    from jaxrotor.commands.save_study import save_study

    study, found = bench
    again = jr.load(
        save_study(study, found.machine, found.changed, tmp_path / "found.toml")
    ).machine
    for path in found.changed:
        np.testing.assert_allclose(again.get(path), found.machine.get(path), rtol=1e-12)


def test_a_study_without_the_section(place, capsys):
    (place / "rig.toml").write_text(RIG.split("[identify]")[0])
    assert main(["identify", "rig.toml"]) == 2
    assert "has no [identify] section" in capsys.readouterr().err
