"""Coefficients of bearings and seals as they come: inertia, tables over speed and whirl frequency, files;
unbalance at any node, moments about any axis, damping by modes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.core.kinematics import COORDINATES, from_turning
from jaxrotor.interop import read_coefficients
from jaxrotor.linear.linearise import models_at, models_over_speed, rates_over_speed
from jaxrotor.linear.modal_damping import _of_symmetric
from jaxrotor.machine.field import vector_field
from jaxrotor.machine.system import assemble

M = np.diag([3.0, 2.0, 1.0, 0.01, 0.02, 0.0])
SKEW = M + 0.4 * (np.eye(6, k=1) - np.eye(6, k=-1)) * (np.arange(6) < 1)[:, None]
SKEW[1, 0] = -0.4
K = np.diag([1e6, 2e6, 1e6, 1e3, 1e3, 0.0])
C = np.diag([100.0, 50.0, 10.0, 1.0, 1.0, 0.0])
SPEEDS = [0.0, 500.0, 1000.0]
NOTHING = np.zeros((6, 6))


def rotor(seal_mass, table_mass, amount=0.0):
    """Two rotors, a node of the shaft between them with a seal and an unbalance; a seal on a rotor."""
    shaft = jr.FiniteElementShaft(0.4, 0.05, elements=2)
    elements = dict(
        a=jr.Rotor(10.0, 0.1, 0.06),
        b=jr.Node(),
        c=jr.Rotor(5.0, 0.05, 0.03),
        left=shaft,
        right=shaft,
        k1=jr.LinearSupport([1e7, 1e7, 1e6, 1e3, 1e3, 0], [1e2] * 5 + [0]),
        k2=jr.LinearSupport([1e7, 1e7, 0, 1e3, 1e3, 0], [1e2] * 5 + [0]),
        seal=jr.LinearSupport(K, C, mass=seal_mass),
        table=jr.SpeedDependentSupport(SPEEDS, [K, 2 * K, K], [C, C, C], table_mass),
        unbalance=jr.elements.PointUnbalance(amount, 0.3),
        moment=jr.elements.Moment(jr.Step(0.001, 0.0, 500.0), (1.0, 0.5, 0.01)),
    )
    places = dict(left=("a", "b"), right=("b", "c"), k1="a", k2="c", seal="b", table="a")
    return jr.Machine(elements, places | dict(unbalance="left.1", moment="right.1"))


TABLE = [M, SKEW, 2 * SKEW]


@pytest.fixture(scope="module")
def machine():
    return rotor(M, TABLE)


@pytest.fixture(scope="module")
def bare():
    return rotor(NOTHING, [NOTHING] * 3)


def at_station(model, station):
    return [model.coordinates.index((station, c)) for c in COORDINATES[:5]]


def test_inertia_stands_in_the_mass_matrix(machine, bare):
    """At a node that shafts carry, and at a rotor with equations of its own; a skew part too."""
    for speed, table in ((0.0, M), (500.0, SKEW)):
        models = [models_at(m, "undeformed")(speed) for m in (machine, bare)]
        more = np.asarray(models[0].M) - np.asarray(models[1].M)
        for station, given in (("b", M), ("a", table)):
            rows = np.ix_(*[at_station(models[0], station)] * 2)
            np.testing.assert_allclose(more[rows], given[:5, :5], atol=1e-12)
            more[rows] = 0.0
        assert np.abs(more).max() < 1e-12


def test_tables_with_inertia_are_taken_apart(machine):
    """Matrices over speed, from few speeds, against each speed by itself; turning back too."""
    speeds = np.linspace(-100.0, 900.0, 11)
    apart, each = models_over_speed(machine, speeds, "undeformed"), models_at(machine, "undeformed")
    rates = rates_over_speed(machine, speeds, "undeformed")
    for speed in speeds[::3]:
        one, two = apart(speed), each(speed)
        for name in ("M", "C", "G", "K", "A", "B"):
            a, b = np.asarray(getattr(one, name)), np.asarray(getattr(two, name))
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-12 * np.abs(b).max())
        np.testing.assert_allclose(rates(speed)[0], two.A, atol=1e-12 * np.abs(two.A).max())


def test_books_close_with_inertia_of_all_kinds():
    """Kinetic energy of the constant one and of an unbalance at an inner node are written apart from the
    forces; the table's is a load."""
    machine = rotor(M, TABLE, amount=3e-4)
    machine = jr.Machine(
        machine.elements() | {"drive": jr.Torque(30.0)}, machine.connections() | {"drive": "a"}
    )
    step = 1.25e-5
    audit = jr.energy_audit(machine, 0.02, 2000.0, step=step)
    assert float(audit.relative) < 1e-6
    # what the table's inertia and the unbalance exchange is well above that
    for part in ("table.mass", "unbalance.amount"):
        still = machine.set({part: jnp.zeros_like(machine.get(part))})
        moved = jr.energy_audit(still, 0.02, 2000.0, step=step)
        assert float(jnp.max(jnp.abs(moved.kinetic - audit.kinetic)) / audit.exchanged) > 1e-5


