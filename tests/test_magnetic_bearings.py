"""Magnetic bearings: their magnets and controllers against closed forms, the loops of rigid rotors against
transfer functions written by hand, levitation and the drop into an auxiliary bearing against mechanics."""

import jax
import jax.flatten_util
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree
from scipy.signal import butter

import jaxrotor as jr

el = jr.elements
MU_0 = 4e-7 * np.pi
M, G = 5.0, 9.81
BIAS, GAP, TURNS, AREA = 2.0, 5e-4, 200.0, 4e-4
COS = np.cos(np.pi / 8)
# Schweitzer & Maslen (2009), sec. 4.2
K = MU_0 * TURNS**2 * AREA / 4
KI, KS = 4 * K * BIAS / GAP**2 * COS, 4 * K * BIAS**2 / GAP**3 * COS
KP = 2.2 * KS / KI
KD = 1.4 * np.sqrt((KI * KP - KS) * M) / KI
LAG = 2 * np.pi * 5e3
MAGNETS = el.Electromagnets(BIAS, GAP, TURNS, AREA, resistance=0.5, leakage=1e-3)
ROUGH = el.Electromagnets(BIAS, GAP, TURNS, AREA, saturation=0.8, resistance=0.5, leakage=1e-3)
LINEAR = MAGNETS.linearised()


def rigid(bearing, gravity=0.0, **more):
    """One mass in its bearing, which only moves across."""
    return jr.Machine.in_line(
        {"rotor": jr.Rotor(M, 2.0, 1.0)},
        attachments={"amb": (bearing, "rotor")} | {k: (v, "rotor") for k, v in more.items()},
        gravity=(0.0, -gravity, 0.0),
        fixed={"rotor": ("z", "psi", "theta") + (() if more else ("phi",))},
    )


# Magnets


@pytest.mark.parametrize("magnet", [MAGNETS, ROUGH, LINEAR], ids=["free", "saturated", "linear"])
def test_stiffnesses_in_the_middle(magnet):
    def pull(s, i):
        return magnet.force(s, magnet.coils(i, jnp.ones(())))

    zero = jnp.zeros(())
    assert float(pull(zero, zero)) == 0
    assert float(jax.grad(pull, 1)(zero, zero)) == pytest.approx(KI, rel=1e-12)
    assert float(jax.grad(pull, 0)(zero, zero)) == pytest.approx(KS, rel=1e-12)


def test_the_pull_of_two_magnets():
    for s, i in ((1e-4, 0.7), (-3e-4, 1.9), (2e-4, -1.2)):
        want = K * COS * (((BIAS + i) / (GAP - s)) ** 2 - ((BIAS - i) / (GAP + s)) ** 2)
        got = MAGNETS.force(jnp.asarray(s), MAGNETS.coils(jnp.asarray(i), jnp.ones(())))
        assert float(got) == pytest.approx(want, rel=1e-12)


def test_a_saturated_pull_ends_at_maxwell_s_stress():
    """B²/(2 mu0) on both poles, the other magnet off; the corner being rounded over 10 %, by 1/300 more."""
    got = ROUGH.force(jnp.zeros(()), jnp.array([40.0, 0.0]))
    want = 0.8**2 / (2 * MU_0) * 2 * AREA * COS * (1 + 0.1**2 / 3)
    assert float(got) == pytest.approx(want, rel=1e-12)


@pytest.mark.parametrize("magnet", [MAGNETS, ROUGH, LINEAR], ids=["free", "saturated", "linear"])
def test_force_and_linkages_belong_to_one_energy(magnet):
    """dW = sum of i dψ - F ds, whichever way coils and rotor change: also where iron saturates."""
    rng = np.random.default_rng(3)
    for _ in range(6):
        at = jnp.array([rng.uniform(-3e-4, 3e-4), *rng.uniform(0.2, 3.9, 2)])
        way = jnp.array([1e-4, 1.0, 1.0]) * rng.standard_normal(3)
        stored = lambda x: magnet.energy(x[0], x[1:])  # noqa: E731
        linked = lambda x: magnet.linkages(x[0], x[1:])  # noqa: E731
        grown = jax.jvp(stored, (at,), (way,))[1]
        fed = at[1:] @ jax.jvp(linked, (at,), (way,))[1]
        assert float(grown) == pytest.approx(
            float(fed - magnet.force(at[0], at[1:]) * way[0]), rel=1e-9, abs=1e-15
        )


