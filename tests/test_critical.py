"""Critical speeds over any range of scales, with stiffness that depends on the speed, with damping, by
range and by whirl. Oracles: springs by hand, SciPy's general solver, brentq on a rotor written out,
central differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

import jaxrotor as jr
from jaxrotor.linear.crossing import crossings
from jaxrotor.linear.pencil import whirling

NOTHING = jr.ElasticMatrix(np.zeros((12, 12)), np.zeros((12, 12)))
FLAT = {name: ("z", "psi", "theta") for name in ("soft", "stiff")}


def roots(M, G, K):
    squares, found = jax.jit(whirling)(*map(jnp.asarray, (M, G, K)))
    assert int(found.lost) == 0
    squares = np.asarray(squares)
    return np.sqrt(squares[np.isfinite(squares)])


def test_all_roots_of_a_pencil():
    """A random one with a rigid motion, gyroscopic terms that leave fewer roots than coordinates: SciPy's
    QZ."""
    rng = np.random.default_rng(0)
    X, g, r = rng.normal(size=(40, 40)), rng.normal(size=(40, 40)), rng.normal(size=(40, 2))
    M, G = X @ X.T / 40 + np.eye(40), 0.5 * (g - g.T)
    without = np.eye(40) - r @ np.linalg.pinv(r)
    K = without @ X @ np.diag(10.0 ** rng.uniform(0, 5, 40)) @ X.T @ without
    K = 0.5 * (K + K.T)
    squares = scipy.linalg.eigvals(K, M - 1j * G)
    real = np.abs(squares.imag) < 1e-6 * np.abs(squares)
    expected = np.sort(np.sqrt(squares.real[real & (squares.real > 1e-6)]))
    assert 10 < len(expected) < 38
    np.testing.assert_allclose(roots(M, G, K), expected, rtol=1e-9)


@pytest.mark.parametrize("stiff", [4e4, 4e12, 1e20, 1e30])
def test_no_scale_hides_another(stiff):
    """1 rad/s beside 200, 2e6, 1e10, 1e15 rad/s: springs that do not know of each other."""
    found = roots(np.eye(3), np.zeros((3, 3)), np.diag([1.0, 0.0, stiff]))
    np.testing.assert_allclose(found, [1.0, np.sqrt(stiff)], rtol=1e-14)


def test_a_negative_stiffness_is_no_root():
    found = roots(np.eye(3), np.zeros((3, 3)), np.diag([-5.0, 4.0, 9e8]))
    np.testing.assert_allclose(found, [2.0, 3e4], rtol=1e-12)


def two_discs(stiff, inertia=0.01):
    def support(k):
        return jr.LinearSupport([k, k, 0, 0, 0, 0])

    return jr.Machine.in_line(
        {
            "soft": jr.Rotor(1.0, 0.01, 0.006),
            "between": NOTHING,
            "stiff": jr.Rotor(1.0, inertia, 0.006),
        },
        attachments={"s1": (support(1.0), "soft"), "s2": (support(stiff), "stiff")},
        fixed=FLAT,
    )


def test_a_machine_of_wide_scales():
    """Critical speeds, natural frequencies and modes at 1 and 1e10 rad/s, and the map over 1e20 N/m."""
    machine = two_discs(1e20)
    expected = [1.0, 1.0, 1e10, 1e10]
    np.testing.assert_allclose(jr.critical_speeds(machine), expected, rtol=1e-12)
    model = jr.linearize(machine, 0.0, at="undeformed")
    np.testing.assert_allclose(model.natural_frequencies[:4], expected, rtol=1e-9)
    found = jr.modes(model)
    np.testing.assert_allclose([m.frequency for m in found], expected, rtol=1e-9)
    # at rest the planes tell coincident modes apart, not rounding
    assert [m.name for m in found] == [f"{k} lateral {c}" for k in (1, 2) for c in "xy"]
    names = [m.name for m in jr.critical_modes(machine, speeds=(0.0, 10.0))]
    assert sorted(names) == ["1 backward", "1 forward"]
    np.testing.assert_allclose(
        jr.critical_speeds(machine, whirl="forward"), [1.0, 1e10], rtol=1e-12
    )
    over = jr.linear.critical_speed_map(machine, [4.0, 1e20], supports=("s2",), count=2)
    np.testing.assert_allclose(over.speeds, [[1.0, 2.0], [1.0, 1e10]], rtol=1e-12)


@pytest.mark.parametrize("mass", [1e-3, 1e-9])
def test_a_hub_of_hardly_any_mass(mass):
    """Two masses on two springs, along each axis, and a tilting disc: by hand from det(K - w² M)."""
    m, k = 2.5, 1e5
    machine = jr.Machine.in_line(
        {
            "disc": jr.Rotor(m, 0.01, 0.006),
            "stub": jr.Coupling([k] * 3 + [1e3] * 3),
            "hub": jr.Rotor(mass, 1e-3 * mass, 6e-4 * mass),
        },
        attachments={"s": (jr.LinearSupport([k] * 3 + [200.0] * 2 + [0.0]), "disc")},
    )
    # (2k - m w²)(k - mu w²) = k², in the form that keeps the low root
    b, c = 2 * k / m + k / mass * 1.0, k**2 / (m * mass)
    low = 2 * c / (b + np.sqrt(b * b - 4 * c))
    straight = np.sqrt([low, c / low])
    found = np.asarray(jr.critical_speeds(machine))
    assert len(found) == 9 and np.all(np.sort(found) == found)
    for w in straight:
        assert np.sum(np.abs(found / w - 1) < 1e-8) == 3  # along x, y and z


def test_a_very_short_section_hides_nothing():
    """A pair of criticals that coincide but for a hair stays a pair when a section of 0.1 mm is put in the
    middle: as without it, less what 0.1 mm of 2 m can do."""
    steel = jr.Material(2.1e11, 8.1e10, 7850.0)

    def machine(length):
        return jr.Machine.in_line(
            {
                "a": jr.Node(),
                "s1": jr.FiniteElementShaft(1.0, 0.01, material=steel, elements=1),
                "n": jr.Node(),
                "s2": jr.FiniteElementShaft(length, 0.01, material=steel, elements=1),
                "disc": jr.Rotor(20.0, 0.1, 0.06),
                "s3": jr.FiniteElementShaft(1.0, 0.01, material=steel, elements=1),
                "b": jr.Node(),
            },
            fixed={"a": ("x", "y", "z"), "b": ("x", "y")},
        )

    plain, short = (
        np.asarray(jr.critical_speeds(machine(x), speeds=(1, 50))) for x in (0.01, 1e-4)
    )
    assert len(plain) == len(short) == 2
    np.testing.assert_allclose(short, plain, rtol=0.01)
    forward = [m.name for m in jr.critical_modes(machine(1e-4), speeds=(1, 50))]
    assert forward == ["1 backward", "1 forward"]


def pedestal(mass, held=("z", "psi", "theta", "phi")):
    """A disc on an oil film's 1e6 N/m, on a pedestal of `mass`, on 3e6 N/m."""
    film = np.kron([[1.0, -1.0], [-1.0, 1.0]], np.diag([1e6, 1e6, 0, 0, 0, 0]))
    return jr.Machine(
        {
            "disc": jr.Rotor(10.0, 0.1, 0.06),
            "film": jr.ElasticMatrix(film, np.zeros((12, 12))),
            "pedestal": jr.Node(),
            "mass": jr.AddedInertia(mass),
            "base": jr.LinearSupport([3e6, 3e6, 0, 0, 0, 0]),
        },
        {"film": ("disc", "pedestal"), "mass": "pedestal", "base": "pedestal"},
        fixed={"pedestal": held, "disc": ("z", "psi", "theta")},
    )


