"""`jaxrotor sweep`: from a study to a store, percentiles and figures; what matters, and slopes."""

import json
import re
import shutil
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
import xarray as xr

import jaxrotor as jr
from jaxrotor.commands.cli import main
from jaxrotor.commands.sweep import _replaced
from jaxrotor.sweeps.store import Store, state_of

MACHINE = """
title = "A disc on a spring, let go"
[machine.fixed]
disc = ["x", "y", "z", "psi", "theta"]
[[machine.line]]
name = "end"
kind = "PrescribedSpin"
profile = { kind = "ConstantSpeed", speed = "0 rpm" }
[[machine.line]]
name = "spring"
kind = "Coupling"
stiffness = ["0 N/m", "0 N/m", "0 N/m", "0 N*m/rad", "0 N*m/rad", "40 N*m/rad"]
damping = ["0 N*s/m", "0 N*s/m", "0 N*s/m", "0 N*m*s/rad", "0 N*m*s/rad", "1 N*m*s/rad"]
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "5 kg"
polar_inertia = "0.1 kg*m^2"
transverse_inertia = "0.06 kg*m^2"
[[machine.attachments]]
name = "load"
kind = "Torque"
at = "disc"
value = { kind = "Step", before = "4 N*m", after = "0 N*m", time = "0.1 s" }
[simulation]
t_end = "2 s"
sample_rate = "500 Hz"
"""
SAMPLE = """
[sweep]
count = 32
method = "sobol"
seed = 3
chunk = 8
[[sweep.parameters]]
path = "disc.polar_inertia"
distribution = { kind = "uniform", low = "800 kg*cm^2", high = "0.12 kg*m^2" }
also = { "disc.mass" = 50.0 }
[[sweep.parameters]]
path = "spring.damping[5]"
distribution = { kind = "triangular", low = "0.8 N*m*s/rad", mode = "1 N*m*s/rad", high = "1.2 N*m*s/rad" }
[[sweep.parameters]]
path = "spring.stiffness[5]"
distribution = { kind = "normal", mean = "40 N*m/rad", std = "4 N*m/rad", low = "25 J", high = "55 J" }
[[sweep.correlations]]
paths = ["spring.damping[5]", "spring.stiffness[5]"]
value = 0.5
[sweep.outputs.squares]
kind = "Integral"
power = 2
sensor = { kind = "Twist", first = "end", second = "disc" }
at_most = "0.002 rad^2*s"
[sweep.outputs.weight]
kind = "TotalMass"
[sweep.outputs.twist]
kind = "TimeSeries"
sensor = { kind = "Twist", first = "end", second = "disc" }
every = 10
at_most = "6 deg"
[sweep.outputs.over_speed]
kind = "OverSpeed"
sensor = { kind = "Twist", first = "end", second = "disc" }
speed_of = "disc"
edges = { from = "0 rpm", to = "20 rpm", points = 5 }
"""
FIGURES = {"distributions.png", "scatter.png", "sensitivity.png", "twist.png", "over_speed.png"}


def squares(J, c, k, torque=4.0, held=0.1):
    """Of the twist, in time, of a disc let go from T/k: ∫φ² = (T/k)² (t0 + c/(2 k) + J/(2 c))."""
    return (torque / k) ** 2 * (held + c / (2 * k) + J / (2 * c))


def swept(folder, text, *more, name="study"):
    (folder / f"{name}.toml").write_text(text)
    return main(["sweep", str(folder / f"{name}.toml"), "--out", str(folder / "out"), *more])


def stored(folder):
    """The store in the order of the table."""
    found = xr.open_zarr(folder / "out/sweep.zarr", consolidated=False).load()
    return found.isel(case=np.flatnonzero(found["case"].values >= 0)).sortby("case")


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sample")
    assert swept(folder, MACHINE + SAMPLE, "--quiet") == 0
    return folder