# Controllers, as transfer functions of s

S = 1j * np.array([3.0, 80.0, 900.0, 3e3, 4e4])
NUM, DEN = [2.0, 3e3, 5e5], [1.0, 900.0, 4e6, 1e9]
A2, B2, C2 = np.array([[-50.0, 900.0], [-200.0, -70.0]]), np.array([3.0, -1.0]), [4e4, 5e3]
ZEROS, POLES = [-30 + 200j, -30 - 200j, -1e3], [-50 + 400j, -50 - 400j, -3e3, -9e3]


def pid(s, integral=0.0):
    return KP + integral / s + KD * s / (1 + s / LAG)


def roots(s):
    return 7e3 * np.prod([s - z for z in ZEROS], axis=0) / np.prod([s - p for p in POLES], axis=0)


CONTROLLERS = {
    "pd": (el.PID(KP, KD, 5e3), pid),
    "pid": (el.PID(KP, KD, 5e3, 4e5), lambda s: pid(s, 4e5)),
    "polynomials": (
        el.TransferFunction(NUM, DEN, 3.0),
        lambda s: 3.0 * np.polyval(NUM, s) / np.polyval(DEN, s),
    ),
    "integrator": (
        el.TransferFunction([5.0, 7.0, 2.0], [1.0, 60.0, 0.0]),
        lambda s: (5 * s**2 + 7 * s + 2) / (s**2 + 60 * s),
    ),
    "a number": (el.TransferFunction([6.0], [2.0]), lambda s: 3.0 + 0 * s),
    "zeros": (el.TransferFunction.from_zeros(ZEROS, POLES, 7e3), roots),
    "states": (
        el.StateSpace(A2, B2, C2, 12.0),
        lambda s: np.array([12 + C2 @ np.linalg.solve(x * np.eye(2) - A2, B2) for x in s]),
    ),
    "series": (
        el.InSeries((el.PID(KP, KD, 5e3), el.TransferFunction(NUM, DEN))),
        lambda s: pid(s) * np.polyval(NUM, s) / np.polyval(DEN, s),
    ),
}


def seen_at(controller, s):
    """Transfer function of a controller, from its slopes."""
    zero, state = jnp.zeros(()), controller.initial()
    parts = []
    for f in (controller.rates, lambda e, z, _: controller.current(e, z)):
        parts += [np.asarray(x) for x in jax.jacfwd(f, (0, 1))(zero, state, zero)]
    B, A, D, C = parts
    inner = [C @ np.linalg.solve(x * np.eye(len(B)) - A, B) if len(B) else 0.0 for x in s]
    return D + np.array(inner)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_transfer_functions_of_controllers(name):
    controller, want = CONTROLLERS[name]
    np.testing.assert_allclose(seen_at(controller, S), want(S), rtol=1e-11)


def test_derivatives_of_a_transfer_function():
    """By its coefficients, of what comes out: the frequency that its states are measured by drops out."""

    def size(x):
        c = el.TransferFunction(x[:3] * jnp.array(NUM), x[3:] * jnp.array(DEN))
        zero, state = jnp.zeros(()), c.initial()
        B, A = jax.jacfwd(lambda e, z: c.rates(e, z, zero), (0, 1))(zero, state)
        D, C = jax.jacfwd(c.current, (0, 1))(zero, state)
        return jnp.abs(D + C @ jnp.linalg.solve(700j * jnp.eye(3) - A, B.astype(complex)))

    assert_derivatives_agree(size, np.ones(7), rtol=1e-7, step=1e-4)


# The loop of a rigid rotor: magnets, controller, delay, lag, sensor