def test_a_pedestal_without_mass():
    """1e-12 kg are as good as springs in a row; none at all is refused, at the start and later."""
    low, high = np.sqrt(1e6 * 3 / 4 / 10), np.sqrt(4e6 / 1e-12)
    machine = pedestal(1e-12)
    np.testing.assert_allclose(jr.critical_speeds(machine), [low, low, high, high], rtol=1e-9)
    model = jr.linearize(machine, 0.0, at="undeformed")
    np.testing.assert_allclose(model.natural_frequencies[:2], low, rtol=1e-6)
    for lacking in (lambda: pedestal(0.0), lambda: machine.set({"mass.mass": 0.0})):
        with pytest.raises(
            jr.InputError, match="`pedestal`: has no inertia along x, y, but moves there"
        ):
            lacking()
    with pytest.raises(jr.InputError, match="no inertia along psi, theta, phi, but"):
        pedestal(1.0, held=("z",))


SPEEDS = np.array([0.0, 90.0, 110.0, 130.0, 150.0, 300.0])
STIFFNESS = np.array([100.0, 100.0, 105.0, 133.0, 140.0, 140.0]) ** 2


def on_a_table(stiffness):
    rows = jnp.stack([stiffness, stiffness, *[jnp.zeros(6)] * 4], axis=1)
    return jr.Machine.in_line(
        {"d": jr.Rotor(1.0, 0.01, 0.006)},
        attachments={"s": (jr.SpeedDependentSupport(SPEEDS, rows, jnp.zeros((6, 6))), "d")},
        fixed={"d": ("z", "psi", "theta")},
    )


