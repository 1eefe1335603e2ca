"""`jaxrotor report RESULT`: one page that holds all, is drawn in a browser, keeps every peak, and refuses
what is no result."""

import csv
import json
import re
import shutil
import subprocess

import numpy as np
import plotly.graph_objects as go
import pytest
import xarray as xr

from jaxrotor.commands.cli import main
from jaxrotor.commands.new import TEMPLATES
from jaxrotor.core.errors import MissingExtraError
from jaxrotor.pages import page as laid
from jaxrotor.pages.charts import Curve, Panel, drawn, plain, stacked
from jaxrotor.pages.motion import Course, animated, fine
from jaxrotor.pages.page import Chapter, Interactive, Table, Words, page
from jaxrotor.pages.thin import envelope, thinned

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """The templates, as `jaxrotor new` writes them."""
    folder = tmp_path_factory.mktemp("place")
    for file in TEMPLATES.iterdir():
        (folder / file.name).write_text(file.read_text())
    return folder


@pytest.fixture(scope="module")
def run(place):
    """The page of a start-up, and its summary: run and laid out once."""
    study, out = place / "startup.toml", place / "results" / "startup"
    assert main(["run", str(study), "--out", str(out), "--quiet"]) == 0
    assert main(["report", str(out), "--quiet"]) == 0
    return (place / "results/startup.html").read_text(), out


def specs(text):
    """The figures of a page, each held against plotly's own list of what it takes."""
    found = [
        json.loads(x) for x in re.findall(r'<script type="application/json" id=".*?">(.*?)</script>', text)
    ]  # fmt: skip
    for spec in found:
        go.Figure(spec)  # raises for what is no property of a figure
    return found


def titles(text):
    return [re.sub("<.*?>", "", x) for x in re.findall("<h2>.*?</h2>", text)]


def test_the_page_of_a_run(run):
    text, folder = run
    told = [x.split(" ", 1)[1] for x in titles(text)]
    assert told == [
        "At a glance",
        "Machine",
        "In motion",
        "Speed",
        "Vibration",
        "Orbits",
        "Waterfall",
        "Forces and torques",
        "Peaks",
        "Other figures",
        "Study as it was written",
        "How it was made",
    ]
    # nothing is fetched: no address is loaded, and the library stands in the page once
    markup = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r'(src|href)="(?!data:|#)', markup) and "@import" not in markup
    assert text.count("plotly.js v") == 1
    summary = json.loads((folder / "summary.json").read_text())
    assert "unbalance = { eccentricity = &quot;20 um&quot;" in text  # the study, as written
    for words in (summary["made"]["command"], summary["made"]["date"].replace("T", " ")):
        assert words in markup and words
    assert "of each peak; 5e-05 was asked for" in text  # its own error
    assert f"{1e3 * summary['stations']['fan']['radial_displacement_m']['peak']:.4g}" in text


def test_what_is_drawn_is_what_was_computed(run):
    """Of each displacement the extremes, to the digits that are written."""
    text, folder = run
    with xr.open_dataset(folder / "response.nc", engine="h5netcdf") as data:
        x, y = (data[f"fan_{c}"].values for c in "xy")
        speed = data["motor_speed"].values
    every = specs(text)
    curves = {
        (t["name"], len(t["y"])): t for s in every for t in s["data"] if "name" in t and "y" in t
    }
    for name, values in (("x", x), ("y", y), ("distance", np.hypot(x, y))):
        shown = next(t["y"] for (n, _), t in curves.items() if n == name)
        assert max(shown) == pytest.approx(1e6 * values.max(), rel=1e-4)
        assert min(shown) == pytest.approx(1e6 * values.min(), rel=1e-4)
    motor = next(t["y"] for (n, _), t in curves.items() if n == "motor")
    assert max(motor) == pytest.approx(30 / np.pi * speed.max(), rel=1e-4)
    # the machine in motion: a picture every 1.2/119 s, at the ends of the run
    (moving,) = [s for s in every if s.get("frames")]
    assert len(moving["frames"]) == 120
    steps = moving["layout"]["sliders"][0]["steps"]
    assert steps[0]["label"].startswith("0 s, 0 rpm") and steps[-1]["label"].startswith(
        "1.2 s, 380"
    )


