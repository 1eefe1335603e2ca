"""Couplings in machines: kinematics and virtual work, misalignments, clutches, states, study files."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import TIGHT, assert_derivatives_agree, at_instants, pull
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import jaxrotor as jr
from jaxrotor.machine.field import vector_field
from jaxrotor.machine.system import assemble

ASIDE = jr.Misalignment(2e-3, 0.5, 0.02, -0.4)
BORE = jr.Imperfection(1e-3, 0.7, 0.01, 1.1)
SPRINGS = [2e4, 2e4, 3e4, 50.0, 50.0, 300.0]
DAMPERS = [20.0, 20.0, 10.0, 0.05, 0.05, 0.2]


def full(seed):
    """A 6x6 without any symmetry."""
    return np.random.default_rng(seed).normal(size=(6, 6)) * 100.0


WITH_ALL = jr.Coupling(
    full(0),
    full(1),
    x=jr.elements.Progressive([1e3, 1e6], 3.0),
    psi=jr.elements.Maxwell(80.0, 2.0),
    phi=jr.elements.Parallel(
        [jr.elements.BoucWen(90.0, 0.1, 0.2), jr.elements.KelvinVoigt(5.0, 0.1)]
    ),
    misalignment=ASIDE,
    imperfection=BORE,
)


def random_motions(seed):
    rng = np.random.default_rng(seed)
    size = np.array([0.01, 0.01, 0.01, 0.1, 0.1, 1.0])
    return tuple(
        (jnp.asarray(size * rng.normal(size=6)), jnp.asarray(rng.normal(size=6))) for _ in "ab"
    )


def test_power_of_the_forces_is_stored_or_lost():
    """For any motion, with every kind of part: the energy is written apart from the forces."""
    state = jnp.array([0.02, 0.3])

    @jax.jit
    def books(coupling, motions, state):
        rates = coupling.rates(0.3, motions, None, state)
        still = tuple((v, jnp.zeros(6)) for _, v in motions)
        _, growth = jax.jvp(
            lambda m, s: coupling.energy(0.3, m, s), (motions, state), (still, rates)
        )
        power = sum(f @ v for f, (_, v) in zip(coupling.forces(0.3, motions, state), motions))
        return power, growth, coupling.power_lost(0.3, motions, state)

    for seed in range(4):
        power, growth, lost = books(WITH_ALL, random_motions(seed), state)
        assert abs(power) > 1.0
        np.testing.assert_allclose(-power, growth + lost, rtol=1e-11)


def test_signs_of_a_plain_coupling():
    """Each direction by itself pulls the left hub along; the torque is a shaft's."""
    coupling = jr.Coupling(SPRINGS, DAMPERS)
    for i in range(6):
        a = (jnp.zeros(6), jnp.zeros(6))
        b = (jnp.zeros(6).at[i].set(1e-3), jnp.zeros(6).at[i].set(0.2))
        want = np.zeros(6)
        want[i] = SPRINGS[i] * 1e-3 + DAMPERS[i] * 0.2
        np.testing.assert_allclose(pull(coupling, a, b), [want, -want], rtol=1e-13)
    np.testing.assert_allclose(coupling.torque(0.0, (a, b), None), want[5], rtol=1e-13)


def test_data_sheet_matrices_and_single_numbers_agree():
    motions = random_motions(1)
    one = jr.Coupling(SPRINGS, DAMPERS)
    other = jr.Coupling(np.diag(SPRINGS), np.diag(DAMPERS))
    np.testing.assert_allclose(pull(one, *motions), pull(other, *motions), rtol=1e-12, atol=1e-12)


# Misalignment and imperfection: a coupling between a drive at 50 rad/s and a rotor held in place.
W, KX, CX, M, E = 50.0, 2e4, 30.0, 2e-3, 1e-3


def held(**geometry):
    machine = jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(W), angle=0.2),
            "joint": jr.Coupling([KX, KX, 0, 0, 0, 0], [CX, CX, 0, 0, 0, 0], **geometry),
            "b": jr.Rotor(1.0, 0.01, 0.01),
        },
        fixed={"b": ("x", "y", "z", "psi", "theta", "phi")},
    )
    t = np.linspace(0.0, 0.2, 9)
    return at_instants(machine, np.zeros((9, 2, 6)), np.zeros((9, 2, 6)), t), 0.2 + W * t