def test_slopes_by_inertia(machine):
    """Of the rates of a moving machine by what stands in the mass tables: forward, reverse, central
    differences."""
    y = jnp.asarray(np.random.default_rng(1).uniform(-1e-4, 1e-4, 60)).at[59].set(400.0)
    weights = np.random.default_rng(2).uniform(-1, 1, 60)

    def rates(x):
        moved = machine.set(
            {"seal.mass": M * (1 + x[0]), "table.mass": np.array(TABLE) * (1 + x[1])}
        )
        return weights @ vector_field(jnp.zeros(()), y, assemble(moved))

    both = jax.jit(lambda x: (rates(x), jax.jacfwd(rates)(x), jax.grad(rates)(x)))
    h = 1e-4
    _, forward, reverse = both(jnp.zeros(2))
    central = [(both(h * e)[0] - both(-h * e)[0]) / (2 * h) for e in np.eye(2)]
    assert np.all(np.abs(np.asarray(central)) > 1e-3)
    np.testing.assert_allclose(forward, central, rtol=1e-6)
    np.testing.assert_allclose(forward, reverse, rtol=1e-9)


def test_point_unbalance_on_a_rotor_is_its_own():
    """Accelerations of a rotor with an eccentricity, which has mass and inertia of the moved centre besides,
    of the order of the eccentricity squared."""
    e, mass = 1e-6, 10.0
    whole = jr.Rotor(mass, 0.1, 0.06, jr.Unbalance(e, 0.4))
    support = jr.LinearSupport(K, C)
    own = jr.Machine({"r": whole, "s": support}, {"s": "r"})
    parts = {
        "r": jr.Rotor(mass, 0.1, 0.06),
        "s": support,
        "u": jr.elements.PointUnbalance(mass * e, 0.4),
    }
    added = jr.Machine(parts, {"s": "r", "u": "r"})
    y = jnp.array([1e-4, -2e-4, 0.0, 0.0, 0.0, 1.1, 0.3, 0.2, 0.0, 0.0, 0.0, 150.0])
    found = [jax.jit(vector_field)(jnp.zeros(()), y, assemble(m)) for m in (own, added)]
    balanced = jax.jit(vector_field)(jnp.zeros(()), y, assemble(added, nominal=True))
    effect = np.asarray(found[0] - balanced)
    assert np.all(np.abs(effect[[6, 7, 11]]) > 1e-5)
    np.testing.assert_allclose(found[1] - balanced, effect, rtol=1e-4, atol=1e-9)