def test_peaks_survive_thinning():
    values = np.sin(np.arange(100_001) / 7.0)
    values[31_415], values[77_777] = 5.0, -6.0
    keep = thinned(values, 200)
    assert len(keep) <= 402 and {0, 100_000, 31_415, 77_777} <= set(keep)
    assert np.all(np.diff(keep) > 0)
    assert len(thinned(values[:100])) == 100
    t = np.arange(values.size) / 1e4
    at, low, high = envelope(t, values, 50)
    assert (at[0], at[-1]) == (0.0, 10.0)
    assert low.min() == -6.0 and high.max() == 5.0
    values[5000:9000] = np.nan
    assert {31_415, 77_777} <= set(thinned(values, 200))


def test_a_dense_curve_is_a_band_and_one_trace():
    t = np.linspace(0.0, 1.0, 8001)
    wave = np.sin(2 * np.pi * 400 * t)
    low, high, trace = drawn(Curve("w", t, wave))
    assert high["fill"] == "tonexty" and trace["opacity"] < 0.5
    # transparent: what is behind shows
    assert float(high["fillcolor"].rstrip(")").rpartition(",")[2]) < 0.3
    assert max(high["y"]) == pytest.approx(1.0, abs=1e-3) and max(low["y"]) < -0.9
    assert len(drawn(Curve("s", t, np.sin(20 * t)))) == 1
    spec = stacked([Panel("a", "m", [Curve("w", t, wave), Curve("v", t, t)])], "s")
    assert sorted(x["name"] for x in spec["data"] if x["showlegend"]) == ["v", "w"]
    assert plain([1.23456789, np.nan, np.inf]) == [1.2346, None, None]


def test_the_whirl_is_taken_from_the_run():
    """A circle of known size and phase, seen a quarter of a turn later each time."""
    import jaxrotor as jr

    machine = jr.Machine.in_line(
        {
            "disc": jr.Rotor(2.0, 0.012, 0.008),
            "shaft": jr.Shaft(length=0.5, diameter=0.02),
            "end": jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
        }
    )
    t = np.arange(2001) / 1000
    turn = 100.0 * t
    xy = np.zeros((t.size, 2, 2))
    xy[:, 0] = 1e-3 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    np.testing.assert_allclose(
        fine(t, xy[:, 0], 0.5, 0.6, 50)[-1], 1e-3 * np.array([np.cos(60), np.sin(60)]), atol=1e-8
    )
    found = animated(machine, ["disc", "end"], Course(t, xy, np.full(t.size, 100.0)))
    frames = found.spec["frames"]
    # 0.13 of the length high; y up the page, x towards the reader
    heights = np.array([f["data"][2]["y"][0] for f in frames])
    assert np.abs(heights).max() == pytest.approx(0.13 * 0.5 * np.hypot(1.0, 0.28), rel=0.02)
    assert f"{0.13 * 0.5 / 1e-3:.4g} times as large" in found.caption
    # its end stands still
    assert {f["data"][2]["y"][1] for f in frames} == {0.0}
    assert animated(machine, ["disc", "end"], Course(t, 0 * xy, turn)) is None


def test_linear_pages(place):
    study = str(place / "linear.toml")
    for command, more in (
        ("campbell", ["--to", "4000 rpm", "--points", "9", "--modes", "4"]),
        ("response", ["--to", "4000 rpm", "--points", "40"]),
        ("modes", ["--count", "4"]),
    ):
        out = place / "linear" / command
        assert main([command, study, "--out", str(out), *more]) == 0
        assert main(["report", str(out / "summary.json"), "--quiet"]) == 0
        text = (place / "linear" / f"{command}.html").read_text()
        assert titles(text)[0].split(" ", 1)[1] == {"campbell": "Campbell diagram"}.get(
            command, command.capitalize()
        )
        told = json.loads((out / "summary.json").read_text())
        if command == "campbell":
            marks = [t for s in specs(text) for t in s["data"] if t["mode"] == "markers"]
            lateral = [
                w
                for w, k in zip(told["critical_speeds_rad_s"]["1x"], told["critical_kinds"]["1x"])
                if k == "lateral"
            ]
            np.testing.assert_allclose(marks[0]["x"], 30 / np.pi * np.array(lateral), rtol=1e-4)
        elif command == "response":
            shown = next(t for s in specs(text) for t in s["data"] if t["name"] == "fan.x")
            peak = told["peaks"]["fan.x"]
            assert max(shown["y"]) == pytest.approx(1e6 * peak["amplitude"], rel=1e-4)
            top = shown["x"][int(np.argmax(shown["y"]))]
            assert top == pytest.approx(30 / np.pi * peak["at_rad_s"], rel=1e-4)
        else:
            assert f"{told['modes'][0]['frequency_rad_s'] / 2 / np.pi:.5g}" in text