def test_parallel_misalignment_presses_steadily():
    response, _ = held(misalignment=jr.Misalignment(M, 0.5))
    want = KX * M * np.array([np.cos(0.5), np.sin(0.5)])
    # the left hub is pulled to where the right one is, and its mounting holds it back
    np.testing.assert_allclose(response["end"].reaction[:, :2], np.tile(-want, (9, 1)), rtol=1e-12)
    np.testing.assert_allclose(response["b"].reaction[:, :2], np.tile(want, (9, 1)), rtol=1e-12)
    np.testing.assert_allclose(response["end"].reaction[:, 5], 0.0, atol=1e-12)


def test_an_eccentric_bore_turns_and_drags():
    """Once a turn, and what it takes to turn it: the damper's drag, and with a misalignment
    k m e sin as well, for V = k |m - e(phi)|²/2."""
    response, phi = held(misalignment=jr.Misalignment(M, 0.5), imperfection=jr.Imperfection(E, 0.7))
    e = E * np.stack([np.cos(phi + 0.7), np.sin(phi + 0.7)], axis=1)
    e_t = W * E * np.stack([-np.sin(phi + 0.7), np.cos(phi + 0.7)], axis=1)
    m = M * np.array([np.cos(0.5), np.sin(0.5)])
    want = KX * (m - e) - CX * e_t
    np.testing.assert_allclose(response["b"].reaction[:, :2], want, rtol=1e-11)
    torque = KX * M * E * np.sin(phi + 0.7 - 0.5) + CX * E**2 * W
    np.testing.assert_allclose(response["end"].reaction[:, 5], torque, rtol=1e-11)
    assert np.ptp(torque) > 0.05


def test_angular_misalignment_bends_and_a_tilted_bore_turns():
    joint = jr.Coupling([0, 0, 0, 40.0, 40.0, 0], misalignment=jr.Misalignment(0, 0, 0.02, 0.5))
    rest = (jnp.zeros(6), jnp.zeros(6))
    moment = 40 * 0.02 * np.array([np.cos(0.5), np.sin(0.5)])
    on_a, on_b = pull(joint, rest, rest)
    np.testing.assert_allclose([on_a[3:5], on_b[3:5]], [moment, -moment], rtol=1e-13)
    joint = jr.Coupling([0, 0, 0, 40.0, 40.0, 0], imperfection=jr.Imperfection(0, 0, 0.02, 0.5))
    turned = (jnp.zeros(6).at[5].set(0.9), jnp.zeros(6))
    on_a, on_b = pull(joint, turned, rest)
    moment = 40 * 0.02 * np.array([np.cos(1.4), np.sin(1.4)])
    np.testing.assert_allclose([on_a[3:5], on_b[3:5]], [-moment, moment], rtol=1e-13)


def test_the_balanced_form_has_no_bore_and_still_stacks():
    plain = jr.Coupling(SPRINGS, DAMPERS, misalignment=ASIDE)
    bored = jr.Coupling(SPRINGS, DAMPERS, misalignment=ASIDE, imperfection=BORE)
    motions = random_motions(2)
    np.testing.assert_array_equal(pull(bored.nominal(), *motions), pull(plain, *motions))
    assert jax.tree.structure(bored.nominal()) == jax.tree.structure(bored)
    assert plain.nominal() is plain


# Whole machines


def free_line(turn=0.0, size=1.0):
    """Two unbalanced rotors on isotropic supports, misaligned and bored askew, by so much; everything
    that has a direction in the plane is turned by `turn`."""

    def unbalance(e, angle):
        return jr.Unbalance(size * e, angle + turn, size * 5e-3, 0.4 + turn)

    support = jr.LinearSupport([2e5, 2e5, 1e5, 60.0, 60.0, 0.0], [50.0, 50, 50, 0.1, 0.1, 0.0])
    return jr.Machine.in_line(
        {
            "a": jr.Rotor(2.0, 0.012, 0.008, unbalance=unbalance(1e-4, 0.3)),
            "joint": jr.Coupling(
                SPRINGS,
                DAMPERS,
                phi=jr.elements.Parallel(
                    [jr.elements.Maxwell(100.0, 1.0), jr.elements.Progressive([50.0, 1e4])]
                ),
                misalignment=jr.Misalignment(size * 1e-3, 0.5 + turn, size * 0.02, turn - 0.4),
                imperfection=jr.Imperfection(size * 5e-4, 0.7 + turn, size * 0.01, 1.1 + turn),
            ),
            "b": jr.Rotor(3.0, 0.010, 0.006, unbalance=unbalance(2e-4, -1.0)),
        },
        attachments={"ka": (support, "a"), "kb": (support, "b")},
    )


