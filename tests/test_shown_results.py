"""What results show of themselves: how much there is, from where to where, in an engineer's units."""

import csv
import dataclasses
import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray

import jaxrotor as jr
from jaxrotor.simulation import export

RPM = np.pi / 30

# Choices, marks and solvers, which are no results and hold no numbers of a run.
PLAIN = {
    "Curve",
    "ETD4RK",
    "ExponentialAdams",
    "Rosenbrock",
    "NonSmooth",
    "Parts",
    "Stage",
    "Unknown",
}


def test_every_public_class_with_numbers_shows_itself():
    """None is left with the arrays that NamedTuples, dataclasses and modules print of themselves."""
    checked = 0
    rooms = [getattr(jr, name) for name in jr.__all__ if name.islower()]
    rooms = [
        room for room in rooms if inspect.ismodule(room) and room.__name__ != "jaxrotor.protocols"
    ]
    public = {name: getattr(room, name) for room in rooms for name in room.__all__} | {
        name: getattr(jr, name) for name in jr.__all__
    }
    for name, cls in public.items():
        if not inspect.isclass(cls) or name in PLAIN or issubclass(cls, BaseException):
            continue
        if not (dataclasses.is_dataclass(cls) or hasattr(cls, "_fields")):
            continue
        shown = cls.__repr__
        assert shown is not eqx.Module.__repr__, name
        assert not hasattr(shown, "__wrapped__"), name  # generated for a dataclass
        assert shown.__module__ != "collections", name  # for a NamedTuple
        checked += 1
    assert checked > 60


@pytest.mark.parametrize(
    "result, words",
    [
        (jr.linear.Peak(100 * RPM, 2e-4), "Peak(speed=100 rpm, amplitude=0.0002)"),
        (jr.linear.Peaks(np.array([2, 4]) * np.pi, np.ones(2)),
         "Peaks(frequencies=[1, 2] Hz, magnitudes=[1, 1])"),
        (jr.Plan(3, 6, 50 * RPM, 100 * RPM, 1e-6, 5e-5),
         "Plan(substeps=3, order=6, speed=50 rpm, top_speed=100 rpm, error=1e-06, tolerance=5e-05, "
             "evaluations=1, span=1)"),
        (jr.diagnostics.Ellipse(2.0, 1.0, np.pi / 4, 1.5 + 0j, 0.5j),
         "Ellipse(major=2, minor=1, inclination=45 deg, forward=1.5+0j, backward=0+0.5j)"),
        (jr.linear.Mode("1 forward", 20 * np.pi, 0.01, 0.063, -1 + 2j, "lateral", {}, 1.0, np.ones(18)),
         "Mode(name='1 forward', frequency=10 Hz, damping_ratio=0.01, kind='lateral', whirl=1)"),
        (jr.elements.WorkingPoint(jnp.array([1e-5, -2e-5]), 1e6 * jnp.eye(2), 2e3 * jnp.eye(2)),
         "WorkingPoint(eccentricity=[10, -20] um, stiffness=[[1, 0], [0, 1]] MN/m, "
         "damping=[[2, 0], [0, 2]] kN*s/m)"),
        (jr.Cases.grid({"main.mass": [1.0, 2.0]}), "Cases(values={main.mass: [1, 2]}, how='a grid, 2', "
         "axes={main.mass: [1, 2]})"),
        (jr.identification.LikelihoodProfile("main.mass", "kg", np.arange(9.0), np.zeros(9), 0.5),
         "LikelihoodProfile(path='main.mass', unit='kg', values=9 values from 0 to 8 kg, root=9 values of 0, "
         "std=0.5 kg)"),
    ],
)  # fmt: skip
def test_a_small_result_is_one_line(result, words):
    """Written by hand."""
    text = repr(result)
    if "\n" in text:  # too long for one
        title, *rows = text.splitlines()
        text = f"{title}({', '.join('='.join(row.split(None, 1)) for row in rows)})"
    assert text == words


def test_a_large_result_has_a_line_for_each_entry():
    speeds = np.linspace(0, 6000, 13) * RPM
    values = -1 + 2j * np.pi * np.linspace(10, 80, 26).reshape(13, 2)
    found = jr.linear.Campbell(
        speeds, values, np.zeros((13, 2)), ("1 backward", "1 forward"), ("lateral",) * 2
    )
    lines = dict(line.split(None, 1) for line in repr(found).splitlines()[1:])
    assert repr(found).startswith("Campbell\n")
    assert lines["speeds"] == "13 values from 0 to 6000 rpm"
    assert lines["frequencies"] == "13 x 2 values from 10 to 80 Hz"
    assert lines["names"] == "[1 backward, 1 forward]"
    low, high = (1 / np.hypot(1, 2 * np.pi * f) for f in (80, 10))
    assert lines["damping_ratios"] == f"13 x 2 values from {low:.4g} to {high:.4g}"
    missing = found.speeds.copy()
    missing[3] = np.nan
    assert "13 values from 0 to 6000 rpm, 1 of them not finite" in repr(
        eqx.tree_at(lambda c: c.speeds, found, missing)
    )


