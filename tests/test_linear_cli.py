"""`jaxrotor modes` and `jaxrotor campbell` on the overhung disc of Stodola and Green (BRG-05)."""

import csv
import json

import numpy as np
import pytest

from jaxrotor.commands.cli import main

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
        (
            ["campbell", "--points", "1"],
            "`--points`: must be a whole number from 2 to 1000000, but is 1",
        ),
        (
            ["modes", "--count", "0"],
            "`--count`: must be a whole number from 1 to 1000000, but is 0",
        ),
        (["modes", "--speed", "fast"], "`--speed`: "),
    ],
)
def test_wrong_options_are_refused_in_a_sentence(study, options, sentence, capsys):
    assert main([options[0], study, *options[1:]]) == 2
    error = capsys.readouterr().err
    assert sentence in error and "Traceback" not in error


DAMPED = """
[machine]
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "2 kg"
polar_inertia = "0.01 kg*m^2"
transverse_inertia = "0.006 kg*m^2"
unbalance = { eccentricity = "0.03 mm" }
[[machine.attachments]]
name = "springs"
kind = "LinearSupport"
at = "disc"
stiffness = ["20 kN/m", "20 kN/m", "20 kN/m", "50 N*m/rad", "50 N*m/rad", "TWIST N*m/rad"]
damping = ["DAMPING N*s/m", "DAMPING N*s/m", "1 N*s/m", "0 N*m*s/rad", "0 N*m*s/rad", "0 N*m*s/rad"]
[machine.fixed]
disc = ["psi", "theta"]
"""


def responded(tmp_path, damping, options=()):
    path = tmp_path / "damped.toml"
    path.write_text(DAMPED.replace("DAMPING", str(damping)).replace("TWIST", "0"))
    out = tmp_path / f"out {damping}"
    assert (
        main(
            [
                "response",
                str(path),
                "--to",
                "263 rad/s",
                "--points",
                "60",
                "--out",
                str(out),
                *options,
            ]
        )
        == 0
    )
    return json.loads((out / "summary.json").read_text())["peaks"]["disc.x"]


def test_peaks_of_the_response_are_met(tmp_path, capsys):
    """Sixty points, 4.4 rad/s apart, and a peak 0.4 rad/s wide: e/(2 zeta sqrt(1 - zeta²)) at w0/sqrt(1 -
    2 zeta²). Without damping there is none to be told. Neither needs [simulation]."""
    m, k, e, zeta = 2.0, 20e3, 3e-5, 0.002
    found = responded(tmp_path, 2 * zeta * np.sqrt(k * m))
    assert found["amplitude"] == pytest.approx(e / (2 * zeta * np.sqrt(1 - zeta**2)), rel=1e-5)
    assert found["at_rad_s"] == pytest.approx(np.sqrt(k / m / (1 - 2 * zeta**2)), rel=1e-5)
    assert "0.0075 m at most" in capsys.readouterr().out
    assert not responded(tmp_path, 0.0)["bounded"]
    assert "disc.x: without bound at 954.93 rpm" in capsys.readouterr().out


def test_critical_speeds_that_unbalance_does_not_excite_are_marked(tmp_path, capsys):
    """By hand: phi at sqrt(20/0.01), z beside x and y at sqrt(20e3/2)."""
    path = tmp_path / "damped.toml"
    path.write_text(DAMPED.replace("DAMPING", "1").replace("TWIST", "20"))
    out = str(tmp_path / "campbell")
    assert main(["campbell", str(path), "--to", "150 rad/s", "--points", "4", "--out", out]) == 0
    lines = [" ".join(x.split()) for x in capsys.readouterr().out.splitlines()]
    assert (
        f"{np.sqrt(2000) * 30 / np.pi:.6g} rpm torsional 1 (unbalance does not excite it)" in lines
    )
    assert "954.93 rpm axial 1 (unbalance does not excite it)" in lines
    assert "954.93 rpm 1 forward" in lines
