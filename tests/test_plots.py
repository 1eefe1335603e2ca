"""Pictures behind `plot`: axes in and out, nothing left open, the numbers of the object, help that helps."""

import inspect
import pydoc
import typing

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from helpers import at_instants
from matplotlib.axes import Axes

import jaxrotor as jr
from jaxrotor import plot
from jaxrotor.plot import doors, select

RATE = 2000.0
# Of the balanced line: what a picture needs beside its defaults, and how many panels it has then.
PANELS = {
    "over_time": 1, "spectrum": 1, "orbit": 3, "full_spectrum": 1, "waterfall": 1, "cascade": 1,
    "orders": 2, "centreline": 1, "poincare": 1, "spin": 3, "vibration": 3, "inclinations": 4,
    "trajectories": 1, "distances": 1, "torques": 3, "speed_differences": 4, "speed_spectrum": 2,
    "bearing_forces": 3,
}  # fmt: skip


@pytest.fixture(scope="module")
def run():
    """An orbit by hand: 100 turns at 100 rad/s, 1 mm by 0.5 mm once a turn, in a bearing at the other end."""
    machine = jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
            "shaft": jr.Shaft(0.2, 0.02),
            "disc": jr.Rotor.from_dimensions(0.2, 0.05, jr.STEEL),
            "shaft 2": jr.Shaft(0.2, 0.02),
            "bearing": jr.SelfAligningBearing(10.0, 1e6, 100.0),
        }
    )
    t = np.arange(int(2 * np.pi * RATE)) / RATE
    order = machine.wiring.stations
    q = np.zeros((t.size, 3, 6))
    v = np.zeros_like(q)
    q[:, :, 5], v[:, :, 5] = 100 * t[:, None], 100.0
    disc, turn = order.index("disc"), 100 * t
    q[:, disc, 0], v[:, disc, 0] = 1e-3 * np.cos(turn), -0.1 * np.sin(turn)
    q[:, disc, 1], v[:, disc, 1] = 5e-4 * np.sin(turn), 0.05 * np.cos(turn)
    return at_instants(machine, q, v, t)


def test_a_support_is_a_bearing(run):
    """Its force on the base is stiffness times displacement, by hand."""
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(2.0, 0.02, 0.01)},
        {"springs": (jr.LinearSupport((2e4, 3e4, 1e4, 9.0, 9.0, 1.0)), "disc")},
    )
    t = np.arange(400) / RATE
    q, v = np.zeros((t.size, 1, 6)), np.zeros((t.size, 1, 6))
    q[:, 0, 0], v[:, 0, 5] = 1e-3 * np.sin(100 * t), 100.0
    drawn = at_instants(machine, q, v, t).plot.bearing_forces()
    force = plot.forces._on_base(at_instants(machine, q, v, t), "springs")[0]
    np.testing.assert_allclose(force[:, 0], 20.0 * np.sin(100 * t), atol=1e-9)
    assert "springs" in drawn[0, 0].get_title(loc="left")
    with pytest.raises(jr.InputError, match="`disc`: is a station that bears nothing"):
        at_instants(machine, q, v, t).plot.bearing_forces("disc")
    plt.close("all")


def figures():
    return set(plt.get_fignums())


def panels_of(drawn):
    return list(np.asarray(drawn, object).ravel())


@pytest.mark.parametrize("name", PANELS)
def test_a_picture_is_drawn_on_the_axes_given_and_returns_them(run, name):
    draw = getattr(run.plot, name)
    own = panels_of(draw())
    assert len(own) == PANELS[name] and len(figures()) == 1
    fig = own[0].figure
    assert all(isinstance(ax, Axes) and ax.figure is fig for ax in own)
    plt.close(fig)
    assert not figures()
    mine, axes = plt.subplots(1, PANELS[name], squeeze=False)
    before = figures()
    found = panels_of(draw(ax=axes[0, 0] if PANELS[name] == 1 else axes[0]))
    assert all(a is b for a, b in zip(found, axes[0], strict=True)) and figures() == before
    # what is drawn on a new figure is drawn on these
    assert [len(ax.lines) for ax in found] == [len(ax.lines) for ax in own]
    assert any(len(ax.lines) + len(ax.collections) for ax in found)
    mine.canvas.draw()


def test_every_picture_has_one_face():
    """What it shows comes first, `ax` last and left out by default, axes come out; each door leads to one
    whose first argument is the object."""
    drawn = {name: getattr(plot, name) for name in plot.__all__ if name != "Curve"}
    for name, draw in drawn.items():
        signature, hints = inspect.signature(draw), typing.get_type_hints(draw)
        *_, last = signature.parameters.values()
        assert last.name == "ax" and last.default is None, name
        assert hints["return"] in (Axes, np.ndarray), name
        assert inspect.getdoc(draw), name
    for kind, behind in doors._PICTURES.items():
        for draw in behind.values():
            first = next(iter(inspect.signature(draw).parameters))
            hint = typing.get_type_hints(draw)[first]
            assert kind in (hint, *typing.get_args(hint))
            *_, last = inspect.signature(draw).parameters.values()
            assert last.name == "ax" and last.default is None
        if kind is not xr.Dataset:
            assert isinstance(inspect.getattr_static(kind, "plot"), property), kind
    assert set(PANELS) == set(doors._PICTURES[jr.Response])


