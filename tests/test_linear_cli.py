"""`jaxrotor modes` and `jaxrotor campbell` on the overhung disc of Stodola and Green (BRG-05)."""

import csv
import json

import numpy as np
import pytest

from jaxrotor.cli import main

STUDY = """
title = "Overhung disc"
[machine]
[[machine.line]]
name = "wall"
kind = "PrescribedSpin"
profile = { kind = "ConstantSpeed", speed = "500 rad/s" }
[[machine.line]]
name = "shaft"
kind = "Shaft"
length = "100 mm"
diameter = "12 mm"
material = { youngs_modulus = "210 GPa", shear_modulus = "81 GPa", density = "7850 kg/m^3" }
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "3.0935 kg"
polar_inertia = "0.00485 kg*m^2"
transverse_inertia = "0.002837 kg*m^2"
[simulation]
t_end = "1 s"
sample_rate = "1 kHz"
"""
# det of BRG-05 at 500 rad/s, and the critical speeds up to 600 rad/s
WHIRL = [335.2668652079887, 491.9996114407756, 1628.1599552325658, 2326.2033810124676]
CRITICAL = [356.4814121898121, 490.5469505610065]


@pytest.fixture
def study(tmp_path):
    (tmp_path / "disc.toml").write_text(STUDY)
    return str(tmp_path / "disc.toml")


def test_campbell(study, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["campbell", study, "--points", "13", "--modes", "5", "--out", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == ["campbell.csv", "campbell.png", "summary.json"]
    rows = list(csv.reader((out / "campbell.csv").read_text().splitlines()))
    header, values = rows[0], np.array(rows[1:], float)
    assert header[0] == "speed, rad/s" and values.shape == (13, 1 + 3 * 5)
    assert values[-1, 0] == pytest.approx(600.0)  # 1.2 of the drive's
    at = values[values[:, 0] == 500.0][0]
    for wanted, name in zip(WHIRL, ("1 backward", "1 forward", "2 backward", "2 forward")):
        assert at[header.index(f"{name}, rad/s")] == pytest.approx(wanted, rel=1e-9)
    found = json.loads((out / "summary.json").read_text())["critical_speeds_rad_s"]["1x"]
    np.testing.assert_allclose([w for w in found if w < 550], CRITICAL, rtol=1e-9)
    said = capsys.readouterr().out
    for speed, name in zip(CRITICAL, ("1 backward", "1 forward")):
        assert f"{speed * 30 / np.pi:10.6g} rpm  {name}" in said


def test_modes(study, capsys):
    assert main(["modes", study, "--speed", "500 rad/s", "--count", "5"]) == 0
    lines = capsys.readouterr().out.splitlines()
    first = next(line for line in lines if line.startswith("1 backward"))
    assert float(first.split()[2]) == pytest.approx(WHIRL[0], rel=1e-5)
    assert "100 % lateral" in first


@pytest.mark.parametrize(
    "options, sentence",
    [
        (["campbell", "--to", "600 kg"], "`--to`: "),
        (["campbell", "--points", "1"], "`--points`: must be two at least, but is 1"),
        (["modes", "--count", "0"], "`--count`: must be one at least, but is 0"),
        (["modes", "--speed", "fast"], "`--speed`: "),
    ],
)
def test_wrong_options_are_refused_in_a_sentence(study, options, sentence, capsys):
    assert main([options[0], study, *options[1:]]) == 2
    error = capsys.readouterr().err
    assert sentence in error and "Traceback" not in error