def test_a_mode_may_meet_the_line_more_than_once():
    """Stiffness over speed, met three times by the line of the speed: brentq on SciPy's PCHIP; and
    derivatives by the table against those of the meeting, dw = dk/(2 w)/(1 - k'/(2 w))."""
    curve = PchipInterpolator(SPEEDS, STIFFNESS)
    expected = [
        brentq(lambda w: np.sqrt(curve(w)) - w, *ends, xtol=1e-12)
        for ends in ((95.0, 110.0), (112.0, 129.0), (131.0, 150.0))
    ]
    machine = on_a_table(jnp.asarray(STIFFNESS))
    found = np.asarray(jr.critical_speeds(machine))
    np.testing.assert_allclose(found, np.repeat(expected, 2), rtol=1e-9)
    np.testing.assert_allclose(jr.critical_speeds(machine, whirl="forward"), expected, rtol=1e-9)
    within = jr.critical_speeds(machine, speeds=(110.0, 130.0))
    np.testing.assert_allclose(within, [expected[1]] * 2, rtol=1e-9)
    damped = jr.critical_speeds(machine, damped=True, whirl="backward")
    np.testing.assert_allclose(damped, expected, rtol=1e-9)
    slope = jax.grad(
        lambda s: jr.critical_speeds(on_a_table(s * STIFFNESS), speeds=(110.0, 130.0))[0]
    )
    w, rate = expected[1], curve.derivative()(expected[1])
    by_hand = curve(w) / (2 * w) / (1 - rate / (2 * w))
    assert float(slope(1.0)) == pytest.approx(by_hand, rel=1e-7)
    # under jit there is no search: not a number rather than a wrong one
    assert np.all(
        np.isnan(jax.jit(lambda s: jr.critical_speeds(on_a_table(s), count=2))(STIFFNESS))
    )


def test_curves_that_touch_the_line_and_turn_back():
    """Two meetings within one cell of the first look, and none where the curve stays below by a hair."""

    def curves(w):
        return np.array([w + 1e-3 * (w - 5.0) * (w - 5.2), 0.5 * w, np.inf])

    found = crossings(curves, 0.1, 100.0)
    assert [k for k, _ in found] == [0, 0]
    np.testing.assert_allclose([w for _, w in found], [5.0, 5.2], rtol=1e-8)


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(order=0), "order must be positive and finite, but is 0"),
        (dict(speeds=(3.0, 1.0)), "speeds must be 2 rising numbers in rad/s"),
        (dict(whirl="sideways"), "whirl must be 'forward' or 'backward', but is 'sideways'"),
        (dict(count=0), "count must be a whole number, 1 at least, but is 0"),
    ],
)
def test_wrong_questions(options, words):
    with pytest.raises(jr.InputError, match=words):
        jr.critical_speeds(two_discs(1.0), **options)


