"""`jaxrotor identify`: from a study and a CSV file to estimates, figures and a study that runs."""

import json

import jax
import numpy as np
import pandas
import pytest

import jaxrotor as jr
from jaxrotor.cli import main

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


def test_from_file_to_file(place, capsys):
    """A record in mV and ms, made with other values: found again, and written into a study that runs."""
    study = jr.load("rig.toml")
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
    assert main(["identify", "rig.toml"]) == 0
    said = capsys.readouterr().out
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
        "summary.json",
        "rig_identified.toml",
    }


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
        (("turns = 4", "turns = 0.5"), "turns must be 1 at least, but is 0.5"),
        (("turns = 4", 'shaft = "disk"'), "shaft names no station"),
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
    import re

    assert re.search(words, said), said
    assert not (place / "results").exists()


@pytest.fixture(scope="module")
def bench():
    """The coupling's bench, identified from its two records as the study file says."""
    from jaxrotor.study.identified import identify_study

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
    from jaxrotor.study.save import save_study

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