def test_a_moment_does_the_work_of_its_angular_velocity():
    """Virtual work at large tilts: generalized forces times rates against the moment times the angular
    velocity, made of turns about x, the tilted y and the disc's axis."""
    rng = np.random.default_rng(0)
    for _ in range(5):
        q, v, moment = rng.uniform(-1, 1, 6), rng.uniform(-1, 1, 6), rng.uniform(-1, 1, 3)
        turned, rates = from_turning(jnp.asarray(q)[:, None], jnp.asarray(v)[:, None])
        psi, theta, _ = np.asarray(turned[3:, 0])
        dpsi, dtheta, dphi = np.asarray(rates[3:, 0])
        about_y = np.array([0.0, np.cos(psi), np.sin(psi)])
        axis = np.array([np.sin(theta), -np.sin(psi) * np.cos(theta), np.cos(psi) * np.cos(theta)])
        velocity = dpsi * np.array([1.0, 0, 0]) + dtheta * about_y + dphi * axis
        motion = (jnp.asarray(q), jnp.asarray(v))
        (force,) = jr.elements.Moment(1.0, moment).forces(jnp.zeros(()), (motion,), None)
        assert float(force @ v) == pytest.approx(moment @ velocity, rel=1e-12)


# --- over the whirl frequency


def mass_on(support, **more):
    """A mass that moves along x and y alone, turning at a given speed."""
    held = {"r": ("z", "psi", "theta")}
    parts = {"r": jr.Rotor(10.0, 0.1, 0.06, jr.Unbalance(1e-5, 0.0)), "s": support}
    spin = {"r": {"phi": jr.ConstantSpeed(100.0)}} if more.get("driven", True) else None
    return jr.Machine(parts, {"s": "r"}, fixed=held, prescribed=spin)


K0, K1, C0 = 1e6, 300.0, 40.0  # stiffness K0 + K1 times the frequency


@pytest.fixture(scope="module")
def whirling():
    """Stiffness in a straight line over the frequency, along y four times that along x."""
    far = 2000.0
    rows = [np.diag([k, 4 * k, 0, 0, 0, 0]) for k in (K0, K0 + K1 * far)]
    damping = np.diag([C0, C0, 0, 0, 0, 0.0])
    support = jr.elements.WhirlDependentSupport(
        [0.0, 1000.0], [0.0, far], [rows, rows], [[damping] * 2] * 2
    )
    return mass_on(support)


def matched(k0, k1, m, c):
    """Of `m s^2 + c s + k0 + k1 Im s = 0`."""
    w = 300.0
    for _ in range(200):
        w = np.sqrt((k0 + k1 * w) / m - (c / (2 * m)) ** 2)
    return -c / (2 * m) + 1j * w


def test_each_mode_has_the_coefficients_of_its_own_frequency(whirling):
    found = jr.linear.matched_modes(whirling, 200.0, 2)
    expected = [matched(f * K0, f * K1, 10.0, C0) for f in (1, 4)]
    np.testing.assert_allclose([m.eigenvalue for m in found], expected, rtol=1e-9)
    diagram = jr.campbell(whirling, [0.0, 100.0, 200.0], 2, at="undeformed")
    np.testing.assert_allclose(diagram.eigenvalues, np.tile(expected, (3, 1)), rtol=1e-9)


def test_slopes_of_a_matched_eigenvalue(whirling):
    """By the stiffness at both frequencies: forward, reverse, and the implicit function theorem by hand."""
    near = matched(K0, K1, 10.0, C0)

    def root(scale):
        table = whirling.get("s.stiffness")
        found = jr.linear.matched_eigenvalue(
            whirling.set({"s.stiffness": table * scale}), 200.0, near
        )
        return jnp.stack([found.real, found.imag])

    @jax.jit
    def both(scale):
        return *jax.jvp(root, (scale,), (1.0,)), jax.jacrev(root)(scale)

    value, forward, reverse = both(1.0)
    np.testing.assert_allclose(value, [near.real, near.imag], rtol=1e-9)
    np.testing.assert_allclose(reverse, forward, rtol=1e-9, atol=1e-9)
    # 2 m w dw = (k0 + k1 w) ds + k1 dw
    w = near.imag
    assert float(forward[1]) == pytest.approx((K0 + K1 * w) / (20.0 * w - K1), rel=1e-8)
    assert abs(float(forward[0])) < 1e-8