def test_campbell_at_negative_speeds_and_names_of_nearly_straight_whirl():
    """A disc whose planes differ hardly in tilting, by much along x and y: turned backwards, the diagram
    is the mirror image; straight orbits are mixed in `modes` and in `campbell`, whatever the sign of their
    whirl."""
    stiffness = [1e4, 9e4, 1e5, 400.0, 400.0, 0.0]
    machine = jr.Machine.in_line(
        {"d": jr.Rotor(1.0, 0.01, 0.006)}, attachments={"s": (jr.LinearSupport(stiffness), "d")}
    )
    speeds = np.array([-400.0, -300.0, -150.0, 0.0])
    back = jr.campbell(machine, speeds, at="undeformed")
    ahead = jr.campbell(machine, -speeds[::-1], at="undeformed")
    assert (
        back.names
        == ahead.names
        == (
            "1 backward",
            "1 mixed",
            "2 mixed",
            "axial 1",
            "1 forward",
        )
    )
    np.testing.assert_allclose(back.frequencies, ahead.frequencies[::-1], rtol=1e-9)
    np.testing.assert_allclose(back.whirl[:3], ahead.whirl[1:][::-1], atol=1e-6)
    met, expected = back.crossings(), ahead.crossings()
    assert set(met) == set(expected) == {"1 mixed", "1 backward", "2 mixed", "axial 1"}
    for name, where in met.items():
        np.testing.assert_allclose(where, -np.array(expected[name][::-1]), rtol=1e-6)
    assert met["2 mixed"] == pytest.approx([-300.0])  # on a speed of the list itself: sqrt(9e4)
    assert [m.name for m in jr.modes(jr.linearize(machine, -400.0, "undeformed"))] == list(
        back.names
    )


def test_stiffness_of_one_speed():
    """A disc on a support whose stiffness grows with the speed: with the stiffness at 150 rad/s it is a plain
    oscillator, sqrt(k(150)/m); the search over speed finds where sqrt(k(w)/m) is w itself."""
    speeds, k = np.array([0.0, 200.0]), np.array([1e4, 5e4])
    table = np.zeros((2, 6))
    table[:, :2] = k[:, None]
    support = jr.SpeedDependentSupport(speeds, table, np.zeros((2, 6)))
    machine = jr.Machine(
        {"disc": jr.Rotor(2.0, 0.02, 0.012), "support": support},
        {"support": "disc"},
        fixed={"disc": ["z", "psi", "theta"]},
        prescribed={"disc": {"phi": jr.ConstantSpeed(100.0)}},
    )
    found = jr.critical_speeds(machine, stiffness_at=150.0)
    np.testing.assert_allclose(found, np.sqrt(4e4 / 2.0), rtol=1e-9)
    modes = jr.critical_modes(machine, stiffness_at=150.0, count=1)
    np.testing.assert_allclose(modes[0].frequency, np.sqrt(2e4), rtol=1e-9)
    b = 4e4 / 200.0 / 2.0  # w² = 5000 + b w
    whole = jr.critical_speeds(machine, speeds=(1.0, 190.0))
    np.testing.assert_allclose(whole, 0.5 * (b + np.sqrt(b**2 + 4 * 5e3)), rtol=1e-6)
    slope = jax.grad(
        lambda m: jr.critical_speeds(m, stiffness_at=150.0, count=1)[0], allow_int=True
    )
    by_mass = float(slope(machine)["disc"].mass)
    np.testing.assert_allclose(by_mass, -0.5 * np.sqrt(2e4) / 2.0, rtol=1e-8)
    with pytest.raises(jr.InputError, match="take one of both out"):
        jr.critical_speeds(machine, damped=True, stiffness_at=150.0)
