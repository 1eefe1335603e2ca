"""Mode shapes, Bode and polar plots: what is drawn are the numbers, and it can be read."""

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_hex

import jaxrotor as jr
from jaxrotor import plot
from jaxrotor.plot import deflection
from jaxrotor.plot.labels import nice_multiples, rows
from jaxrotor.plot.lines import phase
from jaxrotor.plot.style import COLOURS

SPEED = 300.0


@pytest.fixture(autouse=True)
def close():
    yield
    plt.close("all")


def support(kx, ky):
    return jr.LinearSupport([kx, ky, 1e6, 0, 0, 0], [300.0, 200.0, 50.0, 0, 0, 0])


@pytest.fixture(scope="module")
def machine():
    """An overhung disc on a shaft with mass, in supports that differ along x and y."""
    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft": jr.FiniteElementShaft(0.5, 0.03, elements=2),
            "right": jr.Node(),
            "stub": jr.Shaft(0.2, 0.03),
            "disc": jr.Rotor(8.0, 0.08, 0.05),
        },
        attachments={"a": (support(2e6, 3e6), "left"), "b": (support(2e6, 3e6), "right")},
    )


@pytest.fixture(scope="module")
def model(machine):
    return jr.linearize(machine, SPEED, "undeformed")


@pytest.fixture(scope="module")
def found(model):
    return {mode.name: mode for mode in jr.modes(model)}


def column(model, mode, coordinate, names):
    """One coordinate of a mode at each station."""
    index = {place: i for i, place in enumerate(model.coordinates)}
    return np.array([mode.shape[index[n, coordinate]] for n in names])


def drawn(ax, label):
    (line,) = (line for line in ax.get_lines() if line.get_label() == label)
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


STATIONS = ["left", "shaft.1", "right", "disc"]
Z = np.array([0.0, 0.25, 0.5, 0.7])


def test_lateral_modes_are_drawn_as_they_are(machine, model, found):
    """Curves run through the stations with the stations' slopes, the band is that of the orbits."""
    mode = found["1 forward"]
    ax = plot.mode_shapes(machine, model, "1 forward")[0]
    x, y, psi, theta = (column(model, mode, name, STATIONS) for name in ("x", "y", "psi", "theta"))
    for values, slopes, name in ((x, theta, "x"), (y, -psi, "y")):
        z, curve = drawn(ax, f"{name} at its largest")
        where, dots = drawn(ax, f"{name} at its largest, stations")
        order = np.argsort(where)
        np.testing.assert_allclose(where[order], Z, atol=1e-15)
        factor = dots[order][3] / values[3]  # its largest is at the disc
        assert abs(factor.imag) < 1e-12 * abs(factor) or np.argmax(np.abs(values)) == 3
        turned = values * np.conj(values[3]) / np.abs(values[3]) ** 2
        np.testing.assert_allclose(dots[order] / dots[order][3], turned.real, atol=1e-12)
        at = [np.interp(place, z, curve) for place in Z]
        np.testing.assert_allclose(at, dots[order], atol=1e-12)
        slopes = dots[order][3] * np.real(slopes * np.conj(values[3])) / np.abs(values[3]) ** 2
        for k in range(3):
            part = (z >= Z[k]) & (z <= Z[k + 1])
            cubic = np.polynomial.Polynomial.fit(z[part], curve[part], 3).deriv()
            np.testing.assert_allclose(cubic(Z[k : k + 2]), slopes[k : k + 2], atol=1e-9)
    (band,) = ax.collections
    corners = band.get_paths()[0].vertices
    assert corners[:, 1].max() == pytest.approx(1.0) and corners[:, 1].min() == pytest.approx(-1.0)
    angles = np.linspace(0, 2 * np.pi, 3601)
    turn = np.exp(1j * angles)
    reach = [np.hypot((a * turn).real, (b * turn).real).max() for a, b in zip(x, y)]
    want = np.array(reach) / max(reach)
    for place, size in zip(Z, want):
        here = corners[np.abs(corners[:, 0] - place) < 1e-12, 1]
        assert here.max() == pytest.approx(size, abs=1e-6)


def test_titles_say_what_a_mode_is(machine, model, found):
    ax = plot.mode_shapes(machine, model, [1])[0]
    mode = min(found.values(), key=lambda m: abs(m.eigenvalue))
    for words in (
        f"{mode.name}: {mode.frequency / 2 / np.pi:.4g} Hz at {SPEED * 30 / np.pi:.4g} rpm",
        f"damping ratio {100 * mode.damping_ratio:.3g} %",
        f"log decrement {mode.log_decrement:.3g}",
    ):
        assert words in ax.get_title(loc="left")
    assert ax.get_xlabel() == "z, m" and "largest = 1" in ax.get_ylabel()
    words = [text.get_text() for text in ax.texts]
    assert words == ["left", "right", "disc"]