def padé(s, delay):
    """Numerator of degree 2, denominator of degree 3: Vajta (2000)."""
    x = s * delay
    return (60 - 24 * x + 3 * x**2) / (60 + 36 * x + 9 * x**2 + x**3)


def chain(s):
    """From the error to the current."""
    b, a = butter(2, 2 * np.pi * 3e3, analog=True)
    lag = 2 * np.pi * 2e3
    return pid(s, 4e5) * padé(s, 4e-5) * lag / (s + lag) * np.polyval(b, s) / np.polyval(a, s)


AMPLIFIER = el.CurrentAmplifier(bandwidth=2e3, voltage=100.0, delay=4e-5)
WHOLE = el.MagneticBearing(MAGNETS, el.PID(KP, KD, 5e3, 4e5), AMPLIFIER, sensor_cutoff=3e3)
W = np.geomspace(5.0, 5e4, 60)


@pytest.fixture(scope="module")
def loops():
    return jr.linear.control_loops(rigid(WHOLE), W, at="undeformed")


def test_open_loop_sensitivity_and_closed_loop(loops):
    want = KI * chain(1j * W) / (M * (1j * W) ** 2 - KS)
    assert loops.axes == ("amb.v", "amb.w")
    for k in range(2):
        np.testing.assert_allclose(loops.open_loop[:, k], want, rtol=1e-8)
        np.testing.assert_allclose(loops.sensitivity[:, k], 1 / (1 + want), rtol=1e-9)
        np.testing.assert_allclose(loops.closed_loop[:, k], want / (1 + want), rtol=1e-8)
    # two axes that know nothing of each other
    np.testing.assert_allclose(loops.largest, np.abs(1 / (1 + want)), rtol=1e-9)
    np.testing.assert_allclose(
        loops.decibels[:, 0], -20 * np.log10(np.abs(1 + want)), rtol=1e-9, atol=1e-9
    )


def test_peak_of_the_sensitivity_and_its_zone():
    fine = np.geomspace(50.0, 5e4, 200_001)
    size = np.abs(1 / (1 + KI * chain(1j * fine) / (M * (1j * fine) ** 2 - KS)))
    found = jr.standards.peak_sensitivity(rigid(WHOLE), "amb", at="undeformed")
    assert float(found.value) == pytest.approx(size.max(), rel=1e-8)
    assert float(found.frequency) == pytest.approx(fine[size.argmax()], rel=1e-3)
    assert float(found.decibels) == pytest.approx(20 * np.log10(size.max()), rel=1e-8)
    (row,) = jr.standards.loop_sensitivity(rigid(WHOLE), "amb.w", at="undeformed").findings
    zone = "ABCD"[int(np.searchsorted([3.0, 4.0, 5.0], size.max()))]
    assert row.place.startswith("amb.w") and row.place.endswith(f"zone {zone}")


def assert_same(found, want):
    """Eigenvalues, in whatever order, to 1e-7."""
    assert found.shape == want.shape
    for a, b in ((found, want), (want, found)):
        assert np.all(np.abs(a[:, None] - b).min(1) < 1e-7 * np.abs(a))


def test_characteristic_polynomial():
    """Of each axis (m s² - ks)(1 + s/w) + ki (kp (1 + s/w) + kd s), w being the derivative's cutoff."""
    machine = rigid(el.MagneticBearing(LINEAR, el.PID(KP, KD, 5e3)))
    found = np.asarray(jr.linearize(machine, at="undeformed").eigenvalues)
    plant, lag = np.array([M, 0.0, -KS]), np.array([1 / LAG, 1.0])
    want = np.roots(np.polyadd(np.polymul(plant, lag), KI * np.array([KP / LAG + KD, KP])))
    assert_same(found, np.repeat(want, 2))


def test_gradient_of_the_sensitivity_s_peak():
    """By the gains: what a design by gradient needs."""
    machine = rigid(
        el.MagneticBearing(LINEAR, el.PID(KP, KD, 5e3), el.CurrentAmplifier(bandwidth=1e3))
    )

    def peak(x):
        changed = machine.set(
            {"amb.controller.proportional": x[0], "amb.controller.derivative": x[1]}
        )
        return jr.standards.peak_sensitivity(changed, "amb.v", at="undeformed").value

    assert_derivatives_agree(peak, [KP, KD], rtol=1e-6, step=1e-5)