def test_turning_everything_changes_nothing():
    """But for what 1-2-3 angles do to linear supports, of third order in the tilt. Twist measured by
    phi alone would differ by psi theta, of second order."""
    about = Rotation.from_euler("z", 0.7)
    options = dict(initial="undeformed", speed=100.0, **TIGHT)

    def errors(size):
        one, other = (jr.simulate(free_line(at, size), 0.05, 200.0, **options) for at in (0.0, 0.7))
        out = []
        for name in "ab":
            p, q = np.array(one[name].position), np.array(other[name].position)
            turned = about * Rotation.from_euler("XYZ", p[:, 3:]) * about.inv()
            apart = turned.inv() * Rotation.from_euler("XYZ", q[:, 3:])
            out += [np.abs(q[:, :3] - about.apply(p[:, :3])).max(), apart.magnitude().max()]
        assert np.abs(p[:, 3] * p[:, 4]).max() > 1e-5 * size**2
        return np.array(out)

    coarse, fine = errors(1.0), errors(0.25)
    assert np.all(coarse < 2e-6)
    assert np.all(coarse / fine > 0.9 * 4**3)


def test_energy_of_a_coupled_line():
    """The default solver, with misalignment, bore, states and a hardening law."""
    audit = jr.energy_audit(free_line(), 0.2, 2000.0, initial="undeformed", speed=100.0)
    assert float(audit.relative) < 1e-6
    assert float(audit.lost[-1]) > 0.1 * float(audit.exchanged)


# Rotors on one wall, each by a law of its own: twist against SciPy, with the law in plain NumPy.
JR, SPIN = 0.02, 3.0


class Sinh(jr.elements.AbstractLaw):
    """A user's own: hardens without bound."""

    stiffness: jax.Array = jr.parameter("N*m/rad", positive=True)
    width: jax.Array = jr.parameter("rad", positive=True)

    def force(self, t, x, v, state):
        return self.stiffness * self.width * jnp.sinh(x / self.width)

    def energy(self, t, x, state):
        return self.stiffness * self.width**2 * (jnp.cosh(x / self.width) - 1)

    def power_lost(self, t, x, v, state):
        return jnp.zeros_like(x)


def bouc_wen(x, v, z):
    k, a, xy, n, beta, gamma = 200.0, 0.1, 0.01, 1.5, 0.6, 0.4
    z_t = (v - beta * abs(v) * abs(z[0]) ** (n - 1) * z[0] - gamma * v * abs(z[0]) ** n) / xy
    return a * k * x + (1 - a) * k * xy * z[0], [z_t]


def rubber(x, v, z):
    return 40 * x + 150 * z[1] + bouc_wen(x, v, z)[0], [*bouc_wen(x, v, z)[1], v - 150 / 2.0 * z[1]]


BOUC_WEN = jr.elements.BoucWen(200.0, 0.1, 0.01, 1.5, 0.6, 0.4)
ON_THE_WALL = {
    "own": (Sinh(100.0, 0.03), lambda x, v, z: (100 * 0.03 * np.sinh(x / 0.03), []), 0),
    "hardening": (
        jr.elements.Progressive([100.0, 5e4], 0.1),
        lambda x, v, z: (100 * x + 5e4 * x**3 + 0.1 * v, []),
        0,
    ),
    "maxwell": (
        jr.elements.Maxwell(150.0, 2.0),
        lambda x, v, z: (150 * z[0], [v - 150 / 2.0 * z[0]]),
        1,
    ),
    "loop": (BOUC_WEN, bouc_wen, 1),
    "rubber": (
        jr.elements.Parallel(
            [jr.elements.KelvinVoigt(40.0), BOUC_WEN, jr.elements.Maxwell(150.0, 2.0)]
        ),
        rubber,
        2,
    ),
}
GAP, STIFF = 0.04, 800.0


@pytest.fixture(scope="module")
def wall():
    """Thrown off at 3 rad/s, all in one run; `play` by a backlash."""
    laws = {name: law for name, (law, _, _) in ON_THE_WALL.items()}
    laws["play"] = jr.elements.Backlash(GAP, STIFF)
    elements = {"wall": jr.PrescribedSpin(jr.ConstantSpeed(0.0))}
    for name, law in laws.items():
        elements |= {f"{name} joint": jr.Coupling(phi=law), name: jr.Rotor(1.0, JR, 0.02)}
    machine = jr.Machine(elements, {f"{name} joint": ("wall", name) for name in laws})
    v = np.zeros((len(laws) + 1, 6))
    v[1:, 5] = SPIN
    return jr.simulate(machine, 0.2, 200.0, jr.State(np.zeros_like(v), v), **TIGHT)