def test_a_sample(sample):
    """Its outputs by the closed form, what is told of them by NumPy."""
    data, told = stored(sample), json.loads((sample / "out/summary.json").read_text())
    assert {p.name for p in (sample / "out").iterdir()} == FIGURES | {"summary.json", "sweep.zarr"}
    J, c, k = (
        data[p].values for p in ("disc.polar_inertia", "spring.damping[5]", "spring.stiffness[5]")
    )
    assert J.size == 32 and 0.08 <= J.min() < 0.085 and 0.115 < J.max() <= 0.12
    np.testing.assert_allclose(data["disc.mass"], 50 * J, rtol=1e-14)
    np.testing.assert_allclose(data["weight"], 50 * J, rtol=1e-12)
    assert np.corrcoef(c, k)[0, 1] == pytest.approx(0.5, abs=0.2)
    values = data["squares"].values
    np.testing.assert_allclose(
        values, squares(J, c, k), rtol=2e-3
    )  # trapezoids of 2 ms, and an end
    one = told["outputs"]["squares"]
    want = np.percentile(values, [5, 25, 50, 75, 95])
    np.testing.assert_allclose(list(one["percentiles"].values()), want, rtol=1e-12)
    assert one["unit"] == "(rad)**2*s" and one["mean"] == pytest.approx(values.mean())
    assert one["limit"]["within"] == np.sum(values <= 0.002) and 4 < one["limit"]["within"] < 32
    share, n, z = one["limit"]["share"], 32, scipy.stats.norm.ppf(0.975)
    centre = (share + z**2 / (2 * n)) / (1 + z**2 / n)  # Wilson (1927)
    half = z / (1 + z**2 / n) * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    np.testing.assert_allclose(one["limit"]["interval_95"], [centre - half, centre + half])
    # the twist is largest while the load holds it
    twist = told["outputs"]["twist"]
    assert twist["of_the_largest"]["50"] == pytest.approx(np.median(4 / k), rel=1e-6)
    assert twist["limit"]["within"] == np.sum(4 / k <= np.deg2rad(6))
    assert data["twist"].shape == (32, 101) and told["failed"] == 0
    weights = told["sensitivities"]["squares"]
    stiff = weights["parameters"]["spring.stiffness[5]"]
    assert stiff["coefficient"] < -0.8 and weights["explained"] > 0.9
    spearman = scipy.stats.spearmanr(k, values).statistic
    assert stiff["rank_correlation"] == pytest.approx(spearman, rel=1e-9)
    assert told["sensitivities"]["weight"]["parameters"]["disc.polar_inertia"]["coefficient"] == (
        pytest.approx(1.0, abs=1e-9)
    )


FAILING = """
[sweep.table]
file = "discs.csv"
units = { "spring.damping[5]" = "N*m*s/rad" }
[sweep.outputs.squares]
kind = "Integral"
power = 2
sensor = { kind = "Twist", first = "end", second = "disc" }
at_most = "0.002 rad^2*s"
"""


def test_a_case_that_fails_is_told_and_not_counted(tmp_path, capsys):
    """Driven by its damper it grows as exp(1000 t), until numbers end."""
    (tmp_path / "discs.csv").write_text("spring.damping[5]\n1\n-100\n0.9\n0.8\n")
    assert swept(tmp_path, MACHINE + FAILING) == 0
    said = capsys.readouterr().out
    assert "4 cases, a table, discs.csv: 1 failed" in said
    assert re.search(
        r"! case 2: not finite from t = 0.\d+ s on \(spring.damping\[5\] = -100 N", said
    ), said
    told = json.loads((tmp_path / "out/summary.json").read_text())
    assert told["failed"] == 1 and told["failures"][0]["case"] == 2
    one = told["outputs"]["squares"]
    want = squares(0.1, np.array([1.0, 0.9, 0.8]), 40.0)
    assert one["ran"] == 3 and one["limit"]["within"] == np.sum(want <= 0.002)
    assert one["percentiles"]["50"] == pytest.approx(np.median(want), rel=2e-3)