# Two bearings of a rigid rotor, whose sensors are elsewhere

MASS, JT, JP, ENDS = 8.0, 0.12, 0.03, (0.15, 0.19)
ACTUATORS, SENSORS = (-ENDS[0], 0.0), (-ENDS[0], ENDS[1])


@pytest.fixture(scope="module")
def pair():
    bearing = el.MagneticBearing(LINEAR, el.PID(KP, KD, 5e3), angle=0.0)
    return jr.Machine.in_line(
        {"rotor": jr.Rotor(MASS, JP, JT, ends=ENDS)},
        attachments={
            "left": (bearing, "rotor.left"),
            "middle": (bearing, ("rotor", "rotor.right")),
        },
        fixed={"rotor": ("z",)},
        prescribed={"rotor": {"phi": jr.ConstantSpeed(150.0)}},
    )


def by_hand(speed):
    """Of `x' = A x + B d` and what is measured, in (x, y, psi, theta), their rates, and a state an axis: x at
    the distance z is x + z theta, y is y - z psi."""
    P, Q = (
        np.vstack([[[1, 0, 0, z], [0, 1, -z, 0.0]] for z in places])
        for places in (ACTUATORS, SENSORS)
    )
    n = len(P)
    inverse = np.diag(1 / np.array([MASS, MASS, JT, JT]))
    gyro = np.zeros((4, 4))
    gyro[2, 3], gyro[3, 2] = -JP * speed, JP * speed
    # i = (kp + w kd) e - a, a' = w (w kd e - a), e = -(Q q + d)
    high = KP + LAG * KD
    A = np.block(
        [
            [np.zeros((4, 4)), np.eye(4), np.zeros((4, n))],
            [inverse @ P.T @ (KS * P - KI * high * Q), inverse @ gyro, -KI * inverse @ P.T],
            [-(LAG**2) * KD * Q, np.zeros((n, 4)), -LAG * np.eye(n)],
        ]
    )
    B = np.vstack([np.zeros((4, n)), -KI * high * inverse @ P.T, -(LAG**2) * KD * np.eye(n)])
    return A, B, np.hstack([Q, np.zeros((n, 4 + n))])


def test_sensors_that_are_elsewhere(pair):
    """One bearing pulls at the centre and measures 19 cm from there; the rotor turns at 150 rad/s."""
    A, B, C = by_hand(150.0)
    want = np.linalg.eigvals(A)
    assert want.real.max() < 0
    assert_same(np.asarray(jr.linearize(pair, 150.0, at="undeformed").eigenvalues), want)
    loops = jr.linear.control_loops(pair, W, 150.0, at="undeformed")
    matrix = np.array([np.eye(4) + C @ np.linalg.solve(1j * w * np.eye(12) - A, B) for w in W])
    assert loops.axes == ("left.v", "left.w", "middle.v", "middle.w")
    np.testing.assert_allclose(loops.matrix, matrix, rtol=1e-7, atol=1e-9)
    worst = np.linalg.svd(matrix, compute_uv=False)[:, 0]
    np.testing.assert_allclose(loops.largest, worst, rtol=1e-7)
    assert np.all(worst > np.abs(np.diagonal(matrix, axis1=1, axis2=2)).max(1) * (1 + 1e-6))
    one = jr.linear.control_loops(pair, W[:3], 150.0, "middle", at="undeformed")
    np.testing.assert_allclose(one.matrix, matrix[:3, 2:, 2:], rtol=1e-7, atol=1e-9)


# In time: levitated, dropped, bouncing, rolling. One machine in all runs, so one program

CLEARANCE, CONTACT, RADIUS, FAILS = 2e-4, 2e7, 0.02, 0.004