@pytest.mark.parametrize("name", ON_THE_WALL)
def test_a_rotor_on_the_wall_against_scipy(wall, name):
    _, force, count = ON_THE_WALL[name]

    def field(t, y):
        pull, z_t = force(y[0], y[1], y[2:])
        return [y[1], -pull / JR, *z_t]

    y0 = [0.0, SPIN, *[0.0] * count]
    y = solve_ivp(field, (0, 0.2), y0, "LSODA", wall.t, rtol=1e-12, atol=1e-14, max_step=2e-4).y
    np.testing.assert_allclose(wall[name].phi, y[0], atol=2e-9)
    assert np.ptp(y[0]) > 0.02


def test_free_flight_and_contact(wall):
    """Across the gap at constant speed, half a swing against the spring, and back; and so on."""
    w = np.sqrt(STIFF / JR)
    flight, contact = GAP / 2 / SPIN, np.pi / w
    t = np.asarray(wall.t) % (4 * flight + 2 * contact)
    side = np.where(t < 2 * flight + contact, 1.0, -1.0)
    t = t % (2 * flight + contact)
    swing = GAP / 2 + SPIN / w * np.sin(w * (t - flight))
    there, back = SPIN * t, SPIN * (2 * flight + contact - t)
    x = side * np.where(t < flight, there, np.where(t < flight + contact, swing, back))
    np.testing.assert_allclose(wall["play"].phi, x, atol=1e-9)
    assert np.abs(x).max() > 0.03 and float(wall.t[-1]) > 2 * (4 * flight + 2 * contact)


# Clutches
CAPACITY, J1, J2, SLIP = 8.0, 0.02, 0.05, 2e-3


def test_clutches_engage_hold_and_slip():
    """In one run: two free inertias are joined, one torque below capacity is held, one above slips.
    They stand on one wall; a coupling without any force joins the free pair to it."""
    engage = jr.Ramp(0.0, 0.1, 1.0)
    clutch = jr.Coupling(phi=jr.StickSlipClutch(CAPACITY, SLIP, engage, 2.0))
    rotor = jr.Rotor(1.0, J1, 0.03)
    machine = jr.Machine(
        {
            "wall": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
            "nothing": jr.Coupling(),
            "one": rotor,
            "clutch": clutch,
            "two": jr.Rotor(1.0, J2, 0.03),
            "brake": clutch,
            "held": rotor,
            "other brake": clutch,
            "pulled": rotor,
            "below": jr.Torque(jr.Ramp(0.1, 0.1, 0.85 * CAPACITY)),
            "above": jr.Torque(jr.Step(0.3, 1.3 * CAPACITY)),
        },
        {
            "nothing": ("wall", "one"),
            "clutch": ("one", "two"),
            "brake": ("wall", "held"),
            "other brake": ("wall", "pulled"),
            "below": "held",
            "above": "pulled",
        },
        fixed={n: ("x", "y", "z", "psi", "theta") for n in ("one", "two", "held", "pulled")},
    )
    v = np.zeros((5, 6))
    v[1, 5] = 100.0
    response = jr.simulate(
        machine,
        0.5,
        100.0,
        jr.State(np.zeros((5, 6)), v),
        solver=diffrax.Dopri8(),
        rtol=1e-10,
        atol=1e-12,
    )
    t = np.asarray(response.t)
    speed = {n: np.asarray(response[n].velocity)[:, 5] for n in ("one", "two", "pulled")}
    # slipping, each is braked or driven by capacity times the area under the engagement
    area = np.where(t < 0.1, t**2 / 0.2, t - 0.05)
    slipping = t < 0.05 + 100 / (CAPACITY / J1 + CAPACITY / J2) - 0.005
    assert 10 < slipping.sum() < 30
    early = slipping & (t > 0)
    np.testing.assert_allclose(
        speed["one"][early], 100 - CAPACITY * area[early] / J1, rtol=1e-6, atol=2e-5
    )
    np.testing.assert_allclose(response["clutch"].torque[15], -CAPACITY, rtol=1e-8)
    # joined, they turn as one: momentum says how fast
    common = J1 * 100 / (J1 + J2)
    np.testing.assert_allclose([speed["one"][-1], speed["two"][-1]], common, rtol=1e-5)
    # below capacity nothing but the bristles' own bending
    twist = response["held"].phi
    np.testing.assert_allclose(twist[-1], 0.85 * SLIP, rtol=1e-4)
    assert np.max(twist) < SLIP
    # above, what is left over accelerates
    late = t > 0.34
    gained = np.diff(speed["pulled"][late]) / 0.01
    np.testing.assert_allclose(gained, 0.3 * CAPACITY / J1, rtol=1e-6)
    np.testing.assert_allclose(speed["pulled"][t < 0.295], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    "law",
    [
        jr.CoulombClutch(CAPACITY, jr.Ramp(0.0, 0.1, 1.0), 0.05),
        jr.StickSlipClutch(CAPACITY, SLIP, jr.Ramp(0.0, 0.1, 1.0), 2.0),
    ],
    ids=["coulomb", "stick-slip"],
)
def test_heat_of_an_engagement(law):
    """The clutch's own account of two inertias brought to one speed: J1 J2/(J1 + J2) dw²/2."""

    def field(t, y, args):
        d, v, heat, z = y
        pull, lost = law.force(t, d, v, z), law.power_lost(t, d, v, z)
        # d: second less first
        return v, -pull * (1 / J1 + 1 / J2), lost, law.rates(t, d, v, z)

    zero = jnp.zeros(())
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(field),
        diffrax.Kvaerno5(),
        0.0,
        0.6,
        1e-5,
        (zero, jnp.asarray(-100.0), zero, law.initial()),
        stepsize_controller=diffrax.ClipStepSizeController(
            diffrax.PIDController(rtol=1e-8, atol=1e-10), jump_ts=jnp.array([0.1])
        ),
        max_steps=2**15,
    )
    _, v, heat, _ = (y[0] for y in solution.ys)
    reduced = J1 * J2 / (J1 + J2)
    assert abs(float(v)) < 1e-3
    np.testing.assert_allclose(heat, 0.5 * reduced * (100.0**2 - v**2), rtol=1e-6)


