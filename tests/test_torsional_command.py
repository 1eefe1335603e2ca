"""`jaxrotor torsional`, and configs/synchronous_start.toml: modes against NumPy, the start against SciPy."""

import contextlib
import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

import jaxrotor as jr
from jaxrotor.commands.cli import main

RPM = np.pi / 30
J = np.array([60.0, 6.0, 0.08, 1.2])
STIFF, LOSS = 2.6e5, 60.0
ARM = np.cos(0.3490658503988659) * np.array([0.32, 0.08])
QUILL = float(jr.STEEL.shear_modulus) * np.pi / 32 * 0.083**4 / 0.5


def matrices():
    """K and C over motor, wheel, pinion, compressor."""
    K, C = np.zeros((4, 4)), np.zeros((4, 4))
    for k, c, row in (
        (STIFF, LOSS, [1, -1, 0, 0]),
        (3e9, 2e4, [0, *ARM, 0]),  # the wheels turn against each other
        (QUILL, 2e-5 * QUILL, [0, 0, 1, -1]),
    ):
        K += k * np.outer(row, row)
        C += c * np.outer(row, row)
    return K, C


def running():
    """With the slope of the load at 1800 rpm; at t = 0 the motor is not connected yet."""
    K, C = matrices()
    C[3, 3] += 2 * 1.1e-3 * 7200 * RPM
    return K, C


def started(t):
    """Torque in coupling and quill, right end less left, and the speed of the motor."""
    K, C = matrices()
    rows = np.array([0, 450, 900, 1260, 1530, 1710, 1800, 1890]) * RPM
    mean = PchipInterpolator(rows, 1e3 * np.array([6.5, 6.8, 7.2, 8.0, 8.8, 7.0, 0.0, -7.0]))
    swing = PchipInterpolator(rows, 1e3 * np.array([4.0, 3.8, 3.6, 3.4, 3.8, 4.6, 5.2, 4.6]))

    def rates(t, y):
        q, v = y[:4], y[4:]
        f = -K @ q - C @ v
        at = min(max(v[0], 0.0), rows[-1])
        f[0] += mean(at) + swing(at) * np.cos(2 * (2 * np.pi * 60 * t - 2 * q[0]))
        f[3] -= 1.1e-3 * abs(v[3]) * v[3]
        return np.concatenate([v, f / J])

    late = np.maximum(t, 0.05)
    found = solve_ivp(
        rates, (0.05, t[-1]), np.zeros(8), "LSODA", np.unique(late), rtol=1e-9, atol=1e-10
    )
    y = found.y[:, np.searchsorted(found.t, late)]
    d, e = np.diff(y[:4], axis=0), np.diff(y[4:], axis=0)
    return STIFF * d[0] + LOSS * e[0], QUILL * (d[2] + 2e-5 * e[2]), y[4]


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The command on the example, with what it printed."""
    out, words = tmp_path_factory.mktemp("torsion") / "start", io.StringIO()
    with contextlib.redirect_stdout(words):
        assert (
            main(["torsional", "configs/synchronous_start.toml", "--out", str(out), "--quiet"]) == 0
        )
    return out, words.getvalue()


def test_what_it_writes(done):
    out, words = done
    assert sorted(p.name for p in out.iterdir()) == [
        "holzer.txt", "interference.png", "modes.png", "response.csv", "response.png", "start.png",
        "summary.json",
    ]  # fmt: skip
    assert "torsional 2: " in words and "nearest compressor 2x" in words and "(NOT met)" in words
    assert "in the start torsional 1 is met at 1517.7 rpm" in words
    assert (out / "holzer.txt").read_text().count("J w² angle") == 3


def test_modes_and_separation(done):
    told = json.loads((done[0] / "summary.json").read_text())
    K, C = running()
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-K / J[:, None], -C / J[:, None]]])
    values = np.linalg.eigvals(A)
    sizes = np.sort(np.abs(values[values.imag > 1.0]))
    found = np.array([m["frequency_rad_s"] for m in told["modes"]])
    np.testing.assert_allclose(found, np.sort(values.imag[values.imag > 1.0]), rtol=1e-7)
    # each mode against each excitation, as they are listed
    bands = [(e["lowest_rad_s"], e["highest_rad_s"]) for e in told["excitations"]]
    names = [e["name"] for e in told["excitations"]]
    assert names == [
        "motor 2x", "pinion 1x", "line frequency", "2x line frequency", "mesh teeth", "motor 1x",
        "compressor 2x",
    ]  # fmt: skip
    n1 = 1800 * RPM
    np.testing.assert_allclose(
        [high for _, high in bands],
        [2 * n1, 4 * n1, 2 * np.pi * 60, 2 * np.pi * 120, 124 * n1, n1, 8 * n1],
        rtol=1e-9,
    )
    margins = [f for f in told["findings"] if f["check"] == "torsional separation"]
    k = [f["place"] for f in margins].index("torsional 2, compressor 2x")
    size = abs(sizes[1] / (8 * n1) - 1)
    assert margins[k]["value"] == pytest.approx(size, rel=1e-6) and margins[k]["met"] is False
    assert told["passages_rad_s"]["torsional 1"] == pytest.approx(
        n1 * (1 - found[0] / (4 * np.pi * 60)), rel=1e-9
    )


def test_the_start(done):
    """Peaks in coupling and quill, and that the start stands as often as SciPy's history says by Miner."""
    told = json.loads((done[0] / "summary.json").read_text())
    t = np.arange(12001) / 4000.0
    coupling, quill, speed = started(t)
    got = {(f["check"], f["place"]): f["value"] for f in told["findings"]}
    assert got["peak torque", "coupling"] == pytest.approx(np.abs(coupling).max(), rel=1e-4)
    assert got["peak torque", "quill"] == pytest.approx(np.abs(quill).max(), rel=1e-4)
    curve = jr.standards.SNCurve([30e3, 8e3], [1e3, 1e6], of="torque", endless=True)
    expected = 1 / float(jr.standards.cycle_damage(coupling, curve))
    assert got["starts to failure", "coupling"] == pytest.approx(expected, rel=3e-3)
    assert speed[-1] == pytest.approx(1800 * RPM, rel=0.02)