def stop_after(monkeypatch, chunks):
    """Ctrl-C behind so many."""
    write = Store.write

    def stopped(self, number, *rest):
        if len(self.missing()) == 4 - chunks:
            raise KeyboardInterrupt
        write(self, number, *rest)

    monkeypatch.setattr(Store, "write", stopped)


def test_stopped_and_resumed(tmp_path, sample, monkeypatch, capsys):
    with monkeypatch.context() as stopping:
        stop_after(stopping, 2)
        assert swept(tmp_path, MACHINE + SAMPLE, "--quiet") == 130
    said = capsys.readouterr().err
    assert re.search("2 of 4 chunks are kept in .*sweep.zarr: go on with --resume", said), said
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["sweep.zarr"]
    half = xr.open_zarr(tmp_path / "out/sweep.zarr", consolidated=False).load()
    assert np.isfinite(half["squares"]).sum() == 16 and half["done"].sum() == 2
    assert swept(tmp_path, MACHINE + SAMPLE) == 2
    said = capsys.readouterr().err
    assert "a sweep that was stopped, 2 of 4 chunks are done: add --resume" in said
    # another study does not go on with it
    other = (MACHINE + SAMPLE).replace('before = "4 N*m"', 'before = "5 N*m"')
    assert swept(tmp_path, other, "--resume", name="other") == 2
    assert "holds another sweep" in capsys.readouterr().err
    assert swept(tmp_path, MACHINE + SAMPLE, "--resume") == 0
    said = capsys.readouterr().out
    assert "32 cases by Sobol points, seed 3: none failed" in said
    assert re.search(r"squares +rad²·s +0.00", said) and "what matters" in said
    data, want = stored(tmp_path), stored(sample)
    for name in want.data_vars:
        np.testing.assert_array_equal(data[name].values, want[name].values, err_msg=name)
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert names == FIGURES | {"summary.json", "sweep.zarr"}


def test_a_finished_one_is_replaced_and_an_unfinished_one_by_force(tmp_path, monkeypatch, capsys):
    text = MACHINE + GRID
    assert swept(tmp_path, text, "--quiet") == 0
    assert (tmp_path / "out/lines.png").exists()
    more = text.replace('"6 kg"]', '"6 kg", "7 kg"]')
    assert swept(tmp_path, more, "--quiet") == 0
    np.testing.assert_allclose(stored(tmp_path)["weight"], [5, 6, 7])
    # planned anew and refused: the old one stays
    with monkeypatch.context() as failing:
        failing.setattr("jaxrotor.commands.sweep.sweep", lambda *_, **__: raised())
        assert swept(tmp_path, text, "--quiet") == 2
    assert stored(tmp_path)["weight"].size == 3 and (tmp_path / "out/summary.json").exists()
    with monkeypatch.context() as stopping:
        stopping.setattr(Store, "write", lambda *_: raised(KeyboardInterrupt()))
        assert swept(tmp_path, text, "--quiet") == 130
    # figures of the one before would pass for its own; but it is kept until another one is whole
    aside = tmp_path / "out/.sweep.zarr.before"
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"sweep.zarr", aside.name}
    assert {"sweep.zarr", "summary.json", "lines.png"} <= {p.name for p in aside.iterdir()}
    assert f"the earlier sweep is in {aside}" in capsys.readouterr().err
    assert swept(tmp_path, text, "--quiet") == 2
    # killed before the new one was begun: the earlier one goes back to its place
    shutil.copytree(tmp_path / "out", tmp_path / "killed")
    shutil.rmtree(tmp_path / "killed/sweep.zarr")
    with _replaced(tmp_path / "killed", tmp_path / "killed/sweep.zarr", True):
        assert (tmp_path / "killed/summary.json").exists()
        assert state_of(tmp_path / "killed/sweep.zarr") == (1, 1)
    assert swept(tmp_path, text, "--quiet", "--force") == 0
    np.testing.assert_allclose(stored(tmp_path)["weight"], [5, 6])
    assert not aside.exists()