def dropped(initial, gravity=G, fails_at=-1.0, damping=0.0, friction=0.0, radius=RADIUS, end=0.03):
    bearing = el.MagneticBearing(
        LINEAR, el.PID(KP, KD, 5e3, 4e5), fails_at=fails_at, decay_time=1e-6
    )
    ring = jr.Rub(CLEARANCE, CONTACT, radius, friction, slip_speed=1e-3, damping=damping)
    machine = rigid(bearing, gravity, ring=ring)
    return jr.simulate(machine, end, 300 / end, initial=initial, rtol=1e-9, atol=1e-13)


def state(x=0.0, y=0.0, vx=0.0, vy=0.0, spin=0.0):
    return jr.State(np.array([[x, y, 0, 0, 0, 0.0]]), np.array([[vx, vy, 0, 0, 0, spin]]))


def test_free_fall_into_the_auxiliary_bearing():
    """Levitated by the integrators, then without current: y = -g t²/2 until sqrt(2 gap/g) later. While the
    currents die, T = 1 µs, their force is M G exp(-2 t/T): it adds G (T t/2 - T²/4)."""
    run = dropped("running", fails_at=FAILS)
    t, y = np.asarray(run.t), np.asarray(run["rotor"].y)
    assert np.abs(y[t <= FAILS]).max() < 1e-12
    force = np.hypot(run["amb"].force_v, run["amb"].force_w)
    np.testing.assert_allclose(force[t <= FAILS], M * G, rtol=1e-9)
    assert np.abs(force[t > FAILS + 1e-4]).max() < 1e-9
    falling = (t > FAILS + 1e-4) & (t < FAILS + np.sqrt(2 * CLEARANCE / G))
    since = t[falling] - FAILS
    np.testing.assert_allclose(
        y[falling],
        -0.5 * G * since**2 + G * (0.5e-6 * since - 0.25e-12),
        rtol=1e-7,
    )
    landed = t[np.argmax(y < -CLEARANCE)]
    assert 0 < landed - FAILS - np.sqrt(2 * CLEARANCE / G) < t[1]


def test_coefficient_of_restitution():
    """A spring and a damper that never pull: Schwager & Pöschel, Granular Matter 9 (2007) 465, eq. (21)."""
    c, v = 0.15 * 2 * np.sqrt(CONTACT * M), 0.2
    beta, natural = c / (2 * M), np.sqrt(CONTACT / M)
    w = np.sqrt(natural**2 - beta**2)
    want = np.exp(-beta / w * (np.pi - np.arctan(2 * beta * w / (w**2 - beta**2))))
    run = dropped(state(vx=0.6 * v, vy=0.8 * v), gravity=0.0, damping=c, end=0.004)
    out = np.array([run["rotor"].velocity[-1, 0], run["rotor"].velocity[-1, 1]])
    np.testing.assert_allclose(out, -want * v * np.array([0.6, 0.8]), rtol=1e-5)


@pytest.mark.parametrize("spin", [100.0, -100.0])
def test_a_sliding_rotor_rests_at_the_friction_angle(spin):
    """Climbed by atan(friction) against the sense of its spin, where weight, push and friction balance."""
    mu = 0.15
    push = M * G / np.hypot(1, mu)
    at = -np.pi / 2 - np.sign(spin) * np.arctan(mu)
    e = (CLEARANCE + push / CONTACT) * np.array([np.cos(at), np.sin(at)])
    run = dropped(state(*e, spin=spin), friction=mu)
    moved = np.stack([run["rotor"].x, run["rotor"].y], -1) - e
    assert np.abs(moved).max() < 1e-9 * CLEARANCE + 1e-13
    np.testing.assert_allclose(run["ring"].normal_force, push, rtol=1e-6)
    slowed = 2.0 * (np.asarray(run["rotor"].speed) - spin) / np.asarray(run.t).clip(1e-9)
    np.testing.assert_allclose(slowed[1:], -np.sign(spin) * mu * push * RADIUS, rtol=1e-6)


