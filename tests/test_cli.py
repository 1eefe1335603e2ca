"""The command line: what lands where, what is said, and the exit status.

The simulation is a stand-in except in one test: what it computes is tested elsewhere.
"""

import _thread
import json
import os
import signal
import subprocess
import sys
import time
import types
from pathlib import Path

import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor import simulation
from jaxrotor.commands.cli import main
from jaxrotor.core.errors import SimulationFailed

STUDY = """
title = "a disc on a shaft"
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "6 kg"
polar_inertia = "0.0187 kg*m^2"
transverse_inertia = "0.0102 kg*m^2"
[[machine.line]]
name = "shaft"
kind = "Shaft"
length = "200 mm"
diameter = "12 mm"
[[machine.line]]
name = "end"
kind = "PrescribedSpin"
profile = { kind = "ConstantSpeed", speed = "3000 rpm" }
[simulation]
t_end = "4 ms"
sample_rate = "1 kHz"
"""


class FakeResponse:
    t = np.array([0.0, 0.5, 1.0])
    stats = {"solver": "none"}

    def __getitem__(self, name):
        x = np.array([0.0, 2e-3, 1e-3])
        return types.SimpleNamespace(x=x, y=0 * x, speed=np.array([0.0, 300.0, 314.0]))

    def save(self, path):
        Path(path).write_text("data")


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with a study, as the working directory; reports and drawings are stand-ins."""
    (tmp_path / "disc.toml").write_text(STUDY)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(simulation, "simulate", lambda *_, **__: FakeResponse())

    def write_report(study, response, folder, extra, draw=True):
        for name in ("peaks.png", "summary.json"):
            (Path(folder) / name).write_text(str(sorted(extra)))
        return []

    report = types.ModuleType("jaxrotor.commands.run_report")
    report.write_report = write_report
    report.summary_table = lambda response: "disc  2 mm  300 rad/s"
    monkeypatch.setitem(sys.modules, "jaxrotor.commands.run_report", report)
    figure = types.SimpleNamespace(
        savefig=lambda path, **_: Path(path).write_text(f"picture of {Path(path).name}")
    )
    plot = types.ModuleType("jaxrotor.plot.machine")
    plot.draw_machine = lambda machine: types.SimpleNamespace(figure=figure)
    monkeypatch.setitem(sys.modules, "jaxrotor.plot.machine", plot)
    return tmp_path


def everything(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*"))


def test_run_writes_everything_and_says_where(place, capsys):
    assert main(["run", "disc.toml"]) == 0
    assert everything(place / "results") == [
        "disc",
        "disc/peaks.png",
        "disc/response.nc",
        "disc/summary.json",
    ]
    said, warned = capsys.readouterr()
    assert "results/disc/" in said and "response.nc" in said
    # 2 Hz for 50 turns a second
    assert "0.0 samples a turn at 314 rad/s" in warned and 'sample_rate = "250 Hz"' in warned
    assert "disc  2 mm  300 rad/s\n" in said  # the report's table
    extra = (place / "results/disc/summary.json").read_text()
    for key in ("settings", "versions", "timings", "solver", "failed"):
        assert key in extra


def test_a_real_run_from_file_to_file(place, monkeypatch):
    """Nothing is a stand-in here: data, summary and figures of a real run."""
    import xarray

    monkeypatch.undo()
    monkeypatch.chdir(place)
    (place / "disc.toml").write_text(STUDY.replace("4 ms", "200 ms"))
    assert main(["run", "disc.toml", "--quiet"]) == 0
    with xarray.open_dataset("results/disc/response.nc", engine="h5netcdf") as data:
        assert data["position"].sel(station="end", coordinate="phi").values == pytest.approx(
            100 * np.pi * np.arange(201) * 1e-3
        )
    summary = json.loads((place / "results/disc/summary.json").read_text())
    assert summary["stations"]["end"]["final_speed_rad_s"] == pytest.approx(100 * np.pi)
    assert summary["title"] == "a disc on a shaft" and summary["versions"]["jax"]
    pictures = sorted(p.name for p in (place / "results/disc").glob("*.png"))
    assert pictures[0] == "01_machine.png" and len(pictures) == 10
    assert all((place / "results/disc" / p).stat().st_size > 10_000 for p in pictures)
    assert main(["show", "disc.toml", "--out", "disc.png"]) == 0
    assert (place / "disc.png").read_bytes()[:4] == b"\x89PNG"


def _no_op(*_):
    pass


def test_run_again_replaces_its_own_files_and_leaves_others(place):
    assert main(["run", "disc.toml", "--out", "a", "--quiet"]) == 0
    (place / "a/notes.txt").write_text("mine")
    (place / "a/peaks.png").write_text("old")
    assert main(["run", "disc.toml", "--out", "a", "--quiet"]) == 0
    assert (place / "a/notes.txt").read_text() == "mine"
    assert (place / "a/peaks.png").read_text() != "old"
    assert everything(place) == [
        "a",
        "a/notes.txt",
        "a/peaks.png",
        "a/response.nc",
        "a/summary.json",
        "disc.toml",
    ]


def test_quiet_says_nothing(place, capsys):
    assert main(["run", "disc.toml", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_folder_of_other_things_is_refused_before_the_run(place, monkeypatch, capsys):
    (place / "thesis").mkdir()
    (place / "thesis/chapter1.tex").write_text("words")
    monkeypatch.setattr(simulation, "simulate", lambda *_, **__: pytest.fail("it ran"))
    assert main(["run", "disc.toml", "--out", "thesis"]) == 2
    said = capsys.readouterr().err
    assert "thesis" in said and "chapter1.tex" in said and "--force" in said
    monkeypatch.setattr(simulation, "simulate", lambda *_, **__: FakeResponse())
    assert main(["run", "disc.toml", "--out", "thesis", "--force"]) == 0
    assert (place / "thesis/chapter1.tex").exists() and (place / "thesis/response.nc").exists()


@pytest.mark.parametrize("place_for", ["disc.toml", "disc.toml/deeper"])
def test_a_file_where_a_folder_should_be(place, place_for, capsys):
    assert main(["run", "disc.toml", "--out", place_for]) == 2
    said = capsys.readouterr().err
    assert "disc.toml" in said and "--out" in said
    assert everything(place) == ["disc.toml"]


# Ctrl-C while it simulates, while it saves, while it draws
def _interrupt(*_, **__):
    raise KeyboardInterrupt


def _half_a_file(self, path):
    Path(path).write_text("ha")
    raise KeyboardInterrupt


@pytest.mark.parametrize("when", ["simulate", "save", "report"])
@pytest.mark.parametrize("earlier", [False, True])
def test_ctrl_c_leaves_no_half_file(place, monkeypatch, capsys, when, earlier):
    if earlier:
        assert main(["run", "disc.toml", "--quiet"]) == 0
        (place / "results/disc/response.nc").write_text("earlier")
    before = everything(place)
    if when == "simulate":
        monkeypatch.setattr(simulation, "simulate", _interrupt)
    elif when == "save":
        monkeypatch.setattr(FakeResponse, "save", _half_a_file)
    else:
        monkeypatch.setattr(sys.modules["jaxrotor.commands.run_report"], "write_report", _interrupt)
    assert main(["run", "disc.toml"]) == 130
    assert [p for p in everything(place) if p != "results"] == [p for p in before if p != "results"]
    if earlier:
        assert (place / "results/disc/response.nc").read_text() == "earlier"
    said = capsys.readouterr().err.strip()
    assert said == "Interrupted: nothing was written."


def test_ctrl_c_amid_the_figures_keeps_the_data(place, monkeypatch, capsys):
    """A second one, while the summary is written, leaves nothing: the case "report" above."""
    report = sys.modules["jaxrotor.commands.run_report"]
    write, drawn = report.write_report, []

    def once(*given, draw=True):
        drawn.append(draw)
        if draw:
            raise KeyboardInterrupt
        return write(*given)

    monkeypatch.setattr(report, "write_report", once)
    assert main(["run", "disc.toml"]) == 130
    assert drawn == [True, False]
    said = capsys.readouterr().err
    assert "the figures are missing" in said and "results/disc/response.nc" in said
    assert (place / "results/disc/response.nc").read_text() == "data"
    assert (place / "results/disc/summary.json").exists()


def test_ctrl_c_does_not_wait_for_compiled_code(place, monkeypatch, request):
    # stands for a compiled call: signals reach Python when it has ended, too late for a user
    def busy(*_, **__):
        _thread.interrupt_main()
        time.sleep(20)

    monkeypatch.setattr(simulation, "simulate", busy)
    # a shell's background job ignores the signal, and then nothing would be interrupted
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    began = time.monotonic()
    assert main(["run", "disc.toml"]) == 130
    assert time.monotonic() - began < 10
    assert everything(place / "results") == []


def test_a_failure_halfway_leaves_no_half_file_either(place, monkeypatch):
    def full(self, path):
        Path(path).write_text("ha")
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(FakeResponse, "save", full)
    assert main(["run", "disc.toml"]) == 2
    assert everything(place / "results") == []


@pytest.mark.parametrize("report_too", [True, False])
def test_a_failed_simulation_keeps_what_it_had(place, monkeypatch, capsys, report_too):
    def fail(*_, **__):
        raise SimulationFailed("the run left the finite numbers at t = 0.7 s", FakeResponse())

    monkeypatch.setattr(simulation, "simulate", fail)
    if not report_too:

        def no_report(*_, **__):
            raise ValueError("nothing to draw")

        monkeypatch.setattr(sys.modules["jaxrotor.commands.run_report"], "write_report", no_report)
    assert main(["run", "disc.toml"]) == 3
    said = capsys.readouterr().err
    assert "t = 0.7 s" in said and "results/disc/response.nc" in said
    assert ("nothing to draw" in said) is not report_too
    assert "failed" in (place / "results/disc/summary.json").read_text()
    assert "Traceback" not in said
    assert (place / "results/disc/response.nc").read_text() == "data"
    # and a second run may write there
    assert main(["run", "disc.toml"]) == 3


def test_figures_that_fail_do_not_cost_the_data(place, monkeypatch, capsys):
    def no_report(*_, **__):
        raise ValueError("a bug in a figure")

    monkeypatch.setattr(sys.modules["jaxrotor.commands.run_report"], "write_report", no_report)
    with pytest.raises(ValueError, match="a bug in a figure"):
        main(["run", "disc.toml"])
    assert "response.nc" in capsys.readouterr().err
    assert everything(place / "results/disc") == ["response.nc", "summary.json"]
    assert "a bug in a figure" in (place / "results/disc/summary.json").read_text()


def test_check_runs_nothing(place, monkeypatch, capsys):
    monkeypatch.setattr(simulation, "simulate", lambda *_, **__: pytest.fail("it ran"))
    assert main(["check", "disc.toml"]) == 0
    said = capsys.readouterr().out
    assert "1 Rotor, 1 Shaft, 1 PrescribedSpin" in said
    assert everything(place) == ["disc.toml"]


@pytest.mark.parametrize("command", ["run", "check", "show"])
def test_mistakes_are_sentences_on_stderr(place, capsys, command):
    text = STUDY.replace('"200 mm"', "0.2").replace('"6 kg"', '"6 m"')
    (place / "bad.toml").write_text(text)
    assert main([command, "bad.toml"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert 'bad.toml: `line "shaft"`: length must carry a unit' in err
    assert 'bad.toml: `line "disc"`: mass must be in kg' in err
    assert err.splitlines()[-1] == "2 problems; nothing was run."
    assert everything(place) == ["bad.toml", "disc.toml"]


def test_a_missing_study(place, capsys):
    assert main(["check", "disk.toml"]) == 2
    said = capsys.readouterr().err
    assert "disk.toml" in said and "no such file" in said and "disc.toml" in said


def test_show_draws_into_a_file(place, capsys):
    assert main(["show", "disc.toml"]) == 0
    assert capsys.readouterr().out.strip() == "disc.png"
    assert main(["show", "disc.toml", "--out", "pictures/line.svg"]) == 0
    assert everything(place) == ["disc.png", "disc.toml", "pictures", "pictures/line.svg"]
    assert (place / "disc.png").read_text() == "picture of disc.png"


@pytest.mark.parametrize("target, part", [(".", "is a folder"), ("a.xyz", "a.xyz")])
def test_show_refuses_what_it_cannot_write(place, capsys, target, part):
    assert main(["show", "disc.toml", "--out", target]) == 2
    assert part in capsys.readouterr().err
    assert everything(place) == ["disc.toml"]


def test_help_teaches(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["--help"])
    assert stopped.value.code == 0
    said = capsys.readouterr().out
    for part in ("[[machine.line]]", "examples:", "summary.json", "exit status", "check", "show"):
        assert part in said
    assert main([]) == 0  # no command: the same text
    assert capsys.readouterr().out == said


def test_the_study_in_the_help_is_a_study(place, capsys):
    main([])
    said = capsys.readouterr().out
    start, end = said.index('  title = "'), said.index("options:")
    text = said[start:end].split("\npositional")[0]
    (place / "help.toml").write_text("\n".join(line[2:] for line in text.splitlines()))
    assert main(["check", "help.toml"]) == 0


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("jaxrotor ")


@pytest.mark.parametrize("wrong", [["walk", "disc.toml"], ["run"], ["run", "disc.toml", "--fast"]])
def test_wrong_arguments_end_with_2(place, wrong, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(wrong)
    assert stopped.value.code == 2


def test_the_program_sets_64_bits_and_the_library_does_not(place):
    code = (
        "import jaxrotor, jax; assert not jax.config.jax_enable_x64\n"
        "from jaxrotor.commands.cli import main; main(['check', 'disc.toml'])\n"
        "assert jax.config.jax_enable_x64"
    )
    environment = {k: v for k, v in os.environ.items() if k != "JAX_ENABLE_X64"}
    source = str(Path(jr.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment | {"PYTHONPATH": source},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr


INTERRUPTED = """
import os, signal, sys, threading, time
sys.argv = ["jaxrotor", "check", sys.argv[2]]
watched = {module!r}
def watch():
    while watched not in sys.modules:
        time.sleep(1e-4)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=watch, daemon=True).start()
from jaxrotor.commands.cli import main
sys.exit(main())
"""


@pytest.mark.parametrize("module", ["numpy", "jax", "jaxrotor.elements", "jaxrotor.study"])
def test_ctrl_c_while_the_program_is_imported(module):
    """An interrupt amid the import of NumPy comes out as an ImportError, if at all."""
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED.format(module=module), "--", "configs/overhung_fan.toml"],
        capture_output=True, text=True, cwd=Path(__file__).parent.parent,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "\nInterrupted: nothing was begun.\n"), done