def test_a_sweep_that_died_while_its_store_was_made_goes_on(tmp_path):
    (tmp_path / "out/.sweep.zarr.being_made/case").mkdir(parents=True)
    assert swept(tmp_path, MACHINE + GRID, "--quiet", "--resume") == 0


def raised(error=None):
    raise error or jr.InputError("`nothing`: goes")


GRID = """
[[sweep.parameters]]
path = "disc.mass"
values = ["5 kg", "6 kg"]
[sweep.outputs.weight]
kind = "TotalMass"
at_most = "5.5 kg"
"""


def test_a_grid_of_two_axes(tmp_path, capsys):
    text = (
        MACHINE + GRID + '[[sweep.parameters]]\npath = "spring.stiffness[5]"\nfrom = "30 N*m/rad"\n'
    )
    text += (
        'to = "50 N*m/rad"\npoints = 5\n[sweep.outputs.peak]\nkind = "ResponsePeaks"\ncount = 1\n'
    )
    text += 'input = "disc.phi"\noutput = "disc.phi"\nstart = "0.1 Hz"\nstop = "9 Hz"\nat = "undeformed"\n'
    text = text.replace('"1 N*m*s/rad"]', '"0.5 N*m*s/rad"]')
    assert swept(tmp_path, text) == 0
    said = capsys.readouterr().out
    assert "lowest" in said and "10 cases, a grid, 2 x 5: none failed" in said
    assert "<= 5.5: 5 of 10" in said
    told = json.loads((tmp_path / "out/summary.json").read_text())
    assert told["outputs"]["weight"]["highest"] == pytest.approx(6.0)
    assert (tmp_path / "out/map.png").exists() and not (tmp_path / "out/distributions.png").exists()
    data = stored(tmp_path)
    k = data["spring.stiffness[5]"].values
    np.testing.assert_allclose(k, [30, 35, 40, 45, 50] * 2)
    zeta = 0.5 / 2 / np.sqrt(k * 0.1)
    want = 1 / (k * 2 * zeta * np.sqrt(1 - zeta**2))  # Den Hartog, Mechanical Vibrations, sec. 2.9
    np.testing.assert_allclose(data["peak"].values.squeeze(), want, rtol=1e-6)


def test_a_table(tmp_path, capsys):
    (tmp_path / "discs.csv").write_text(
        "number,disc.mass,disc.polar_inertia\n7,500,0.1\n8,7e2,0.11\n"
    )
    text = MACHINE + GRID.split("values")[0] + "[sweep.outputs" + GRID.split("[sweep.outputs")[1]
    text = text.replace('[[sweep.parameters]]\npath = "disc.mass"', "[sweep.table]")
    text = text.replace("[sweep.table]", f"[sweep.table]\n{TABLE}")
    assert swept(tmp_path, text) == 0
    assert "2 cases, a table, discs.csv: none failed" in capsys.readouterr().out
    np.testing.assert_allclose(stored(tmp_path)["weight"], [0.5, 0.7])
    for change, words in (
        (('"disc.mass" = "g", ', ""), "disc.mass. must be in kg, but has no unit"),
        (('"g"', '"m"'), 'disc.mass. must be in kg, but is in "m"'),
        (('["number"]', "[]"), "number.*name it in ignore"),
        (("discs.csv", "disks.csv"), "there is no such file"),
        (
            ("[sweep.table]", "[sweep]\nseed = 1\n[sweep.table]"),
            "seed goes with distributions, but",
        ),
        (('"g"', '"g", "disc.mas" = "g"'), "no column: did you mean `disc.mass`"),
    ):
        assert swept(tmp_path, text.replace(*change)) == 2
        said = capsys.readouterr().err
        assert re.search(words, said), said


TABLE = """file = "discs.csv"
units = { "disc.mass" = "g", "disc.polar_inertia" = "kg*m^2" }
ignore = ["number"]
"""