def written(folder, summary, **tables):
    """A folder of results."""
    folder.mkdir(parents=True)
    (folder / "summary.json").write_text(json.dumps(summary))
    for name, rows in tables.items():
        with open(folder / f"{name}.csv", "w", newline="") as lines:
            csv.writer(lines).writerows(rows)
    return folder


def laid_out(folder):
    assert main(["report", str(folder), "--quiet"]) == 0
    return folder.with_name(f"{folder.name}.html").read_text()


def test_the_page_of_an_identification(tmp_path):
    summary = {
        "study": "gone.toml",
        "parameters": {
            "fan.unbalance.eccentricity": {
                "value": 3e-5, "std": 1e-7, "interval_95": [2.98e-5, 3.02e-5], "unit": "m",
            },
            "fan.unbalance.angle": {
                "value": 1.4, "std": 0.01, "interval_95": [None, None], "unit": "rad",
            },
        },
        "correlation": [[1.0, 0.5], [0.5, 1.0]],
        "singular_values": [1.2, 0.9],
        "blind": [],
        "warnings": ["probe: looks inverted </script>"],
        "values_compared": 200,
        "loss": "squares",
        "came_to_rest": True,
        "interrupted": False,
        "costs": {"1: time": [900.0, 30.0, 12.0]},
        "channels": [
            {"run": "a", "channel": "probe", "unit": "um", "std": 1.0, "rms_residual": 1.1, "white": 0.4},
        ],
    }  # fmt: skip
    t = np.arange(200) / 100
    rows = [["run", "channel", "unit", "over", "at, SI", "measured", "identified", "im", "im"]]
    rows += [["a", "probe", "um", "time", x, np.sin(x) + 0.1, np.sin(x), "", ""] for x in t]
    text = laid_out(written(tmp_path / "found", summary, fit=rows))
    for words in ("30 µm", "29.8 µm to 30.2 µm", "open", "probe: looks inverted &lt;/script&gt;"):
        assert words in text
    assert "The study is not known" in text
    named = {t["name"]: t for s in specs(text) for t in s["data"] if "name" in t}
    np.testing.assert_allclose(named["left over"]["y"], 0.1, atol=1e-4)
    np.testing.assert_allclose(named["identified"]["y"], np.sin(t), rtol=1e-4)
    np.testing.assert_allclose(named["1: time"]["y"], [900, 30, 12])


def test_the_page_of_an_optimisation(tmp_path):
    summary = {
        "study": "gone.toml",
        "objective": {"name": "peak", "unit": "m", "before": 2e-4, "after": 1e-4},
        "parameters": {"damper.stiffness": {"unit": "N/m", "before": 1e5, "after": 3e5}},
        "constraints": [{"name": "mass", "limit": 40.0, "value": 39.0, "sense": "<="}],
        "evaluations": 3,
        "converged": False,
        "stopped": "the evaluations ran out",
    }
    rows = [["evaluation", "search", "objective, m", "bounds missed by"]]
    rows += [[1, 1, 2e-4, 0.0], [2, 1, 5e-5, 0.3], [3, 1, 1e-4, 0.0]]
    text = laid_out(written(tmp_path / "best", summary, history=rows))
    assert "-50 %" in text and "did not converge: the evaluations ran out" in text
    named = {t["name"]: t for s in specs(text) for t in s["data"]}
    # the second keeps no bound
    np.testing.assert_allclose(named["best so far within bounds"]["y"], [2e-4, 2e-4, 1e-4])