def test_backward_whirl_by_dry_friction():
    """The rotor rolls along the ring, against its spin, e whirl = -radius spin, pressed to it by what its own
    whirl throws out: e = gap k/(k - m whirl²)."""
    whirl, radius = 600.0, 1e-3
    e = CLEARANCE * CONTACT / (CONTACT - M * whirl**2)
    spin = e * whirl / radius
    # it slides at first: its spin is 2 % too quick
    begin = state(x=e, vy=-e * whirl, spin=1.02 * spin)
    run = dropped(begin, gravity=0.0, friction=0.3, radius=radius, damping=4e3)
    x, y = np.asarray(run["rotor"].x), np.asarray(run["rotor"].y)
    vx, vy = np.asarray(run["rotor"].velocity[:, :2]).T
    slip = np.asarray(run["ring"].slip)
    assert slip[0] == pytest.approx(0.02 * radius * spin)
    assert np.abs(slip[-30:]).max() < 1e-3 * slip[0]
    turning = ((x * vy - y * vx) / (x**2 + y**2))[-30:]
    np.testing.assert_allclose(
        turning * np.hypot(x, y)[-30:], -radius * run["rotor"].speed[-30:], rtol=1e-5
    )
    np.testing.assert_allclose(
        np.hypot(x, y)[-30:], CLEARANCE * CONTACT / (CONTACT - M * turning**2), rtol=1e-5
    )


def test_the_books_of_a_drop():
    """Voltages at their limit, iron saturated, coils hot, then the power fails, the rotor bounces and rubs:
    what the supply fed in, less heat, is in the rotor and the fields."""
    bearing = el.MagneticBearing(
        ROUGH,
        el.PID(KP, KD, 5e3, 4e5),
        AMPLIFIER,
        sensor_cutoff=3e3,
        fails_at=0.02,
        decay_time=2e-3,
    )
    ring = jr.Rub(CLEARANCE, CONTACT, RADIUS, 0.2, damping=500.0)
    machine = rigid(bearing, G, ring=ring)
    books = jr.energy_audit(machine, 0.04, 2000.0, initial=state(1.6e-4, -1e-4, spin=200.0))
    assert float(books.relative) < 1e-6
    assert np.ptp(books.work_in) > 0.05 and books.lost[-1] > 0.1
    assert books.elastic[0] > 0.1 and books.elastic[-1] < 1e-3


# Every number that it makes, by every parameter

FULL = el.MagneticBearing(
    ROUGH,
    el.InSeries((el.PID(KP, KD, 5e3, 4e5), el.StateSpace(A2, B2, 1e-4 * np.array(C2), 0.9))),
    el.CurrentAmplifier(1.8, 2e3, 100.0, 4e-5),
    sensor_cutoff=3e3,
    setpoint=(1e-5, -2e-5),
    fails_at=0.1,
    other_magnet=el.LinearMagnet(KI, KS, 1.9, 0.02, 0.3),
    other_controller=el.StateSpace(A2, B2, C2, 2e4),
    housed=True,
)


def test_derivatives_by_every_parameter():
    """Forces on rotor and housing, rates of the states, and the books; the second axis has other parts than
    the first, the power fails, and currents are near their limits."""
    rng = np.random.default_rng(5)
    motions = tuple(
        (jnp.array(1e-4 * rng.standard_normal(6)), jnp.array(0.1 * rng.standard_normal(6)))
        for _ in range(3)
    )
    size = FULL.initial().shape[0]
    state = jnp.array(np.tile([1e-4, 2e-4, 1.0, 0.5, 0.7, 0.3, 0.2, 0.4, 1.1, 0.9], 3)[:size])
    flat, rest = jax.flatten_util.ravel_pytree(FULL)
    flat = np.asarray(flat)

    def numbers(x):
        bearing, t = rest(jnp.asarray(x) * np.where(flat == 0, 1.0, flat)), jnp.asarray(0.1005)
        f = bearing.forces(t, motions, state)
        books = [
            getattr(bearing, n)(t, motions, state) for n in ("energy", "power_in", "power_lost")
        ]
        rates = bearing.rates(t, motions, (), state)
        return jnp.stack(
            [f[0][0], f[2][1], *books, 1e-4 * jnp.sum(jnp.sin(jnp.arange(size)) * rates)]
        )

    assert_derivatives_agree(numbers, np.where(flat == 0, 0.0, 1.0), rtol=2e-6, step=1e-5)