def test_traced_and_batched_results_show_shapes():
    seen = []

    def look(speed):
        seen.append(repr(jr.linear.Peak(speed, 2 * speed)))
        return speed

    jax.make_jaxpr(look)(1.0)
    assert seen == ["Peak(speed=f64[] rad/s, amplitude=f64[])"]
    audit = jr.simulation.EnergyAudit(
        jnp.arange(3.0), *(k * jnp.arange(3.0) for k in (1.0, 2.0, 3.0, 6.0, 0.0))
    )
    # 1 + 2 + 3 = 6: what goes in is stored
    assert "relative   0" in repr(audit) and "work_in    [0, 6, 12] J" in repr(audit)
    batch = jax.tree.map(lambda x: jnp.stack([x, x]), audit)
    assert "relative   [0, 0]" in repr(batch)


@pytest.fixture(scope="module")
def run():
    machine = jr.Machine.in_line(
        {
            "disc": jr.Rotor(4.0, 0.02, 0.012),
            "shaft": jr.Shaft(0.2, 0.012, rayleigh=(0.0, 2e-4)),
            "motor": jr.PrescribedSpin(jr.LinearRamp(300 * RPM, 0.05)),
        },
        {"push": (jr.Force(5.0), "disc")},
        fixed={"disc": ["z"]},
    )
    return jr.simulate(machine, t_end=0.1, sample_rate=1000.0)


def test_a_run_says_how_it_was_made(run):
    rows = dict(line.split(None, 1) for line in repr(run).splitlines()[1:])
    assert repr(run).splitlines()[0] == "Response: 101 samples at 1 kHz, 0 to 0.1 s"
    assert (rows["stations"], rows["between"], rows["attached"]) == ("disc, motor", "shaft", "push")
    assert rows["start"] == "static"
    stats = run.stats
    steps = stats["substeps"]
    assert rows["solver"] == (
        f"ExponentialAdams, order 6, {steps} step{'s' * (steps > 1)} a sample, a step of "
        f"{1 / steps:.4g} ms"
    )
    assert rows["work"].startswith(f"{100 * steps} steps, ")
    assert rows["error"].startswith(f"{stats['error']:.2g} of a coordinate's peak")
    assert rows["speeds"] == "planned up to 300 rpm"
    speed = np.asarray(run["disc"].speed) / RPM  # evaluates the samples
    assert f"disc {speed.min():.4g} to {speed.max():.4g}, motor 0 to 300 rpm" in repr(run)
    assert "!" not in repr(run)


def test_a_doubtful_run_says_so(run):
    broken = eqx.tree_at(lambda r: r.y, run, run.y.at[50:].set(jnp.nan))
    assert "\n! not finite from t = 0.05 s on" in repr(broken)
    coarse = eqx.tree_at(lambda r: r.info.error, run, jnp.asarray(0.01))
    assert "! the run's own estimate of its error is 0.01 of a coordinate's peak" in repr(coarse)


def test_a_run_in_any_state_shows_itself(run):
    """Batches, shapes, traces, empty and single samples, trees without leaves."""
    batch = jax.tree.map(lambda x: jnp.stack([x, x]), run)
    assert repr(batch).startswith(
        "Response: a batch of 2 runs, each 101 samples at 1 kHz, 0 to 0.1 s"
    )
    assert "speeds      planned up to 300 rpm" in repr(batch)  # alike in both
    assert repr(jax.eval_shape(lambda: run)).startswith("Response: 101 samples\n")
    seen = []
    jax.make_jaxpr(lambda y: seen.append(repr(eqx.tree_at(lambda r: r.y, run, y))))(run.y)
    assert seen[0].startswith("Response: 101 samples")
    assert repr(run.until(1)).startswith("Response: 1 sample, 0 to 0 s")
    assert repr(run.until(0)).startswith("Response: 0 samples")
    assert repr(jax.tree.map(lambda x: None, run)).startswith("Response: ")


def test_a_part_of_a_run_lists_its_quantities(run):
    assert repr(run["disc"]).startswith(
        "StationResponse: `disc`, a Rotor, at 101 instants\n  x, y, z [m], "
    )
    assert repr(run["shaft"]) == (
        "ConnectorResponse: `shaft`, a Shaft, at 101 instants\n  forces, torque [N*m]"
    )


def read(path):
    with open(path, newline="", encoding="utf-8") as lines:
        names, units, *rows = csv.reader(lines)
    return names, units, np.array(rows, float)