def test_tab_completion_and_help_show_what_there_is(run):
    assert set(dir(run.plot)) == set(PANELS)
    told = pydoc.plain(pydoc.render_doc(run.plot))
    assert "What can be drawn of a Response. Called, it draws `over_time`." in told
    for name in PANELS:
        assert f" {name}(self, " in told
    shown = repr(run.plot)
    assert (
        "pictures of a Response:" in shown
        and "\n  orbit(station, start, orders, title, ax)\n" in shown
    )
    signature = inspect.signature(run.plot.orbit)
    assert list(signature.parameters) == ["station", "start", "orders", "title", "ax"]
    assert "Returns the axes" in inspect.getdoc(run.plot.orbit)
    assert jr.Response.plot.__doc__.startswith("What can be drawn of it")


def test_the_numbers_are_those_of_the_run(run):
    """Millimetres over seconds; the orbit by hand; a line's power is that of its sine."""
    (ax,) = run.plot.over_time(["disc.x", "disc.y"])
    np.testing.assert_allclose(ax.lines[0].get_ydata(), 1e3 * np.asarray(run["disc"].x))
    assert ax.get_ylabel() == "displacement, mm" and ax.get_xlabel() == "time, s"
    (ax,) = run.plot(names="disc.y", over="disc.phi", units=["um"])  # plot() is its first picture
    np.testing.assert_allclose(ax.lines[0].get_xdata(), np.asarray(run["disc"].phi))
    assert ax.lines[0].get_ydata().max() == pytest.approx(500, rel=1e-3)
    _, ax = plt.subplots()
    run.plot.orbit("disc", ax=ax)
    x, y = (np.asarray(z) for z in ax.lines[0].get_data())
    there = np.isfinite(x)
    np.testing.assert_allclose((x**2 + (2 * y) ** 2)[there], 1.0, rtol=1e-9)  # mm
    _, once, _ = run.plot.orbit("disc")
    assert "forward, semi-axes 1 × 0.5 mm" in once.get_title(loc="left")
    (ax,) = run.plot.spectrum("disc.x", start=0.0)
    f, density = ax.lines[0].get_data()
    density = np.nan_to_num(density)
    assert np.trapezoid(density, f) == pytest.approx(0.5e-6, rel=1e-3)  # the mean square, m²
    assert f[density.argmax()] == pytest.approx(100 / 2 / np.pi, abs=0.1)
    assert ax.get_ylabel() == "m²/Hz"


def test_what_cannot_be_drawn_is_said_and_leaves_nothing_open(run):
    for call, words in (
        (lambda: run.plot.orbit("disk"), "there is no element `disk`: did you mean `disc`"),
        (lambda: run.plot.orbit("shaft"), "`shaft`: is no station"),
        (lambda: run.plot.orbit("disc", start=9.0), "`start`: must lie within the run"),
        (lambda: run.plot.orbit(staton="disc"), "no argument 'staton': did you mean 'station'"),
        (lambda: run.plot.over_time("disk.x"), "did you mean `disc`"),
        (lambda: run.plot.over_time("disc.x", over="disc.w"), "there is no quantity `w`"),
        (lambda: run.plot.distances(["disc", "disk"]), "did you mean `disc`"),
        (lambda: run.plot.speed_differences(driver="shaft"), "driver: there is no station `shaft`"),
        (lambda: run.plot.vibration(ax=3), r"ax must be axes of matplotlib.*but is int"),
        (lambda: run.plot.vibration(ax=plt.figure().subplots(2)), "3 axes.*but is 2"),
        (lambda: run.machine.plot.modes(0.0, 1, "3d", ax=plt.figure().subplots()), '"3d", but is'),
        (lambda: run.machine.plot.modes(0.0, view="4d"), "view must be"),
    ):
        plt.close("all")
        with pytest.raises(jr.InputError, match=words):
            call()
        assert len(figures()) <= 1  # the one that was given