def test_the_page_of_a_sweep(tmp_path):
    rng = np.random.default_rng(0)
    x = rng.uniform(1.0, 2.0, 40)
    series = x[:, None] * np.linspace(0.0, 1.0, 11)
    folder = tmp_path / "swept"
    limit = {"at_most": 6e-3, "within": 30, "share": 0.75, "interval_95": [0.6, 0.86]}
    percent = dict(zip(("5", "25", "50", "75", "95"), np.percentile(4e-3 * x, [5, 25, 50, 75, 95])))
    own = {"unit": "m", "percentiles": percent, "ran": 39}
    summary = {
        "study": "gone.toml",
        "cases": "40 cases at random",
        "count": 40,
        "parameters": {"main.mass": {"unit": "kg", "lowest": 1.0, "median": 1.5, "highest": 2.0}},
        "outputs": {
            "peak": {**own, "limit": limit},
            "course": {"unit": "m", "of_the_largest": percent, "ran": 40},
        },
        "failed": 1,
        "failures": [{"case": 7, "why": "it broke", "parameters": {"main.mass": 1.2}}],
        "sensitivities": {
            "kind": "rank regression",
            "peak": {
                "parameters": {
                    "main.mass": {"coefficient": 0.9, "coefficient_interval_95": [0.8, 1.0]}
                },
                "explained": 0.81,
            },
        },
    }
    written(folder, summary)
    peak = 4e-3 * x
    peak[6] = np.nan
    data = xr.Dataset(
        {
            "main.mass": ("case", x),
            "peak": ("case", peak),
            "course": (("case", "course_time"), 1e-3 * series),
            "done": ("chunk", np.ones(1, np.int8)),
            "failed_at": ("case", np.full(40, np.nan)),
        },
        {"case": np.arange(40), "course_time": np.linspace(0.0, 1.0, 11)},
    )
    data.to_zarr(folder / "sweep.zarr", consolidated=False, zarr_format=3)
    text = laid_out(folder)
    assert (
        "1 of 40 cases failed" in text and "it broke" in text and "≤ 6 mm: 30 of 39, 75 %" in text
    )
    figures = [t for s in specs(text) for t in s["data"]]
    bars = next(t for t in figures if t["type"] == "bar" and "orientation" not in t)
    assert sum(bars["y"]) == 39  # all that ran
    median = next(t for t in figures if t.get("name") == "median")
    np.testing.assert_allclose(median["y"], 1e3 * np.median(1e-3 * series, axis=0), rtol=1e-4)


def test_a_run_that_failed(tmp_path, run, capsys):
    """What was computed before is shown, and that it failed stands on top; too little of it is refused."""
    folder = tmp_path / "failed"
    shutil.copytree(run[1], folder)
    with xr.open_dataset(folder / "response.nc", engine="h5netcdf") as found:
        data = found.load()
    told = json.loads((folder / "summary.json").read_text())
    told["failed"] = "it went beyond all bounds at 0.9 s"
    (folder / "summary.json").write_text(json.dumps(told))
    data["position"][900:] = np.nan
    data.to_netcdf(folder / "response.nc", engine="h5netcdf", invalid_netcdf=False)
    text = laid_out(folder)
    assert '<ul class="warnings"><li>The run did not end as it should: it went beyond' in text
    assert "0.899 s, 900 samples" in text and "Orbits" in text
    data["position"][3:] = np.nan
    data.to_netcdf(folder / "response.nc", engine="h5netcdf", invalid_netcdf=False)
    assert "holds 3 samples, too few" in refused([folder], capsys)


def test_other_results_and_lone_files(tmp_path, run):
    """A kind without a layout of its own shows what its summary says; a saved run needs no folder."""
    summary = {"study": "gone.toml", "title": "Torsion", "modes": [{"name": "t 1", "hertz": 36.0}]}
    text = laid_out(written(tmp_path / "torsion", summary))
    assert "<td>t 1</td><td>36</td>" in text
    shutil.copy(run[1] / "response.nc", tmp_path / "mine.nc")
    assert main(["report", str(tmp_path / "mine.nc"), "--quiet"]) == 0
    text = (tmp_path / "mine.html").read_text()
    assert "The study is not known" in text and "Waterfall" in text


def refused(arguments, capsys):
    assert main(["report", *map(str, arguments), "--quiet"]) == 2
    said = capsys.readouterr().err.strip()
    assert "\n" not in said
    return said