def test_a_run_as_a_table(run, tmp_path):
    names = ["disc.x", "shaft.torque", "motor.reaction_torque", "disc.radial"]
    path = run.to_csv(tmp_path / "some.csv", names)
    head, units, rows = read(path)
    assert head == ["t", *names] and units == ["s", "m", "N*m", "N*m", "m"]
    disc = run["disc"]
    columns = (run.t, disc.x, run["shaft"].torque, run["motor"].reaction[:, 5])
    np.testing.assert_array_equal(rows[:, :4], np.stack(columns, axis=1))
    np.testing.assert_array_equal(rows[:, 4], np.hypot(disc.x, disc.y))
    # what measuring programs write, this program reads
    (tmp_path / "some.toml").write_text("""
file = "some.csv"
time = { column = "t" }
channels = { x = { column = "disc.x" }, torque = { column = "shaft.torque" } }
""")
    record = jr.read_record(tmp_path / "some.toml")
    np.testing.assert_array_equal(record["x"].values, np.asarray(disc.x))
    assert (record["x"].unit, record["torque"].unit) == ("m", "N*m")


def test_a_whole_run_as_a_table(run, tmp_path):
    names, units, rows = read(run.to_csv(tmp_path / "all.csv"))
    own = [
        f"{s}.{c}"
        for s in ("disc", "motor")
        for c in ("x", "y", "z", "psi", "theta", "phi", "speed")
    ]
    assert names == ["t", *own, "shaft.torque"] and rows.shape == (101, 16)
    np.testing.assert_array_equal(rows[:, 1:7], np.asarray(run["disc"].position))
    assert run.to_csv(tmp_path / "one.csv", "disc.y").read_text().startswith("t,disc.y\ns,m\n0.0,")


def test_a_table_that_cannot_be_written_leaves_the_old_one(run, tmp_path):
    path = tmp_path / "kept.csv"
    path.write_text("kept")
    with pytest.raises(jr.InputError) as refused:
        run.to_csv(path, ["disk.x", "disc.w", "disc.x", "disc.x", "x"])
    assert [p.split(":")[0] for p in refused.value.problems] == [
        "`disk.x`",
        "`disc.w`",
        "`disc.x`",
        "`x`",
    ]
    assert "did you mean `disc`?" in refused.value.problems[0]
    batch = jax.tree.map(lambda x: jnp.stack([x, x]), run)
    with pytest.raises(jr.InputError, match=r"`response.member\(i\).to_csv"):
        batch.to_csv(path)
    for wrong in (3, [], [3], True):
        with pytest.raises(jr.InputError, match="names must be a name or a list of names"):
            run.to_csv(path, wrong)
    assert path.read_text() == "kept" and [p.name for p in tmp_path.iterdir()] == ["kept.csv"]


def test_a_run_as_a_dataset_whose_names_are_attributes(run, tmp_path):
    """Each quantity behind a dot, with its unit, and again from the file."""
    data = run.to_xarray()
    own = [f"disc_{q}" for q in ("x", "y", "z", "psi", "theta", "phi", "speed")]
    own += [name.replace("disc", "motor") for name in own]
    own += ["shaft_torque", "shaft_forces", "push_forces"]
    whole = ["position", "velocity", "acceleration", "reaction", "speed", "mass_centre"]
    assert list(data.data_vars) == [*whole, *own] and all(name.isidentifier() for name in own)
    assert data.disc_x.attrs == dict(long_name="disc: x", units="m", element="disc", quantity="x")
    assert (data.shaft_torque.units, data.disc_psi.units) == ("N*m", "rad")
    run.save(tmp_path / "run.nc")
    with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as read:
        xarray.testing.assert_identical(read.load()[own], data[own])
        np.testing.assert_array_equal(read.disc_x, np.asarray(run.y[:, 0]))
        np.testing.assert_array_equal(read.disc_theta, read.position.sel(station="disc")[:, 4])
        np.testing.assert_array_equal(read.shaft_torque, run["shaft"].torque)
    # what is measured elsewhere may be read from such a file
    (tmp_path / "run.toml").write_text("""
file = "run.nc"
time = { column = "time" }
channels = { torque = { column = "shaft_torque" } }
""")
    assert jr.read_record(tmp_path / "run.toml")["torque"].unit == "N*m"


@pytest.mark.parametrize(
    "part, quantity, taken, name",
    [
        ("shaft 2", "torque", (), "shaft_2_torque"),
        ("2. disc", "x", (), "part_2__disc_x"),
        ("größe", "x", (), "größe_x"),
        ("\ufb01n", "x", (), "fin_x"),  # Python reads this letter as f and i behind a dot too
        ("a b", "x", ("a_b_x",), "a_b_x_2"),
        ("a.b", "x", ("a_b_x", "a_b_x_2"), "a_b_x_3"),
        ("to", "netcdf", (), "to_netcdf_2"),  # the dataset's own
    ],
)
def test_any_name_becomes_an_attribute_of_its_own(part, quantity, taken, name):
    found = export._variable(part, quantity, taken)
    assert found == name and found.isidentifier()
