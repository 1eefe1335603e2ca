"""A run that is stopped keeps the samples so far: those of the whole run, whatever made it."""

import _thread
import json
import signal
import time

import numpy as np
import pytest
import xarray as xr

import jaxrotor as jr
from jaxrotor.commands.cli import main
from jaxrotor.core import interrupt
from jaxrotor.integrators import progress

LOADS = {
    "pulses": (jr.Torque(jr.PulseTrain(0.0113, 0.003, 1.0, count=40)), "disc"),
    "spring": (jr.LinearSupport((2e4, 2e4, 2e4, 9.0, 9.0, 0.0)), "disc"),
}
HELD = {
    "held": (
        jr.elements.SampledTorque(
            jr.elements.PI(0.1, 0.0), 5e-4, jr.elements.SpeedError(3.0), between=False
        ),
        "disc",
    )
}


@pytest.fixture(autouse=True)
def hearing():
    """A shell's background job ignores Ctrl-C, and then nothing would be interrupted."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def stopped(monkeypatch):
    """Ctrl-C comes with the fortieth part of a run."""
    take, seen = progress._take, []

    def stopping(*given):
        take(*given)
        seen.append(1)
        if len(seen) == 40:
            _thread.interrupt_main()
            time.sleep(0.5)  # the main thread looks ten times a second

    monkeypatch.setattr(progress, "_take", stopping)
    return seen


@pytest.mark.parametrize("held", [False, True], ids=["", "sampled"])
@pytest.mark.parametrize("solver", ["adams", "adaptive"])
def test_the_samples_so_far(stopped, solver, held):
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(1.0, 0.01, 0.006, unbalance=jr.Unbalance(1e-4))},
        attachments=LOADS | (HELD if held else {}),
    )
    asked = dict(t_end=0.5, sample_rate=1e3, initial="undeformed", speed=200.0)
    if solver == "adams":
        asked |= dict(step=1e-3)
    else:  # whose parts are longer
        asked |= dict(solver=jr.Rosenbrock(), sample_rate=8e3)
    with pytest.raises(
        jr.SimulationInterrupted, match=r"stopped at t = 0\.\d+ s of 0\.5 s"
    ) as caught:
        jr.simulate(machine, **asked, progress=True)
    kept = caught.value.response
    whole = jr.simulate(machine, **asked, progress=False)
    n = len(kept.t)
    assert 18 < n < 0.8 * len(whole.t)
    np.testing.assert_array_equal(kept.t, whole.t[:n])
    np.testing.assert_allclose(kept.y, whole.y[:n], rtol=1e-9, atol=1e-12)
    assert kept.stats["solver"] == whole.stats["solver"]
    assert np.isfinite(kept["disc"].acceleration).all()


STUDY = """
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "1 kg"
polar_inertia = "0.01 kg*m^2"
transverse_inertia = "0.006 kg*m^2"

[[machine.attachments]]
name = "support"
kind = "LinearSupport"
at = "disc"
stiffness = ["20 kN/m", "20 kN/m", "20 kN/m", "9 N*m/rad", "9 N*m/rad", "9 N*m/rad"]

[simulation]
t_end = "0.5 s"
sample_rate = "1 kHz"
speed = "0 rpm"
step = "1 ms"
"""


def test_jaxrotor_run(stopped, tmp_path, monkeypatch, capsys):
    """Data and summary, marked as unfinished; exit status 130."""
    monkeypatch.setattr(progress, "_TWO_SECONDS", 0)
    (tmp_path / "study.toml").write_text(STUDY)
    out = tmp_path / "out"
    assert main(["run", str(tmp_path / "study.toml"), "--out", str(out), "--quiet"]) == 130
    told = capsys.readouterr().err
    assert f"What was computed before is in {out}/response.nc" in told
    assert {p.name for p in out.iterdir()} == {"response.nc", "summary.json"}
    with xr.open_dataset(out / "response.nc", engine="h5netcdf") as data:
        end = float(data.time[-1])
    assert 0.038 < end < 0.4 and f"stopped at t = {end:.6g} s of 0.5 s" in told
    summary = json.loads((out / "summary.json").read_text())
    assert summary["interrupted"] and summary["failed"] in told


def test_a_time_limit():
    with pytest.raises(KeyboardInterrupt), interrupt.time_limit(0.05):
        for _ in range(100):
            time.sleep(0.1)
    assert interrupt.interrupted() == "Stopped at the time limit of 0.05 s"
    with interrupt.time_limit(0.05):
        pass
    time.sleep(0.1)
    assert interrupt.interrupted() is None


@pytest.mark.parametrize("limit", ["0 s", "-1 s", "3 kg", "soon", "nan s"])
def test_a_time_limit_that_is_none(limit, tmp_path, capsys):
    (tmp_path / "study.toml").write_text(STUDY)
    command = ["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]
    assert main([*command, f"--time-limit={limit}"]) == 2
    assert "`--time-limit`: " in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