def test_what_is_no_result_is_refused(tmp_path, capsys, run, monkeypatch):
    assert "is not there" in refused([tmp_path / "nowhere"], capsys)
    (tmp_path / "empty").mkdir()
    assert "is empty" in refused([tmp_path / "empty"], capsys)
    (tmp_path / "other").mkdir()
    (tmp_path / "other/notes.txt").write_text("x")
    assert "holds no summary.json" in refused([tmp_path / "other"], capsys)
    assert "is no result" in refused([tmp_path / "other/notes.txt"], capsys)
    assert "was not written by jaxrotor" in refused([written(tmp_path / "w", {"a": 1})], capsys)
    (tmp_path / "w/summary.json").write_text('{"stations": ')
    assert "is damaged" in refused([tmp_path / "w"], capsys)
    (tmp_path / "w/summary.json").write_text("[]")
    assert "was not written by jaxrotor" in refused([tmp_path / "w"], capsys)
    shutil.copytree(run[1], tmp_path / "run")
    (tmp_path / "run/response.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    assert "cannot be read" in refused([tmp_path / "run"], capsys)
    (tmp_path / "run/response.nc").unlink()
    assert "response.nc is missing" in refused([tmp_path / "run"], capsys)
    (tmp_path / "sweep/sweep.zarr").mkdir(parents=True)
    assert "go on with it" in refused([tmp_path / "sweep"], capsys)
    assert "goes with a study" in refused([run[1], "--standard", "api617"], capsys)
    assert "must end in .html" in refused([run[1], "--out", tmp_path / "page.pdf"], capsys)
    monkeypatch.setattr(laid, "find_spec", lambda name: None)
    assert 'pip install "jaxrotor[report]"' in refused([run[1]], capsys)


def test_a_page_without_figures_that_zoom_needs_no_plotly(monkeypatch):
    monkeypatch.setattr(laid, "find_spec", lambda name: None)
    text = page("A & B", "now", [Chapter("One", [Words("<x>"), Table("T", ["a"], [["1"]])])])
    assert "<title>A &amp; B</title>" in text and "&lt;x&gt;" in text and len(text) < 20_000
    with pytest.raises(MissingExtraError):
        page("A", "", [Chapter("One", [Interactive("f", stacked([], "s"))])])


def test_a_study_that_changed_is_not_drawn(run, tmp_path):
    """The text that was kept is read, not the file as it is now."""
    from jaxrotor.pages.result import find_result

    _, folder = run
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    told = json.loads((copy / "summary.json").read_text())
    told["study"] = str(tmp_path / "now.toml")
    (tmp_path / "now.toml").write_text("[machine]\n")
    (copy / "summary.json").write_text(json.dumps(told))
    found = find_result(copy)
    assert found.study is not None and not found.told
    assert set(found.study.machine.elements()) >= {"fan", "motor"}
    told["made"]["study"] = "[machine]\n"
    (copy / "summary.json").write_text(json.dumps(told))
    found = find_result(copy)
    assert found.study is None and "cannot be drawn" in found.told[0]


def browsed(page_file, tmp_path, *more):
    """What a browser without a screen makes of a page."""
    assert CHROMIUM
    done = subprocess.run(
        [
            CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-sync",
            f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=5000", *more,
            f"file://{page_file}",
        ],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_a_browser_draws_it(run, tmp_path):
    """No script fails, and each figure has lines; on a narrow screen too."""
    text, folder = run
    count = len(specs(text))
    for size in ("1280,900", "500,900"):
        seen = browsed(
            folder.with_name("startup.html"), tmp_path, f"--window-size={size}", "--dump-dom"
        )
        body = re.search(r"<body[^>]*>", seen)
        assert body and f'data-drawn="{count}"' in body[0] and "data-error" not in body[0], body
        assert len(re.findall(r'class="main-svg"', seen)) >= 2 * count
        assert len(re.findall(r'class="js-line"', seen)) > count
        assert "copy</button>" in seen and 'class="number"' in seen


def test_a_broken_page_is_noticed(tmp_path):
    """The test above can fail: a figure that is none is told by the page."""
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    spec = {"data": [{"type": "scatter", "y": [1, 2]}], "layout": {"height": 200, "margin": None}}
    text = page("T", "", [Chapter("One", [Interactive("f", spec)])])
    (tmp_path / "page.html").write_text(text.replace('"data":', '"data":7,"dat":'))
    seen = browsed(tmp_path / "page.html", tmp_path, "--dump-dom")
    assert "data-error" in re.search(r"<body[^>]*>", seen)[0]