def test_torsional_and_axial_modes_show_their_own_coordinate(machine, model, found):
    """Straight between the stations, the largest 1."""
    for name, coordinate in (("torsional 1", "phi"), ("axial 1", "z")):
        ax = plot.mode_shapes(machine, model, name)[0]
        values = column(model, found[name], coordinate, STATIONS)
        want = np.real(values * np.conj(values[np.argmax(np.abs(values))]))
        z, curve = drawn(ax, coordinate)
        np.testing.assert_allclose(
            [np.interp(place, z, curve) for place in Z], want / want.max(), atol=1e-12
        )


def test_six_lowest_modes_by_default(machine, model, found):
    axes = plot.mode_shapes(machine, model)
    lowest = sorted(found.values(), key=lambda m: abs(m.eigenvalue))[:6]
    titles = [ax.get_title(loc="left").split(":")[0] for ax in axes]
    assert titles == [mode.name for mode in lowest]


@pytest.mark.parametrize(
    "which, sentence",
    [
        ("1 forwrd", "there is no mode `1 forwrd`: did you mean `1 forward`?"),
        (["bending 1"], "`1 forward`, "),
        (0, "there is no mode `0`"),
        ([], "which: names no mode"),
    ],
)
def test_a_mode_that_is_not_there_is_refused(machine, model, which, sentence):
    with pytest.raises(jr.InputError) as error:
        plot.mode_shapes(machine, model, which)
    assert sentence in str(error.value)
    if which:
        assert "`1 backward`" in str(error.value)
    with pytest.raises(jr.InputError, match='view must be "2d" or "3d", but is \'4d\''):
        plot.mode_shapes(machine, model, view="4d")


def test_orbits_in_space(machine, model, found):
    """An ellipse at each station, in the colour of its direction; its dot lies on the centre line."""
    for name, colour in (("1 forward", COLOURS[0]), ("1 backward", COLOURS[1])):
        ax = plot.mode_shapes(machine, model, name, view="3d")[0]
        x, y = (column(model, found[name], c, STATIONS) for c in "xy")
        orbits = [line for line in ax.lines if line.get_label().startswith("orbit")]
        (centre,) = (line for line in ax.lines if line.get_label() == "centre line")
        along, across, up = (np.asarray(values) for values in centre.get_data_3d())
        assert len(orbits) == 4
        for line in orbits:
            z, u, v = (np.asarray(values) for values in line.get_data_3d())
            k = int(np.argmin(np.abs(Z - z[0])))
            assert u[0] == pytest.approx(u[-1]) and v[0] == pytest.approx(v[-1])
            ratio = np.ptp(u) / np.ptp(v)  # peak to peak, as its angles are sampled: 5 deg
            assert ratio == pytest.approx(abs(x[k]) / abs(y[k]), rel=5e-3)
            area = 0.5 * np.sum(u[:-1] * v[1:] - u[1:] * v[:-1])
            turns = -np.imag(np.conj(x[k]) * y[k])
            assert np.sign(area) == np.sign(turns)
            forward = line.get_label() == "orbit, forward"
            assert forward == (turns > 0)
            on = [np.interp(z[0], along, across), np.interp(z[0], along, up)]
            np.testing.assert_allclose([u[0], v[0]], on, atol=1e-9)
        disc = [line for line in orbits if line.get_data_3d()[0][0] == pytest.approx(0.7)]
        assert to_hex(disc[0].get_color()).upper() == colour
    for name in ("torsional 1", "axial 1"):
        plot.mode_shapes(machine, model, name, view="3d")[0].figure.canvas.draw()


def geared():
    """A pinion turns a wheel, which turns a fan; a branch leaves the wheel too."""
    disc = jr.Rotor(2.0, 0.012, 0.008)
    mesh = jr.elements.KelvinVoigt(1e8, 10.0)
    return jr.Machine(
        {
            "motor": jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
            "stub": jr.Shaft(0.1, 0.02),
            "pinion": disc,
            "mesh": jr.GearMesh((0.03, 0.06), mesh, pressure_angle=0.35),
            "wheel": disc,
            "shaft": jr.Shaft(0.2, 0.015),
            "fan": disc,
            "second": jr.Shaft(0.1, 0.015),
            "pump": disc,
            "feet": support(1e6, 1e6),
        },
        {
            "stub": ("motor", "pinion"),
            "mesh": ("pinion", "wheel"),
            "shaft": ("wheel", "fan"),
            "second": ("wheel", "pump"),
            "feet": "wheel",
        },
    )