def test_forced_vibration_takes_the_frequency_of_the_force(whirling):
    """Against the closed form of one mass; unbalance at the speed's own."""
    w = np.array([100.0, 350.0, 1500.0])
    found = jr.frequency_response(whirling, "r.x", "r.x", w, speed=50.0, at="undeformed")
    expected = 1 / (K0 + K1 * w - 10.0 * w**2 + 1j * w * C0)
    np.testing.assert_allclose(found.values[:, 0, 0], expected, rtol=1e-9)

    def scaled(scale):
        moved = whirling.set({"s.stiffness": whirling.get("s.stiffness") * scale})
        return jr.frequency_response(moved, "r.x", "r.x", w, speed=50.0, at="undeformed").values[
            :, 0, 0
        ]

    slope = jax.jvp(scaled, (1.0,), (1.0,))[1]
    np.testing.assert_allclose(slope, -(K0 + K1 * w) * expected**2, rtol=1e-9)
    unbalance = jr.unbalance_response(whirling, "r.x", w, at="undeformed")
    np.testing.assert_allclose(unbalance.values[:, 0], 1e-4 * w**2 * expected, rtol=1e-8)


def test_what_asks_for_eigenvalues_of_one_matrix_refuses(whirling):
    calls = (
        lambda: jr.stability_threshold(whirling, 10.0, 100.0),
        lambda: jr.critical_speeds(whirling, order=2.0),
        lambda: jr.standards.level_two(whirling, 100.0, at="undeformed"),
        lambda: jr.linear.order_response(whirling, "r.x", [100.0], (2.0,)),
    )
    for call in calls:
        with pytest.raises(
            jr.InputError, match="`s`: .* each has its own|`s`: .* mode has its own"
        ):
            call()


def test_constants_are_fitted_over_the_frequency():
    """K - w^2 M + i w C is met exactly where it is one; at a given frequency the table's own."""
    w = np.linspace(0.0, 800.0, 7)
    stiffness = K - w[:, None, None] ** 2 * M
    support = jr.elements.WhirlDependentSupport(
        [0.0, 500.0], w, [stiffness, 2 * stiffness], [[C] * 7] * 2
    )
    fitted = support.fitted()
    np.testing.assert_allclose(fitted.stiffness, [K, 2 * K], rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(fitted.mass, [M, 2 * M], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(fitted.damping, [C, C], rtol=1e-12)
    np.testing.assert_allclose(support.at(w[3]).stiffness[0], stiffness[3], rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: jr.LinearSupport(K, C, mass=SKEW), "mass must be symmetric"),
        (lambda: jr.LinearSupport(K, C, mass=-M), "mass must not be negative"),
        (
            lambda: jr.SpeedDependentSupport([0.0, 1.0], [K, K], [C, C], [M + np.eye(6)] * 2),
            "mass must be zero for phi",
        ),
        (
            lambda: jr.elements.WhirlDependentSupport(
                [0.0, 1.0], [2.0, 1.0], [[K] * 2] * 2, [[C] * 2] * 2
            ),
            "frequencies must increase",
        ),
        (
            lambda: jr.elements.DampingMatrix(np.diag([1.0] * 5 + [-1.0])),
            "damping must not feed energy",
        ),
        (lambda: jr.elements.Moment(1.0, (0.0, 0.0, 0.0)), "direction must point somewhere"),
    ],
)
def test_impossible_coefficients_are_refused(make, words):
    parts = {"r": jr.Rotor(10.0, 0.1, 0.06), "k": jr.LinearSupport(K, C), "s": make()}
    with pytest.raises(jr.InputError, match=f"`s`: {words}"):
        jr.Machine(parts, {"k": "r", "s": "r"})


# --- damping by modes