def test_two_axes_that_are_alike_are_two_axes():
    """The same parts given for each axis, and for both at once."""
    parts = MAGNETS, el.PID(KP, KD, 5e3, 4e5), AMPLIFIER
    both = el.MagneticBearing(*parts, sensor_cutoff=3e3)
    each = el.MagneticBearing(
        *parts, sensor_cutoff=3e3, other_magnet=MAGNETS, other_controller=parts[1]
    )
    rng = np.random.default_rng(6)
    motions = ((jnp.array(1e-4 * rng.standard_normal(6)), jnp.array(rng.standard_normal(6))),)
    state = jnp.array(rng.uniform(0.0, 1.0, both.initial().size))
    t = jnp.zeros(())
    for name in ("rates", "forces", "energy", "power_in", "power_lost", "currents"):
        more = (state,) if name != "rates" else ((), state)
        a, b = (getattr(x, name)(t, motions, *more) for x in (both, each))
        np.testing.assert_allclose(a, b, rtol=1e-13, err_msg=name)


PD_LOOP = el.PID(KP, KD)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: rigid(el.MagneticBearing(LINEAR, PD_LOOP, el.CurrentAmplifier(voltage=9.0))),
         "bandwidth is missing: a voltage needs one"),
        (lambda: rigid(el.MagneticBearing(MAGNETS, PD_LOOP, el.CurrentAmplifier(2.5))),
         "amplifier.limit must not exceed what magnet is made for, 2 A, but is 2.5 A"),
        (lambda: rigid(el.MagneticBearing(
            el.LinearMagnet(KI, KS), PD_LOOP, el.CurrentAmplifier(None, 1e3, 90.0))),
         "magnet.coil is missing"),
        (lambda: rigid(el.MagneticBearing(el.Electromagnets(BIAS, GAP, TURNS, AREA, 1.6), PD_LOOP)),
         "pole_angle must be less than a right angle"),
        # mu0 N i0/(2 gap) by hand
        (lambda: rigid(el.MagneticBearing(
            el.Electromagnets(3.0, 5e-4, 120.0, AREA, saturation=0.2), PD_LOOP)),
         "below their saturation of 0.2 T, but has 0.452 T in their gaps"),
        (lambda: rigid(el.MagneticBearing(
            MAGNETS, el.TransferFunction([1.0, 0, 0], [1.0, 2.0]))),
         "numerator must not be of a higher degree than the denominator, 1, but is of 2"),
        (lambda: rigid(el.MagneticBearing(MAGNETS, el.TransferFunction([1.0], [0.0, 2.0]))),
         "denominator must begin with its highest power"),
        (lambda: rigid(el.MagneticBearing(MAGNETS, el.StateSpace(A2, B2, [1.0]))),
         "A, B and C must belong together, 1 states by C"),
        (lambda: rigid(el.MagneticBearing(MAGNETS, el.InSeries(()))), "stages must be one controller"),
        (lambda: el.TransferFunction.from_zeros([1j], [-1.0, -2.0]), "zeros must be real or come in"),
        (lambda: el.TransferFunction.from_zeros([-1.0], []), "zeros must not be more than the poles"),
        (lambda: jr.linear.control_loops(rigid(WHOLE), [10.0], bearings="abm"), "did you mean"),
        (lambda: jr.linear.control_loops(rigid(WHOLE), [0.0]), "frequencies must be"),
        (lambda: jr.standards.peak_sensitivity(rigid(WHOLE), "amb.x"), "amb.x"),
        (lambda: jr.linear.control_loops(
            rigid(el.MagneticBearing(LINEAR, el.PID(0.9 * KS / KI))), [9.0], at="undeformed"),
         "the closed loop is not stable"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told(make, words):
    with pytest.raises(jr.InputError, match=words):
        make().check()


# Figures, and what moves the numbers


def test_figures_of_the_loops(loops):
    """What is drawn is what was found."""
    hertz = np.asarray(loops.frequencies) / (2 * np.pi)
    panel = loops.plot()
    np.testing.assert_allclose(panel.lines[0].get_data(), (hertz, loops.decibels[:, 0]))
    assert f"{np.max(loops.decibels):.1f} dB" in panel.lines[0].get_label()
    near = loops.plot.nyquist()
    rings, L = near.lines[:3], np.asarray(loops.open_loop)[:, 0]
    for ring, end in zip(rings, (3.0, 4.0, 5.0)):
        x, y = np.asarray(ring.get_data())
        np.testing.assert_allclose(np.hypot(x + 1, y), 1 / end)
    np.testing.assert_allclose(near.lines[3].get_data(), (L.real, L.imag))
    size, phase = loops.plot.bode()
    np.testing.assert_allclose(size.lines[0].get_ydata(), 20 * np.log10(np.abs(L)))
    shown = np.asarray(phase.lines[0].get_ydata())
    there = ~np.isnan(shown)
    np.testing.assert_allclose(shown[there], np.rad2deg(np.angle(L))[there])
    assert there.sum() > 55


def test_what_moves_the_peak(pair):
    """As `jaxrotor assess` tells it: what differences of the peak tell, of a controller, a magnet, the rotor
    and the place of a sensor."""
    from jaxrotor.standards.moves import of_sensitivity
    from jaxrotor.standards.sensitivities import derivatives

    def peak(machine):
        return jr.standards.peak_sensitivity(machine, "middle.w", 150.0, at="undeformed")

    there = peak(pair)
    moves = of_sensitivity(pair, "middle.w", 150.0, "undeformed", float(there.frequency))
    (found,) = derivatives([moves])
    for path in (
        "middle.controller.derivative",
        "left.magnet.displacement_stiffness",
        "rotor.transverse_inertia",
    ):
        value = float(pair.get(path))
        ends = [float(peak(pair.set({path: value * (1 + d)})).value) for d in (-1e-4, 1e-4)]
        assert found[path] == pytest.approx((ends[1] - ends[0]) / (2e-4 * value), rel=1e-5)
    ends = [
        float(peak(pair.set({"rotor.ends[1]": ENDS[1] * (1 + d)})).value) for d in (-1e-4, 1e-4)
    ]
    assert found["rotor.ends"][1] == pytest.approx((ends[1] - ends[0]) / (2e-4 * ENDS[1]), rel=1e-5)


def test_loops_inside_a_program():
    """Under `jit` what they are outside, with the slope of the sensitivity by a gain: -S² dL/dkd."""
    bearing = el.MagneticBearing(LINEAR, el.PID(KP, KD, 5e3), el.CurrentAmplifier(bandwidth=1e3))
    machine, w = rigid(bearing), jnp.array([200.0, 900.0])

    def entry(kd):
        changed = machine.set({"amb.controller.derivative": kd})
        return jr.linear.control_loops(changed, w, at="undeformed").matrix[:, 0, 0]

    value, slope = jr.jit(lambda kd: jax.jvp(entry, (kd,), (jnp.ones(()),)))(KD)
    s = 1j * np.asarray(w)
    lag = KI / (M * s**2 - KS) * (2e3 * np.pi) / (s + 2e3 * np.pi)
    S = 1 / (1 + lag * pid(s))
    np.testing.assert_allclose(value, S, rtol=1e-9)
    np.testing.assert_allclose(slope, -(S**2) * lag * s / (1 + s / LAG), rtol=1e-8)


def test_an_axis_is_named_in_a_study():
    from jaxrotor.study.read_standards import read_standards

    asked = {"speeds": ["100 rpm", "900 rpm"], "magnetic": [{"name": "amb"}, {"name": "amb.w"}]}
    assert [one.name for one in read_standards(asked, rigid(WHOLE)).magnetic] == ["amb", "amb.w"]
    asked["magnetic"] = [{"name": "amb.x"}]
    with pytest.raises(jr.InputError, match="name names no such part"):
        read_standards(asked, rigid(WHOLE))