def test_machines_and_models_lead_to_theirs(run):
    assert isinstance(run.machine.plot(), Axes)
    fig, (left, right) = plt.subplots(1, 2)
    before = figures()
    assert run.machine.plot.layout(ax=left) is left and "disc" in {t.get_text() for t in left.texts}
    model = jr.linearize(run.machine, 100.0)
    (drawn,) = model.plot.modes(run.machine, 1, ax=right)
    assert drawn is right and right.get_title(loc="left").startswith(jr.modes(model, 1)[0].name)
    space, ax = plt.subplots(subplot_kw={"projection": "3d"}, layout="constrained")
    (drawn,) = run.machine.plot.modes(100.0, 1, "3d", ax=ax)  # linearised at this speed
    assert drawn is ax and ax.get_title(loc="left") == right.get_title(loc="left")
    space.canvas.draw()  # a layout that finds no room warns, and warnings are errors
    plt.close(space)
    other = jr.linear.Campbell(
        np.array([0.0, 100.0]), np.array([[-1 + 50j], [-1 + 60j]]), np.array([[1.0], [1.0]]),
        ("1 forward",), ("lateral",),
    )  # fmt: skip
    plt.figure(fig)
    left.clear()
    (alone,) = other.plot(ax=left)  # damped, but one axes: the frequencies alone
    assert alone is left and left.lines[0].get_ydata().tolist() == pytest.approx(
        [50 / 2 / np.pi, 60 / 2 / np.pi]
    )
    assert figures() == before and len(other.plot.campbell()) == 2


def test_one_axes_for_a_picture_of_several_panels_is_the_first_of_them(run):
    """Where that one says something alone: shafts without the drive, the orbit as it is."""
    for name in ("torques", "orbit"):
        _, ax = plt.subplots()
        (found,) = getattr(run.plot, name)(ax=ax)
        first, *others = panels_of(getattr(run.plot, name)())
        assert found is ax and others
        assert found.get_ylabel() == first.get_ylabel() and len(found.lines) == len(first.lines)
        assert found.get_xlabel()


def test_speeds_less_the_drives_know_the_gears():
    """A geared line that turns as a whole, at half the speed and the other way round behind the mesh."""
    machine = jr.Machine(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
            "shaft": jr.Shaft(0.4, 0.02),
            "a": jr.Rotor(2.0, 0.02, 0.015),
            "mesh": jr.GearMesh([0.05, 0.1], jr.elements.KelvinVoigt(1e7, 1e3)),
            "b": jr.Rotor(3.0, 0.02, 0.015),
        },
        {"shaft": ("end", "a"), "mesh": ("a", "b")},
    )
    shares = [{"end": 1.0, "a": 1.0, "b": -0.5}[name] for name in machine.wiring.stations]
    t = np.arange(64) / 1000.0
    q, v = np.zeros((2, t.size, 3, 6))
    q[:, :, 5], v[:, :, 5] = 100 * t[:, None] * shares, 100 * np.ones_like(t)[:, None] * shares
    run = at_instants(machine, q, v, t)
    assert select.turns(machine, "end") == {"end": 1.0, "a": 1.0, "b": -0.5}
    assert select.turns(machine, "b")["a"] == -2.0
    for ax in run.plot.speed_differences().ravel():
        moving = [line for line in ax.lines if len(line.get_xdata()) > 2]  # not the line at zero
        assert len(moving) == 2
        for line in moving:
            np.testing.assert_allclose(line.get_ydata(), 0.0, atol=1e-9)


def test_a_sweeps_dataset_leads_to_its_pictures():
    """As `jr.sweep` hands it out: cases in a row, and a grid of two axes."""
    rng = np.random.default_rng(0)
    cases = xr.Dataset(
        {
            "disc.mass": ("case", rng.normal(size=40), {"units": "kg"}),
            "peak": ("case", rng.normal(size=40), {"units": "m"}),
            "x": (("case", "x_time"), rng.normal(size=(40, 7)), {"units": "m"}),
            "failure": ("case", [""] * 40),
            "failed_at": ("case", np.full(40, np.nan)),
        },
        coords={"x_time": np.arange(7.0)},
    )
    left, right = cases.jaxrotor.plot.distributions("peak")[0]
    assert left.get_ylabel() == "cases" and right.get_ylabel() == "share of cases, %"
    np.testing.assert_allclose(right.lines[0].get_xdata(), np.sort(cases["peak"]))
    assert right.lines[0].get_ydata()[-1] == 100.0
    _, ax = plt.subplots()
    assert cases.jaxrotor.plot.percentile_bands("x", ax=ax) is ax
    np.testing.assert_allclose(ax.lines[0].get_xdata(), np.arange(7.0))
    ((one,),) = cases.jaxrotor.plot.scatter_matrix(["disc.mass"], "peak")
    np.testing.assert_allclose(one.lines[0].get_xdata(), cases["disc.mass"])
    grid = xr.Dataset(
        {
            "peak": (("k", "c"), np.arange(6.0).reshape(2, 3), {"units": "m"}),
            "failed_at": (("k", "c"), np.full((2, 3), np.nan)),
        },
        coords={"k": [1.0, 2.0], "c": [1.0, 2.0, 3.0]},
    )
    (one,) = grid.jaxrotor.plot.grid_map(["peak"], ax=plt.figure().subplots())
    np.testing.assert_allclose(one.collections[0].get_array(), np.arange(6.0).reshape(2, 3))
    with pytest.raises(jr.InputError, match="there is no output `peek`: did you mean `peak`"):
        cases.jaxrotor.plot.distributions(["peek"])
    assert "percentile_bands(name, limit, ax)" in repr(cases.jaxrotor.plot)