def test_ratios_of_modes_over_frequency():
    support = jr.LinearSupport([1e6, 4e6, 1e6, 1e3, 1e3, 0])
    machine = jr.Machine({"r": jr.Rotor(10.0, 0.1, 0.06), "s": support}, {"s": "r"})
    ratios, frequencies = [0.01, 0.03], [20.0, 200.0]
    damped = jr.linear.with_modal_damping(machine, ratios, frequencies)
    found = jr.linear.modes(jr.linearize(damped, at="undeformed"))
    assert [m.kind for m in found].count("lateral") == 4
    for mode in found:
        expected = np.interp(abs(mode.eigenvalue) / (2 * np.pi), frequencies, ratios)
        expected = expected if mode.kind == "lateral" else 0.0
        assert mode.damping_ratio == pytest.approx(expected, rel=1e-6, abs=1e-9)
    for arguments, words in (
        (([0.1, 0.2],), "frequencies are missing"),
        (([0.1, 0.2], [1.0]), "must be as many"),
        ((0.1, None, "sideways"), "kinds must be"),
    ):
        with pytest.raises(jr.InputError, match=words):
            jr.linear.with_modal_damping(machine, *arguments)
    with pytest.raises(jr.InputError, match="has it already"):
        jr.linear.with_modal_damping(damped, 0.1)


def test_slopes_of_a_matrix_with_coincident_modes():
    """f(S) = S^2 by modes, whose slope is dS S + S dS."""
    S, D = np.diag([1.0, 1.0, 4.0]), np.array([[1.0, 2, 3], [2, 5, 6], [3, 6, 9]])
    value, slope = jax.jvp(lambda S: _of_symmetric(S, jnp.square), (jnp.array(S),), (jnp.array(D),))
    np.testing.assert_allclose(value, S @ S, atol=1e-12)
    np.testing.assert_allclose(slope, D @ S + S @ D, atol=1e-12)
    reverse = jax.vjp(lambda S: _of_symmetric(S, jnp.square), jnp.array(S))[1](jnp.array(D))[0]
    np.testing.assert_allclose(reverse, D @ S + S @ D, atol=1e-12)


# --- files


def test_tables_from_files(tmp_path):
    """Units in brackets, in a line of their own, or given; a decimal comma; rows in any order."""
    file = tmp_path / "seal.csv"
    file.write_text("speed [rpm],kxx [N/mm],cxx [N s/m],mxy [kg]\n3000,1e4,10,1\n1000,2e4,20,2\n")
    found = read_coefficients(file)
    np.testing.assert_allclose(found.speeds, np.array([1000, 3000]) * np.pi / 30)
    np.testing.assert_allclose(found.stiffness[:, 0, 0], [2e7, 1e7])
    np.testing.assert_allclose(found.mass[:, 0, 1], [2.0, 1.0])
    file.write_text("speed;kxx;kxtheta;cxx\nrpm;N/mm;N/rad;N*s/m\n3000;1,5;2;3\n6000;2,5;2;3\n")
    found = read_coefficients(file)
    np.testing.assert_allclose(found.stiffness[:, 0, [0, 4]], [[1500, 2], [2500, 2]])
    assert found.mass is None
    file.write_text("kxx\tcxx\n10\t5\n")
    found = read_coefficients(file, {"k": "lbf/in", "c": "lbf*s/in"})
    assert float(found.stiffness[0, 0]) == pytest.approx(10 * 175.126835)
    rows = [f"{s},{w},{s + w},1" for w in (20, 10) for s in (100, 200)]
    file.write_text("\n".join(["speed [rad/s],whirl [Hz],kyy [N/m],cxx [N*s/m]", *rows]))
    found = read_coefficients(file)
    np.testing.assert_allclose(found.frequencies, 2 * np.pi * np.array([10, 20]))
    np.testing.assert_allclose(found.stiffness[:, :, 1, 1], [[110, 120], [210, 220]])