def test_gears_join_no_axis_to_another_and_branches_have_a_lane():
    machine = geared()
    where = deflection.places(machine)
    at = {name: i for i, name in enumerate(where.names)}
    amplitudes = np.zeros((len(at), 6), complex)
    amplitudes[:, 0] = 1.0 + np.arange(len(at))
    first, second, third = deflection.axes_of(machine, where, amplitudes)
    # what gears drive stands beside its driver: no axis is cut
    assert not any(np.isnan(axis.z).any() for axis in (first, second, third))
    assert first.amplitudes[-1, 0] == amplitudes[at["pinion"], 0]
    assert where.z[at["pinion"]] == where.z[at["wheel"]]
    assert second.lane == where.lanes[at["wheel"]] == 1
    assert second.amplitudes[0, 0] == amplitudes[at["wheel"], 0]
    assert third.lane == where.lanes[at["pump"]] == 2
    assert third.amplitudes[0, 0] == amplitudes[at["wheel"], 0]  # it starts where it leaves
    assert third.amplitudes[-1, 0] == amplitudes[at["pump"], 0]
    assert {where.names[i] for i in where.supported} == {"motor", "wheel"}
    assert {where.names[i] for i in where.rotors} == {"pinion", "wheel", "fan", "pump"}
    links = deflection.links(machine, where)
    assert ([where.z[at["pinion"]], where.z[at["wheel"]]], [0, 1]) in links
    assert ([where.z[at["wheel"]]] * 2, [1, 2]) in links


def test_a_rotor_of_some_length_is_straight_between_its_ends():
    ends = jr.Rotor(2.0, 0.012, 0.008, ends=(0.03, 0.02))
    machine = jr.Machine.in_line(
        {"a": jr.Node(), "s": jr.FiniteElementShaft(0.4, 0.02, elements=1), "d": ends}
    )
    where = deflection.places(machine)
    amplitudes = np.zeros((2, 6), complex)
    amplitudes[1, 0], amplitudes[1, 4] = 1.0, 2.0  # it moves and tilts
    (axis,) = deflection.axes_of(machine, where, amplitudes)
    assert axis.z[-1] == pytest.approx(0.4) and axis.amplitudes[-1, 0] == pytest.approx(1.0)
    assert axis.z[-2] == pytest.approx(0.37) and axis.amplitudes[-2, 0] == pytest.approx(0.94)


# Bode and polar


def oscillator(w, wn=100.0, damping=0.05, m=2.0):
    return 1 / (m * (wn**2 - w**2 + 2j * damping * wn * w))


@pytest.fixture
def unbalance():
    """x and y of a disc that whirls forward, and its tilt."""
    w = np.linspace(1.0, 200.0, 200)
    x = 1e-4 * w**2 * oscillator(w)
    values = np.stack([x, -1j * x, 3.0 * x], axis=1)
    return jr.linear.FrequencyResponse(
        jnp.asarray(w),
        jnp.asarray(values),
        ("d.x", "d.y", "d.psi"),
        (),
        "receptance",
        ("m", "m", "rad"),
    )


@pytest.fixture
def receptance():
    w = np.geomspace(1.0, 1000.0, 300)
    values = np.stack([oscillator(w), oscillator(w, 300.0)], axis=1)[:, None]
    return jr.linear.FrequencyResponse(
        jnp.asarray(w), jnp.asarray(values), ("d.x",), ("d.x", "d.psi"), "receptance", ("m",)
    )


def test_bode_of_unbalance(unbalance):
    size, tilt, angle = plot.bode(unbalance, critical=[100.0, 101.0, 150.0, 1000.0], title="mine")
    rpm = np.asarray(unbalance.frequencies) * 30 / np.pi
    for k, name in enumerate(("d.x", "d.y")):
        x, y = drawn(size, name)
        np.testing.assert_allclose(x, rpm)
        np.testing.assert_allclose(y, 1e6 * np.abs(unbalance.values[:, k]))
    np.testing.assert_allclose(drawn(tilt, "d.psi")[1], 1e3 * np.abs(unbalance.values[:, 2]))
    assert size.get_ylabel() == "amplitude, µm" and tilt.get_ylabel() == "amplitude, mrad"
    assert angle.get_xlabel() == "speed, rpm" and "deg" in angle.get_ylabel()
    assert [second.get_xlabel() for second in size.child_axes] == ["speed, rad/s"]
    assert size.get_title(loc="left") == "mine"
    x_phase, y_phase = (np.asarray(line.get_ydata()) for line in angle.get_lines()[:2])
    np.testing.assert_allclose(np.exp(1j * np.deg2rad(x_phase)), np.exp(1j * unbalance.phase[:, 0]))
    np.testing.assert_allclose(x_phase - y_phase, 90.0)
    assert np.all(np.diff(x_phase) < 0) and x_phase[0] > -1 and x_phase[-1] > -180
    words = [text.get_text() for text in size.texts]
    assert words == ["954.9, 964.5 rpm", "1432 rpm"]  # what is beyond the axis is left out
    # above all data
    low, high = size.get_ylim()
    lowest = min(text.get_position()[1] for text in size.texts) - 0.06
    assert low + lowest * (high - low) > 1e6 * np.abs(unbalance.values[:, :2]).max()


