"""`jaxrotor assess` and `jaxrotor report`: the section, the table with its sensitivities held against central
differences of the numbers themselves, what is written, and the example."""

import contextlib
import io
import json
import re

import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor import standards as st
from jaxrotor.commands.cli import main
from jaxrotor.study.assessing import assessed
from jaxrotor.study.read_standards import read_standards

RPM = np.pi / 30
STUDY = """
title = "One disc"
[machine]
gravity = ["0 m/s^2", "-9.81 m/s^2", "0 m/s^2"]
fixed = { left = ["z", "phi"] }
[[machine.line]]
name = "left"
kind = "Node"
[[machine.line]]
name = "shaft 1"
kind = "FiniteElementShaft"
length = "0.5 m"
diameter = "80 mm"
elements = 1
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "60 kg"
polar_inertia = "1 kg*m^2"
transverse_inertia = "0.6 kg*m^2"
unbalance = { eccentricity = "2 um", angle = "30 deg" }
[[machine.line]]
name = "shaft 2"
kind = "FiniteElementShaft"
length = "0.55 m"
diameter = "80 mm"
elements = 1
[[machine.line]]
name = "right"
kind = "Node"
[[machine.attachments]]
name = "b1"
kind = "LinearSupport"
at = "left"
stiffness = ["20 MN/m", "26 MN/m", "0 N/m", "0 N*m/rad", "0 N*m/rad", "0 N*m/rad"]
damping = ["20 kN*s/m", "24 kN*s/m", "0 N*s/m", "0 N*m*s/rad", "0 N*m*s/rad", "0 N*m*s/rad"]
[[machine.attachments]]
name = "b2"
kind = "LinearSupport"
at = "right"
stiffness = ["21 MN/m", "26 MN/m", "0 N/m", "0 N*m/rad", "0 N*m/rad", "0 N*m/rad"]
damping = ["20 kN*s/m", "24 kN*s/m", "0 N*s/m", "0 N*m*s/rad", "0 N*m*s/rad", "0 N*m*s/rad"]
[standards]
speeds = ["4500 rpm", "7500 rpm"]
probes = ["disc.x", "left at 45 deg", "right"]
bearings = ["b1", "b2"]
modes = 1
trip = "7900 rpm"
clearances = { left = "0.2 mm", disc = "1 mm" }
[standards.stability]
wheels = [{ station = "disc", power = "1 MW", diameter = "0.5 m", height = "20 mm", density_ratio = 1.5 }]
density = "20 kg/m^3"
[standards.balance]
planes = ["left", "right"]
[[standards.vibration]]
place = "disc"
accepted = "A"
[torsional]
line_frequency = "50 Hz"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("assess")


@pytest.fixture(scope="module")
def study(folder):
    (folder / "disc.toml").write_text(STUDY)
    return jr.load(folder / "disc.toml", run=False)


@pytest.fixture(scope="module")
def done(folder, study):
    words = io.StringIO()
    with contextlib.redirect_stdout(words):
        status = main(["assess", str(study.path), "--out", str(folder / "out"), "--quiet"])
    return status, words.getvalue(), json.loads((folder / "out" / "summary.json").read_text())


def test_what_it_writes(done, folder):
    status, words, told = done
    assert sorted(p.name for p in (folder / "out").iterdir()) == [
        "interference.png", "response_1_forward.png", "screening.png", "stability.png", "summary.json",
        "table.md", "table.txt", "unbalance_1_forward.png",
    ]  # fmt: skip
    missed = [f for f in told["findings"] if f["verdict"] == "NOT MET"]
    assert status == (4 if missed else 0) and told["met"] is not bool(missed)
    assert "sources" in words and "by +1 % of" in words
    header, rule, *rows = (folder / "out" / "table.md").read_text().strip().splitlines()
    assert header.count("|") == 8 and len(rows) == len(told["findings"])


def test_numbers_are_those_of_the_checks(done, study):
    """Each named finding against the function that it stands for."""
    told, machine = done[2], study.machine
    got = {(f["check"], f["place"]): f for f in told["findings"]}
    case = st.unbalance_cases(machine, 7500 * RPM, ["b1", "b2"], 1)[0]
    check = st.separation_margins(machine, "disc.x", 4500 * RPM, 7500 * RPM, case.unbalance)
    for one in check.assessment.findings:
        assert got[one.check, f"{one.place}, for {case.name}"]["value"] == float(one.value)
    wanted = 3 * 1.5 * 1e6 / (7500 * RPM) / (0.5 * 0.02)
    chart = st.stability_chart(machine, "disc", 7500 * RPM, wanted)
    ratio = next(f for f in told["findings"] if "Q0/QA" in f["check"])
    assert ratio["value"] == pytest.approx(float(chart.limit) / wanted, rel=1e-12)
    # two planes by levers: the disc stands 0.5 of 1.05 m from the left
    u = 1e6 * 60 * 2e-6
    assert got["residual unbalance, G 2.5", "at left"]["value"] == pytest.approx(u * 0.55 / 1.05)
    assert got["residual unbalance, G 2.5", "at right"]["value"] == pytest.approx(u * 0.5 / 1.05)
    seen = st.placed_response(machine, None, ["disc.x", "disc.y"], [7500 * RPM])
    vibration = next(f for f in told["findings"] if f["check"] == "shaft vibration")
    assert vibration["value"] == pytest.approx(2 * np.abs(seen.values).max())


@pytest.mark.parametrize("path", ["shaft 1.diameter", "disc.mass", "b1.stiffness", "b2.damping"])
def test_sensitivities_are_those_of_central_differences(done, study, path, monkeypatch):
    """What 1 % of a parameter is worth, against the numbers of machines about it: of every finding."""
    machine, h = study.machine, 5e-4
    value = np.asarray(machine.get(path))
    entry = value.ndim and np.arange(6) == 1
    rooms = []
    cases = st.unbalance_cases(machine, 7500 * RPM, ["b1", "b2"], 1)  # it stays as it was placed
    monkeypatch.setattr("jaxrotor.study.assess_lateral.unbalance_cases", lambda *given: cases)
    for k in (-2, -1, 1, 2):
        there = machine.set(
            {path: value * (1 + k * h * entry) if value.ndim else value * (1 + k * h)}
        )
        found = assessed(there, study.standards, study.torsional, moving=False).assessment
        rooms.append([float(f.value if np.isnan(f.limit) else f.room) for f in found.findings])
    a, b, c, d = np.array(rooms)
    expected = 0.01 * (a - 8 * b + 8 * c - d) / (12 * h)
    told = done[2]["findings"]
    name = f"{path}[1]" if value.ndim else path
    seen = np.array([f["room_by_one_percent"].get(name, 0.0) for f in told])
    sizes = np.array([max(map(abs, f["room_by_one_percent"].values()), default=1.0) for f in told])
    assert len(seen) == len(expected)
    assert np.all(np.abs(seen - expected) < 2e-6 * sizes)
    assert np.count_nonzero(seen) > 8


def test_report(study, folder, capsys):
    target = folder / "report.html"
    assert main(["report", str(study.path), "--out", str(target), "--no-gradients", "--quiet"]) in (
        0,
        4,
    )
    text = target.read_text()
    titles = [re.sub("<.*?>", "", x) for x in re.findall("<h2>.*?</h2>", text)]
    assert titles == [
        "1 Machine",
        "2 Static deflection and bearing loads",
        "3 Undamped critical speed map",
        "4 Damped natural frequencies (Campbell diagram)",
        "5 Mode shapes with the unbalance placed",
        "6 Response to unbalance",
        "7 Orbits at the greatest speed",
        "8 Stability, level 1",
        "9 Stability, level 2",
        "10 Torsion",
        "11 Summary",
    ]
    assert text.count("data:image/png;base64,") == 10 and "http" not in text
    # the supports bear the weight
    cells = re.findall(r"<td>(b[12])</td><td>(.*?)</td><td>(.*?)</td>", text)
    weight = 9.81 * float(study.machine.summary().mass)
    assert sum(float(y) for _, _, y in cells) == pytest.approx(weight, rel=1e-4)


BAD = [
    ("speeds", ["7500 rpm", "4500 rpm"], "speeds must be above 0, the lower one first"),
    ("speeds", ["4500 rpm"], "speeds must be 2 quantities"),
    ("probes", ["disk.x"], "did you mean `disc.x`"),
    ("probes", ["disc at 45 mm"], "the angle of"),
    ("probes", "disc.x", "probes must be a list of texts"),
    ("unbalance", {"disc": "5 mm"}, 'unbalance of "disc"'),
    ("unbalance", {"dis": "5 g*mm"}, "did you mean `disc`"),
    ("bearings", ["b1"], "bearings must be the two journals, but are 1"),
    ("trip", "7000 rpm", "trip must not lie below"),
    ("clearances", {"left": "-1 mm"}, "must be positive"),
    ("films", {"b1": ["1 mm", "2 mm"]}, 'films names no such part "b1"'),
    ("state", "moving", 'state is "moving"'),
    ("limits", {"share": "75 mm"}, "share"),
    ("limits", {"shares": 0.7}, "did you mean `share`"),
    ("stability", {"stations": "disc"}, "takes cross_coupling or wheels: give one of them"),
    ("stability", {"cross_coupling": "1e5 N/m"}, "stations is missing"),
    ("stability", {"wheels": [{"station": "disc"}]}, "power is missing"),
    ("balance", {"planes": ["left"]}, "planes must be two stations"),
    ("balance", {"grade": 0}, "grade must be positive"),
    ("vibration", [{"place": "disc", "accepted": "D"}], 'accepted is "D"'),
    ("vibration", [{"kind": "housing", "place": "disc"}], "place names no such part"),
    ("magnetic", [{"name": "loops"}], "name names no such part"),
    ("speed", ["1 rpm"], "did you mean `speeds`"),
]


@pytest.mark.parametrize("key, value, words", BAD)
def test_mistakes(study, key, value, words):
    good = {"speeds": ["4500 rpm", "7500 rpm"], "probes": ["disc.x"]}
    with pytest.raises(jr.InputError, match=re.escape(words)) as error:
        read_standards(good | {key: value}, study.machine)
    assert all(problem.startswith("`standards") for problem in error.value.problems)


def test_all_faults_at_once(study):
    with pytest.raises(jr.InputError) as error:
        read_standards({"probes": ["dis"], "trip": 3, "modes": 0}, study.machine)
    assert len(error.value.problems) == 4  # with speeds, which are missing


def test_a_study_that_asks_for_nothing(folder, capsys):
    text = STUDY.partition("[standards]")[0]
    (folder / "none.toml").write_text(text)
    assert main(["assess", str(folder / "none.toml")]) == 2
    assert "write [standards]" in capsys.readouterr().err
    (folder / "empty.toml").write_text(text + '[standards]\nspeeds = ["1 rpm", "2 rpm"]\n')
    assert main(["assess", str(folder / "empty.toml"), "--quiet"]) == 2
    assert "names nothing to assess" in capsys.readouterr().err


def test_the_example():
    """Its margin falls short in y, and the two parameters that the table names first buy it: 1 % of each."""
    study = jr.load("configs/compressor_assessment.toml", run=False)
    one = assessed(study.machine, study.standards, None, moving=False)
    missed = [i.finding for i in one.items if not bool(i.finding.met) and i.decides]
    assert [(f.check, f.place[:7]) for f in missed] == [("separation margin", "end 1.y")]
    longer = {f"shaft {k}.length": 1.01 * study.machine[f"shaft {k}"].length for k in (1, 4)}
    better = assessed(study.machine.set(longer), study.standards, None, moving=False)
    assert bool(better.assessment.met)