def test_an_excel_sheet(tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("openpyxl")
    file = tmp_path / "seal.xlsx"
    pandas.DataFrame(
        {"speed [rpm]": [1000, 2000], "kxx [N/m]": [1e6, 2e6], "cxx [N*s/m]": [1, 2]}
    ).to_excel(file, index=False)
    np.testing.assert_allclose(read_coefficients(file).stiffness[:, 0, 0], [1e6, 2e6])
    file.write_text("no sheet")
    with pytest.raises(jr.InputError, match="cannot be read as an Excel sheet"):
        read_coefficients(file)


@pytest.mark.parametrize(
    "text, words",
    [
        ("speed [rpm],kxx,cxx [N*s/m]\n1,1,2\n", "column `kxx` has no unit: write `kxx .N/m.`"),
        ("speed [rpm],kxx [N],cxx [N*s/m]\n1,1,2\n", "must be in N/m or alike, but is in N"),
        ("speed [Hz],kxx [N/m],cxx [N*s/m]\n1,1,2\n", "must be in rad/s or alike, but is in Hz"),
        ("speed [rpm],kxx [N/m],foo\n1,1,2\n", "column `foo` is not known"),
        ("speed [rpm],kxx [N/m],cxx [N*s/m]\n1,1,2\n1,1,2\n", "in several rows"),
        ("speed [rpm],kxx [N/m],cxx [N*s/m]\n1,a,2\n2,1,2\n", "line 2: is not a number"),
        ("speed [rpm],kxx [N/m],cxx [N*s/m]\n1,,2\n2,1,2\n", "row 1: is not a finite number"),
        ("speed [rpm],cxx [N*s/m]\n1,2\n", "no column of stiffness"),
        ("speed [rpm],kxx [N/m],cxx [N*s/m]\n", "holds no row of numbers"),
        ("kxx [N/m],cxx [N*s/m]\n1,2\n1,2\n", "2 rows, but no column of speed"),
        (
            "speed [rpm],frequency [Hz],kxx [N/m],cxx [N*s/m]\n1,1,1,2\n1,2,3,4\n2,1,1,2\n",
            "no row for 0.20944 rad/s and a whirl of 12.5664 rad/s",
        ),
    ],
)
def test_wrong_files_are_refused(tmp_path, text, words):
    file = tmp_path / "seal.csv"
    file.write_text(text)
    with pytest.raises(jr.InputError, match=words):
        read_coefficients(file)


STUDY = """
[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "10 kg"
polar_inertia = "0.1 kg*m^2"
transverse_inertia = "0.06 kg*m^2"
[[machine.attachments]]
name = "seal"
kind = "Coefficients"
file = "seal.csv"
units = { m = "kg" }
at = "disc"
[simulation]
t_end = "0.1 s"
sample_rate = "1 kHz"
"""


def test_in_a_study(tmp_path):
    (tmp_path / "seal.csv").write_text(
        "speed [rpm],frequency [Hz],kxx [N/m],cxx [N*s/m],mxx\n1,1,1,2,3\n1,2,1,2,3\n2,1,1,2,3\n2,2,1,2,3\n"
    )
    (tmp_path / "s.toml").write_text(STUDY)
    machine = jr.load(tmp_path / "s.toml").machine
    assert machine["seal"].mass.shape == (2, 2, 6, 6)
    text = machine.to_toml() + '[simulation]\nt_end = "0.1 s"\nsample_rate = "1 kHz"\n'
    (tmp_path / "back.toml").write_text(text)
    back = jr.load(tmp_path / "back.toml").machine
    np.testing.assert_allclose(back["seal"].mass, machine["seal"].mass)
    (tmp_path / "s.toml").write_text(STUDY.replace('"seal.csv"', '"sael.csv"'))
    with pytest.raises(
        jr.InputError, match='attachments "seal"`: `.*sael.csv`: there is no such file'
    ):
        jr.load(tmp_path / "s.toml")