def test_bode_of_a_frequency_response(receptance):
    force, moment, angle = plot.bode(receptance)
    assert force.get_ylabel() == "receptance, m/N" and moment.get_ylabel() == "receptance, m/(N·m)"
    assert angle.get_xlabel() == "frequency, Hz"
    assert force.get_yscale() == angle.get_xscale() == "log"
    x, y = drawn(moment, "d.x per d.psi")
    np.testing.assert_allclose(x, np.asarray(receptance.frequencies) / 2 / np.pi)
    np.testing.assert_allclose(y, np.abs(receptance.values[:, 0, 1]))
    looks = {(line.get_linestyle(), line.get_marker()) for line in angle.get_lines()}
    assert len(looks) == 2  # told apart without their colours
    assert all(tick % 45 == 0 for tick in angle.get_yticks())


@pytest.mark.parametrize(
    "kind, given, words",
    [
        ("mobility", "rad", "mobility, (rad/s)/N"),
        ("accelerance", "rad", "accelerance, (rad/s²)/N"),
        ("receptance", "rad", "receptance, rad/N"),
        ("receptance", "N*m", "amplitude, (N·m)/N"),
        ("mobility", "N", "amplitude of the rate, (N/s)/N"),
    ],
)
def test_units_of_a_response(receptance, kind, given, words):
    w, values = receptance.frequencies, receptance.values[:, :, :1]
    one = jr.linear.FrequencyResponse(w, values, ("a.b",), ("d.y",), kind, (given,))
    assert plot.bode(one)[0].get_ylabel() == words


def test_phase_without_jumps():
    """Over a whole turn; undamped, where half a turn has no sense; and where nothing moves."""
    w = np.linspace(0.0, 400.0, 801)
    both = oscillator(w) * oscillator(w, 200.0)
    found = np.rad2deg(phase(both))
    assert found[0] == 0 and found[-1] == pytest.approx(-360, abs=15) and np.all(np.diff(found) < 0)
    noise = 1e-19j * np.array([1, -1, 1, -1, 1, -1, 1])
    undamped = phase(np.array([1.0, 1, -1, -1, 1, -1, -1]) + noise)
    np.testing.assert_allclose(np.rad2deg(undamped), [0, 0, -180, -180, 0, -180, -180], atol=1e-9)
    assert np.isnan(phase(np.array([0.0, 1.0]))[0])


def test_polar(unbalance):
    first, second = plot.polar(unbalance)
    values = np.asarray(unbalance.values)
    line = first.get_lines()[0]
    lag, size = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
    np.testing.assert_allclose(size * np.exp(-1j * lag), 1e6 * values[:, 0], atol=1e-9)
    peak = int(np.argmax(np.abs(values[:, 0])))
    rpm = float(unbalance.frequencies[peak]) * 30 / np.pi
    words = f"d.x, peak {1e6 * abs(values[peak, 0]):.4g} µm at {rpm:.4g} rpm"
    assert line.get_label() == words
    assert "amplitude, µm" in first.get_title() and "amplitude, mrad" in second.get_title()
    assert first.get_yticklabels()[-1].get_text().endswith(" µm")
    first.figure.canvas.draw()
    for ax in (first, second):
        marks = [text for text in ax.texts if text.get_text()]
        assert f"{rpm:.4g} rpm" in [text.get_text() for text in marks] and len(marks) > 5
        boxes = [text.get_window_extent() for text in marks]
        for i, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[:i])


def test_speeds_to_mark_on_a_polar_plot(unbalance):
    (ax, _) = plot.polar(unbalance, mark=[95.0, 110.0])
    at = np.asarray(unbalance.values)[[94, 109], 0]
    dots = [line for line in ax.get_lines() if line.get_marker() == "o"]
    drawn_at = [
        complex(line.get_ydata()[0] * np.exp(-1j * line.get_xdata()[0])) for line in dots[::2]
    ]
    np.testing.assert_allclose(drawn_at, 1e6 * at, rtol=1e-9)
    assert {"907.2", "1050"} <= {text.get_text() for text in ax.texts}


def test_labels_make_room():
    assert rows([0.0, 0.1, 0.2, 0.9], [0.15, 0.15, 0.15, 0.3]) == [0, 1, 0, 0]
    found = nice_multiples(3.0, 97.0, 10)
    assert found[0] == 20 and set(found) == set(range(10, 100, 10))