def test_shares_of_the_variance(tmp_path, capsys):
    """The mass is 50 times an inertia plus nothing: all of its variance is the inertia's."""
    text = MACHINE + SAMPLE.split("[[sweep.correlations]]")[0].replace("sobol", "saltelli")
    text += '[sweep.outputs.weight]\nkind = "TotalMass"\n'
    assert swept(tmp_path, text) == 0
    said = capsys.readouterr().out
    assert "as shares of the variance" in said and "disc.polar_inertia 100 %" in said
    told = json.loads((tmp_path / "out/summary.json").read_text())
    assert told["count"] == 32 * 5
    own = told["sensitivities"]["weight"]["parameters"]
    assert own["disc.polar_inertia"]["total"] == pytest.approx(1.0, abs=0.05)
    assert own["spring.damping[5]"]["total"] == 0.0
    # A and B alone are independent
    weights = stored(tmp_path)["weight"].values[:64]
    assert told["outputs"]["weight"]["percentiles"]["95"] == np.percentile(weights, 95)


@pytest.mark.parametrize(
    "change, words",
    [
        (("count = 32", ""), "count is missing: write count"),
        (("count = 32", "count = 0"), "count must be a whole number, 1 at least, but is 0"),
        (("count = 32", "counts = 32"), "there is no `counts`: did you mean `count`"),
        (('"sobol"', '"sobl"'), "method must be one of those known, .*did you mean `sobol`"),
        (("seed = 3", "seed = -3"), "seed must be a whole number, 0 at least, but is -3"),
        (("chunk = 8", 'chunk = "8"'), "chunk must be a whole number"),
        (('"disc.polar_inertia"', '"disk.polar_inertia"'), "entry 1`: .*did you mean `disc`"),
        (('"spring.damping[5]"', '"spring.damping"'), "entry 2`: .*has 6 entries: name one"),
        (('kind = "uniform"', 'kind = "unform"'), "did you mean `uniform`"),
        (('kind = "uniform", ', ""), "distribution has no kind: write"),
        (('low = "800 kg*cm^2"', 'low = "8 kg"'), "entry 1: distribution.low` must be in kg.m.2"),
        (('low = "800 kg*cm^2"', "low = 0.08"), "distribution.low` must carry a unit"),
        (('low = "800 kg*cm^2"', 'low = "0.2 kg*m^2"'), "distribution.low must lie below high"),
        (('low = "800 kg*cm^2"', 'low = "-1 kg*m^2"'), "is no machine: `disc`: .*must be positive"),
        (('low = "800 kg*cm^2", ', ""), "distribution.low is missing: a uniform one has low, high"),
        (('std = "4 N*m/rad"', 'std = "-4 N*m/rad"'), "distribution.std must be positive"),
        (('"disc.mass" = 50.0', '"disc.mas" = 50.0'), "entry 1: also`: .*did you mean.*mass"),
        (('"disc.mass" = 50.0', '"disc.mass" = "50"'), "also must be a table such as"),
        (('"disc.mass" = 50.0', '"spring.damping[5]" = 5.0'), "is swept twice: name it once"),
        (('also = {', 'values = ["1 kg*m^2"]\nalso = {'), "distribution and values are given"),
        (
            ('distribution = { kind = "uniform", low = "800 kg*cm^2", high = "0.12 kg*m^2" }', ""),
            "needs one of distribution, values, and from, to and points, but none is given",
        ),
        (
            ('distribution = { kind = "uniform", low = "800 kg*cm^2", high = "0.12 kg*m^2" }',
             'values = ["1 kg*m^2"]'),
            "entry 1`: .*has values, but `spring.damping.5.` a distribution",
        ),
        (
            ('distribution = { kind = "uniform", low = "800 kg*cm^2", high = "0.12 kg*m^2" }',
             'from = "1 kg*m^2"'),
            "to is missing: from, to and points go together",
        ),
        (("value = 0.5", "value = 1.5"), "entry 1`: value must lie between -1 and 1, but is 1.5"),
        (('paths = ["spring.damping[5]"', 'paths = ["disc.mass"'), "disc.mass` has no distribution"),
        (('"sobol"', '"saltelli"'), "correlations do not go with method = .saltelli"),
        (('kind = "Integral"', 'kind = "Integrall"'), "outputs.squares`: .*did you mean `Integral`"),
        (('kind = "Integral"', ""), "outputs.squares`: has no kind: write kind .*OverSpeed"),
        (('second = "disc"', 'second = "disk"'), "outputs.squares`: .*did you mean `disc`"),
        (('"0.002 rad^2*s"', '"0.002 m"'), "squares: at_most` must be in"),
        (("at_most", 'at_least = "0 rad^2*s"\nat_most'), "at_most or at_least, but both"),
        (("every = 10", "every = 0"), "every must be a whole number, 1 at least, but is 0"),
        (('from = "0 rpm"', 'from = "0 m"'), "over_speed: edges.from` must be in rad/s"),
        (('to = "20 rpm"', 'to = "-20 rpm"'), "edges must be two rising speeds at least"),
        (("points = 5", "points = 1"), "edges.points must be a whole number, 2 at least"),
        (('speed_of = "disc"', 'speed_of = "disk"'), "outputs.over_speed`: .*did you mean `disc`"),
        (("[sweep.outputs.weight]", "[sweep.outputs.case]"), "outputs.case`: needs a name"),
        (("[sweep.outputs.weight]", "[sweep.output.weight]"), "there is no `output`: did you mean"),
    ],
)  # fmt: skip
def test_refused(tmp_path, monkeypatch, capsys, change, words):
    monkeypatch.chdir(tmp_path)
    assert change[0] in SAMPLE
    Path("disc.toml").write_text(MACHINE + SAMPLE.replace(*change))
    assert main(["sweep", "disc.toml"]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said and re.search(words, said), said
    assert not Path("results").exists()
    assert main(["check", "disc.toml"]) == 2


def test_check_finds_what_else_a_sweep_refuses(tmp_path, monkeypatch, capsys):
    """An extra that is missing, a run that no memory holds; neither builds an array of the run first."""
    monkeypatch.chdir(tmp_path)
    text = MACHINE + SAMPLE
    Path("disc.toml").write_text(text)
    assert main(["check", "disc.toml"]) == 0
    with monkeypatch.context() as without:
        without.setattr("jaxrotor.commands.sweep.find_spec", lambda name: None)
        assert main(["check", "disc.toml"]) == 2
    assert 'pip install "jaxrotor[sweep]"' in capsys.readouterr().err
    Path("disc.toml").write_text(text.replace('t_end = "2 s"', 't_end = "1e12 s"'))
    for command in ("check", "run", "sweep"):
        assert main([command, "disc.toml"]) == 2
        assert "disc.toml: `simulation`: t_end = 1e+12 s" in capsys.readouterr().err


def test_all_faults_at_once_and_no_section(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = MACHINE + SAMPLE.replace("count = 32", "count = 0").replace("every = 10", "every = 0")
    Path("disc.toml").write_text(text.replace("damping[5]", "damping[7]"))
    assert main(["sweep", "disc.toml"]) == 2
    said = capsys.readouterr().err
    assert all(line.startswith("disc.toml: `sweep") for line in said.splitlines()[:-1])
    assert "damping[7]" in said and "every must" in said
    Path("disc.toml").write_text(MACHINE)
    assert main(["sweep", "disc.toml"]) == 2
    assert "has no [sweep] section" in capsys.readouterr().err
    Path("mine").mkdir()
    Path("mine/letter.txt").write_text("dear")
    Path("disc.toml").write_text(MACHINE + SAMPLE)
    assert main(["sweep", "disc.toml", "--out", "mine"]) == 2
    assert "holds files that no run wrote" in capsys.readouterr().err


PATHS = ("disc.mass", "disc.polar_inertia", "disc.transverse_inertia")


class Ishigami(jr.objectives.AbstractMachineMeasure):
    """sin x + a sin² y + b z⁴ sin x of three parameters, from -pi to pi where they lie between 1 and 2."""

    unit = "1"

    def __call__(self, machine):
        x, y, z = (2 * np.pi * (machine.get(path) - 1.5) for path in PATHS)
        return jnp.sin(x) + 7 * jnp.sin(y) ** 2 + 0.1 * z**4 * jnp.sin(x)


class Sum(jr.objectives.AbstractMachineMeasure):
    unit = "kg"

    def __call__(self, machine):
        return sum(n * machine.get(path) for n, path in enumerate(PATHS, 1))


def disc():
    return jr.Machine.in_line(
        {
            "disc": jr.Rotor(1.5, 1.5, 1.5),
            "shaft": jr.Shaft(length=0.2, diameter=0.01, rayleigh=(0.0, 1e-4)),
            "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
        }
    )


def test_sobol_indices_of_known_functions():
    """Ishigami & Homma (1990): partial variances in closed form; a sum shares by its squares."""
    spread = {path: scipy.stats.uniform(1.0, 1.0) for path in PATHS}
    found = jr.sweeps.sobol_indices(
        disc(), spread, {"ishigami": Ishigami(), "sum": Sum()}, count=2048, seed=5
    )
    a, b, pi = 7.0, 0.1, np.pi
    first = 0.5 * (1 + b * pi**4 / 5) ** 2
    second, both = a**2 / 8, 8 * b**2 * pi**8 / 225
    whole = first + second + both
    own = found.sel(output="ishigami")
    np.testing.assert_allclose(own["first"], np.array([first, second, 0]) / whole, atol=0.03)
    np.testing.assert_allclose(
        own["total"], np.array([first + both, second, both]) / whole, atol=0.03
    )
    assert np.all(own["total_low"] <= own["total"]) and np.all(own["total"] <= own["total_high"])
    assert float((own["total_high"] - own["total_low"]).max()) < 0.15
    own = found.sel(output="sum")
    for part in ("first", "total"):
        np.testing.assert_allclose(own[part], np.array([1, 4, 9]) / 14, atol=0.02)
    assert found["used"].values.tolist() == [2048, 2048]
    with pytest.raises(jr.InputError, match="power of two, such as 256, but is 100"):
        jr.sweeps.sobol_indices(disc(), spread, {"sum": Sum()}, count=100)


def test_slopes_of_all_members(sample):
    """By the closed form above."""
    study = jr.load(sample / "study.toml")
    outputs = {k: v for k, v in study.sweep.outputs.items() if k in ("squares", "weight")}
    paths = ("disc.polar_inertia", "spring.damping[5]", "spring.stiffness[5]", "disc.mass")
    cases = {p: study.sweep.cases.values[p][:5] for p in paths[:3]}
    found = jr.sweeps.local_slopes(
        study.machine, cases, outputs, paths, t_end=2.0, sample_rate=500.0, chunk=3
    )
    assert found["squares"].dims == ("case", "parameter") and found.sizes["case"] == 5
    np.testing.assert_allclose(found["weight"], [[0, 0, 0, 1]] * 5, atol=1e-12)
    J, c, k = cases.values()
    held = 0.1 + c / (2 * k) + J / (2 * c)
    want = np.stack(
        [
            (4 / k) ** 2 / (2 * c),
            (4 / k) ** 2 * (1 / (2 * k) - J / (2 * c**2)),
            -2 * 16 / k**3 * held - (4 / k) ** 2 * c / (2 * k**2),
            0 * k,
        ],
        axis=1,
    )
    np.testing.assert_allclose(found["squares"], want, rtol=0.01, atol=1e-8)
    assert found["per"].values.tolist() == ["kg*m^2", "N*m*s/rad", "N*m/rad", "kg"]
