"""What a long run says of itself where nobody looks on: lines in a file."""

import io
import re
import sys
import time

import pytest

import jaxrotor as jr
from jaxrotor.core import notice
from jaxrotor.integrators import progress


def test_lines_where_stderr_is_a_file(monkeypatch, capfd):
    """Compiling first; then samples of the right total, though jumps and a controller's clock make more
    intervals of them."""
    monkeypatch.setattr(progress, "_LINE", 0.01)
    loads = {
        "pulses": (jr.Torque(jr.PulseTrain(0.011, 0.003, 1.0, count=40)), "disc"),
        "held": (
            jr.elements.SampledTorque(
                jr.elements.PI(0.1, 0.0), 5e-4, jr.elements.SpeedError(3.0), between=False
            ),
            "disc",
        ),
    }
    machine = jr.Machine.in_line({"disc": jr.Rotor(1.0, 0.01, 0.006)}, attachments=loads)
    samples = 4_001
    jr.simulate(machine, (samples - 1) / 1e3, 1e3, "undeformed", step=1e-3, progress=True)
    lines = capfd.readouterr().err.splitlines()
    assert re.fullmatch(r"compiling, \d+ s", lines[0])
    told = [
        re.fullmatch(r"(\d+) of (\d+) samples, \d+ s", x) for x in lines if "compiling" not in x
    ]
    assert len(told) > 5 and all(told)
    done = [int(x[1]) for x in told if x]
    assert {int(x[2]) for x in told if x} == {samples}
    assert done == sorted(done) and 0 < done[0] and done[-1] <= samples
    assert done[-1] > samples / 2


def test_a_short_run_says_nothing(capfd):
    machine = jr.Machine.in_line({"disc": jr.Rotor(1.0, 0.01, 0.006)})
    jr.simulate(machine, 0.05, 1e3, "undeformed", step=1e-3)
    assert capfd.readouterr().err == ""


class _Terminal(io.StringIO):
    def __init__(self, is_one):
        super().__init__()
        self.is_one = is_one

    def isatty(self):
        return self.is_one


@pytest.mark.parametrize("terminal", [True, False])
def test_a_word_while_programs_are_compiled(monkeypatch, terminal):
    """After a silence that programs one after the other share; in a file no oftener than it says; not where
    nobody wants to hear; and not of what is quick."""
    monkeypatch.setattr(notice, "_SILENT", 0.2)
    monkeypatch.setattr(notice, "_LINE", 0.4)
    monkeypatch.setattr(notice, "_now", notice._Notice())

    def said(*seconds, wanted=True):
        monkeypatch.setattr(notice._now, "ended", -10.0)
        out = _Terminal(terminal)
        monkeypatch.setattr(sys, "stderr", out)
        with notice.muted(not wanted):
            for length in seconds:
                with notice.compiling(), notice.compiling():
                    time.sleep(length)
        return out.getvalue().count("compiling, ")

    assert said(0.1) == 0
    assert said(0.6, wanted=False) == 0
    # tqdm writes a text once as it appears and once more when it is set
    assert 1 <= said(0.15, 0.15, 0.3) <= (4 if terminal else 1)