# Derivatives


def numbered(p):
    """A line whose joint depends on nine numbers. (What damps its play never takes the push away: where it
    does the slope has a corner, at which central differences converge slowly; test_laws has that.)"""
    play = jr.elements.Backlash(p[6], 100.0, smoothing=5e-3, hysteresis=0.05)
    joint = jr.Coupling(
        jnp.asarray(SPRINGS).at[5].set(p[0]),
        DAMPERS,
        x=jr.elements.Progressive(jnp.stack([jnp.asarray(1e3), p[1]])),
        theta=jr.elements.BoucWen(p[2], 0.2, p[3]),
        phi=jr.elements.Parallel([jr.elements.Maxwell(p[4], p[5]), play]),
        misalignment=jr.Misalignment(p[7], 0.5, 0.02),
        imperfection=jr.Imperfection(p[8], 0.7, 0.01),
    )
    rotor = jr.Rotor(2.0, 0.012, 0.008, unbalance=jr.Unbalance(1e-4))
    return jr.Machine.in_line({"a": rotor, "joint": joint, "b": rotor})


NUMBERS = [300.0, 1e7, 40.0, 0.01, 100.0, 1.0, 0.01, 1e-3, 5e-4]


def test_derivatives_of_a_machine_one_by_one_and_in_a_batch():
    rng = np.random.default_rng(3)
    y = jnp.asarray(rng.normal(size=26) * np.repeat([0.005, 1.0, 0.3], [12, 12, 2]))

    def rates(p):
        return vector_field(0.0, y, assemble(numbered(p)))

    forward = assert_derivatives_agree(rates, NUMBERS, step=1e-3)
    assert np.all(np.any(np.abs(forward) > 0, axis=0))  # every number matters
    batch = jnp.asarray(NUMBERS) * jnp.array([[1.0], [1.1]])
    for mode in (jax.jacfwd, jax.jacrev):
        each = jax.jit(jax.vmap(mode(rates)))(batch)
        np.testing.assert_allclose(each[0], forward, rtol=1e-9, atol=1e-9)
        assert np.all(np.isfinite(each[1])) and np.any(each[1] != each[0])


def test_derivatives_of_a_run():
    """Through a hundred steps of Euler's, by stiffness, gap and both misalignments."""
    y0 = jnp.zeros(26).at[20:22].set(jnp.array([30.0, 33.0]))

    def last(p):
        system = assemble(numbered(jnp.asarray(NUMBERS).at[jnp.array([0, 6, 7, 8])].set(p)))

        def step(y, _):
            return y + 1e-4 * vector_field(0.0, y, system), None

        return jax.lax.scan(step, y0, None, length=100)[0] * 1e3

    assert_derivatives_agree(last, [NUMBERS[i] for i in (0, 6, 7, 8)], step=1e-3)