def test_forced_response(done):
    """Of 80 N·m at once per turn of the motor in the coupling, by the dynamic stiffness."""
    rows = (done[0] / "response.csv").read_text().splitlines()
    header = next(csv.reader(rows[:1]))
    assert header[0] == "speed, rad/s" and "coupling by motor 1x, N*m" in header
    values = np.array([[float(x) for x in row.split(",")] for row in rows[1:]])
    speed, torque = values[:, 0], values[:, header.index("coupling by motor 1x, N*m")]
    K, C = running()
    for k in np.linspace(0, len(speed) - 1, 9).astype(int):
        w = speed[k]
        a = np.linalg.solve(K + 1j * w * C - w**2 * np.diag(J), [80.0, 0, 0, 0])
        expected = abs((STIFF + 1j * w * LOSS) * (a[1] - a[0]))
        assert torque[k] == pytest.approx(expected, rel=1e-6)


DISCS = """
[[machine.line]]
name = "motor"
kind = "Rotor"
mass = "1 kg"
polar_inertia = "2 kg*m^2"
transverse_inertia = "2 kg*m^2"
[[machine.line]]
name = "shaft"
kind = "Shaft"
length = "500 mm"
diameter = "60 mm"
rayleigh = ["0 1/s", "1e-5 s"]
[[machine.line]]
name = "fan"
kind = "Rotor"
mass = "1 kg"
polar_inertia = "3 kg*m^2"
transverse_inertia = "3 kg*m^2"
[machine.fixed]
motor = ["x", "y", "z", "psi", "theta"]
fan = ["x", "y", "z", "psi", "theta"]
"""


def study(tmp_path, section=""):
    path = Path(tmp_path) / "discs.toml"
    path.write_text(DISCS + section)
    return str(path)


def test_a_machine_alone(tmp_path, capsys):
    """No [simulation] is needed, and nothing is run then."""
    path = study(tmp_path, '[torsional]\nspeeds = ["2700 rpm", "3000 rpm"]\n')
    out = tmp_path / "out"
    assert main(["torsional", path, "--out", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == [
        "holzer.txt", "interference.png", "modes.png", "summary.json",
    ]  # fmt: skip
    said = capsys.readouterr().out
    stiff = float(jr.STEEL.shear_modulus) * np.pi / 32 * 0.06**4 / 0.5
    hertz = np.sqrt(stiff * 5 / 6) / 2 / np.pi
    assert float(re.search(r"torsional 1: ([\d.]+) Hz", said)[1]) == pytest.approx(hertz, rel=1e-3)
    assert main(["torsional", study(tmp_path)]) == 2
    assert "`torsional`: speeds are missing" in capsys.readouterr().err


def test_a_wrong_section(tmp_path, capsys):
    """Every fault at once."""
    section = """
[torsional]
speeds = ["3000 rpm", "2700 rpm"]
line_frequency = "50 mm"
margn = 0.1
[[torsional.excitations]]
name = "vanes"
station = "fun"
order = 5
frequency = "50 Hz"
[[torsional.shafts]]
name = "shift"
amplitudes = ["100 MPa", "200 MPa"]
[[torsional.shafts]]
name = "shaft"
amplitudes = ["100 MPa", "200 MPa"]
cycles = [1e3, 1e6]
"""
    assert main(["torsional", study(tmp_path, section)]) == 2
    said = capsys.readouterr().err
    for words in (
        "`torsional`: there is no `margn`: did you mean `margin`",
        "`torsional`: speeds must be above 0, the lower one first",
        "line_frequency must be in",
        '`torsional.excitations, entry 1`: station names no such part "fun": did you mean `fan`',
        "takes an order or a frequency: give one of them",
        '`torsional.shafts, entry 1`: name names no such part "shift": did you mean `shaft`',
        "cycles is missing: write cycles = [...], the S-N curve",
        "`torsional.shafts, entry 2`: amplitudes must fall from point to point",
    ):
        assert words in said, words
