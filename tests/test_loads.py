"""Loads, brakes, engines, governors and supports: against closed forms, quadrature and scipy."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from apart import apart, spinning
from helpers import assert_derivatives_agree, at_instants, pull
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from test_schedules import monotone

import jaxrotor as jr
from jaxrotor.core.protocol import NonSmooth
from jaxrotor.simulation.ranges import tell_ranges

J, END, RATE = 0.02, 0.5, 50.0

DRIVE, FAN = 3.0, 2e-4
CURVE = np.array([-60.0, 0.0, 30.0, 80.0, 150.0]), np.array([12.0, 4.5, 1.5, -1.2, -18.0])
BRAKE, REVERSAL = 1.0, 2.0
FALL = jr.Step(0.213, 0.0, BRAKE)
MEAN, ORDERS, AMPLITUDES, PHASES = 2.0, (0.5, 1.0, 3.0), (1.0, 4.0, -1.5), (0.2, -0.4, 1.1)
CUT = 0.317  # s, when the throttle shuts
KP, KI, LIMIT, BACK, SETPOINT = 0.6, 9.0, 2.0, 12.0, 40.0

LINE = {
    "fan": (jr.FanLoad(FAN), jr.Torque(DRIVE)),
    "curve": jr.SpeedTorque(*CURVE),
    "brake": jr.Brake(BRAKE, REVERSAL),
    "backward": jr.Brake(BRAKE, REVERSAL),
    "released": jr.Brake(FALL, REVERSAL),
    "engine": jr.EngineTorque(MEAN, ORDERS, AMPLITUDES, PHASES, jr.Step(CUT, 0.0, 1.0)),
    "free": jr.SpeedGovernor(SETPOINT, KP, KI, torque_limit=1e3),
    "limited": jr.SpeedGovernor(SETPOINT, KP, KI, LIMIT, BACK),
}
START = dict(zip(LINE, (0.0, -50.0, 20.0, -20.0, 20.0, 5.0, 0.0, 0.0)))


@pytest.fixture(scope="module")
def run():
    machine = apart(LINE, J)
    start = spinning(list(START.values()))
    return jr.simulate(machine, END, RATE, start, solver=diffrax.Dopri8(), step=2e-4)


def speed(run, name):
    return np.asarray(run[name].velocity[:, 5])


def test_a_fan_is_run_up_along_a_hyperbolic_tangent(run):
    """J w' = T - c w²."""
    expected = np.sqrt(DRIVE / FAN) * np.tanh(np.sqrt(DRIVE * FAN) / J * np.asarray(run.t))
    np.testing.assert_allclose(speed(run, "fan"), expected, rtol=1e-11)
    assert expected[-1] > 0.1 * np.sqrt(DRIVE / FAN)


def test_a_fan_brakes_either_sense():
    for w in (7.0, -7.0):
        force = pull(jr.FanLoad(FAN), (np.zeros(6), np.full(6, w)))
        np.testing.assert_allclose(force, [[0, 0, 0, 0, 0, -FAN * w * 7]], rtol=1e-14)


def test_a_table_of_torque_over_speed(run):
    torque = monotone(*CURVE)
    t = np.asarray(run.t)
    oracle = solve_ivp(
        lambda t, w: torque(w) / J, (0, END), [-50.0], "DOP853", t, rtol=1e-12, atol=1e-12
    )
    np.testing.assert_allclose(speed(run, "curve"), oracle.y[0], rtol=0, atol=2e-8)
    assert oracle.y[0, -1] > 25  # it went through three pieces of the curve


@pytest.mark.parametrize("name", ["brake", "backward"])
def test_a_brake_brings_it_to_rest(run, name):
    """J w' = -T tanh(w/wr), so sinh(w/wr) falls as exp(-T t/(J wr))."""
    fall = np.exp(-BRAKE * np.asarray(run.t) / (J * REVERSAL))
    expected = REVERSAL * np.arcsinh(np.sinh(START[name] / REVERSAL) * fall)
    np.testing.assert_allclose(speed(run, name), expected, rtol=1e-9, atol=1e-12)
    assert abs(expected[-1]) < 0.5


def test_a_brake_that_is_released(run):
    t = np.minimum(np.asarray(run.t), 0.213)
    fall = np.exp(-BRAKE * t / (J * REVERSAL))
    expected = REVERSAL * np.arcsinh(np.sinh(20.0 / REVERSAL) * fall)
    np.testing.assert_allclose(speed(run, "released"), expected, rtol=1e-9)
    assert expected[-1] > 9


def test_an_engine_turns_its_torques_work_into_speed(run):
    """J w²/2 gains the integral of the torque over the crank angle, until the throttle shuts."""
    phi, w, t = np.asarray(run["engine"].phi), speed(run, "engine"), np.asarray(run.t)

    def work(phi):
        waves = [
            a / n * (np.sin(n * phi + p) - np.sin(p)) for n, a, p in zip(ORDERS, AMPLITUDES, PHASES)
        ]
        return MEAN * phi + sum(waves)

    fed = t < CUT
    np.testing.assert_allclose(J * w[fed] ** 2 / 2, J * 25 / 2 + work(phi[fed]), rtol=1e-10)
    assert phi[fed][-1] > 2 * np.pi
    # afterwards it coasts; the angle of the cut is where the coasting line begins
    np.testing.assert_allclose(w[~fed], w[-1], rtol=1e-12)
    cut = phi[-1] - w[-1] * (END - CUT)
    np.testing.assert_allclose(J * w[-1] ** 2 / 2, J * 25 / 2 + work(cut), rtol=1e-10)


def test_a_governor_within_its_limit_is_linear(run):
    """J w' = Kp e + z, z' = Ki e: by the matrix exponential."""
    A = np.array([[-KP / J, 1 / J, KP * SETPOINT / J], [-KI, 0, KI * SETPOINT], [0, 0, 0]])
    expected = np.array([expm(A * t) @ [0, 0, 1] for t in np.asarray(run.t)])
    np.testing.assert_allclose(speed(run, "free"), expected[:, 0], rtol=0, atol=1e-9)
    # the filter of back-calculation does nothing here
    got = run["free: SpeedGovernor"].integral_torque
    np.testing.assert_allclose(got, expected[:, 1], rtol=0, atol=1e-9)


def test_a_governor_at_its_limit(run):
    """At the limit w rises straight, and z obeys a linear law; beyond it, the law from above."""
    w_at_limit, dt = LIMIT / J, 1e-7

    def at_limit(t):  # z' = Ki e + kb (L - Kp e - z), e = setpoint - w1 t
        a, b = KI - BACK * KP, BACK * LIMIT
        # z = A + B t + C exp(-kb t), z(0) = 0
        B = -a * w_at_limit / BACK
        A = (a * SETPOINT + b - B) / BACK
        return A + B * t - A * np.exp(-BACK * t)

    def wanted(t):
        return KP * (SETPOINT - w_at_limit * t) + at_limit(t)

    from scipy.optimize import brentq

    leaves = brentq(lambda t: wanted(t) - LIMIT, 0.05, 0.6, xtol=1e-15)
    assert wanted(leaves + dt) < LIMIT < wanted(leaves - dt)
    t = np.asarray(run.t)
    early = t <= leaves
    np.testing.assert_allclose(speed(run, "limited")[early], w_at_limit * t[early], rtol=1e-11)
    A = np.array([[-KP / J, 1 / J, KP * SETPOINT / J], [-KI, 0, KI * SETPOINT], [0, 0, 0]])
    first = [w_at_limit * leaves, at_limit(leaves), 1]
    late = np.array([expm(A * (s - leaves)) @ first for s in t[~early]])
    assert late.shape[0] > 3 and early.sum() > 3
    # the step across the kink, of 2e-4 s, is what is missing to the rest's precision
    np.testing.assert_allclose(speed(run, "limited")[~early], late[:, 0], rtol=0, atol=1e-6)


def test_back_calculation_lowers_the_overshoot():
    """Without it, z runs on while the drive is at its limit."""
    none, some = (jr.SpeedGovernor(SETPOINT, KP, KI, LIMIT, back) for back in (0.0, BACK))
    assert isinstance(some, NonSmooth)
    default = jr.SpeedGovernor(SETPOINT, KP, KI, LIMIT)
    motion = (jnp.zeros(6), jnp.zeros(6).at[5].set(10.0))
    z = jnp.array([1.5])
    wanted = KP * 30 + 1.5
    for governor, back in ((none, 0.0), (some, BACK), (default, KI / KP)):
        rate = governor.rates(jnp.zeros(()), (motion,), None, z)
        np.testing.assert_allclose(rate, KI * 30 + back * (LIMIT - wanted), rtol=1e-14)
        np.testing.assert_allclose(pull(governor, motion, state=z)[0, 5], LIMIT)
    reverse = (jnp.zeros(6), jnp.zeros(6).at[5].set(500.0))
    np.testing.assert_allclose(pull(some, reverse, state=z)[0, 5], -LIMIT)


# Supports

RNG = np.random.default_rng(5)
STIFF = RNG.normal(size=(6, 6)) + 8 * np.eye(6)
DAMP, OFFSET = RNG.normal(size=(6, 6)), RNG.normal(size=6)
SPEEDS = np.array([10.0, 40.0, 90.0])
TABLES = {
    "diagonals": (RNG.normal(size=(3, 6)), RNG.normal(size=(3, 6))),
    "matrices": (RNG.normal(size=(3, 6, 6)), RNG.normal(size=(3, 6, 6))),
    "mixed": (RNG.normal(size=(3, 6, 6)), RNG.normal(size=(3, 6))),
}


@pytest.mark.parametrize("full", [True, False])
def test_a_support_out_of_line(full):
    k, c = (STIFF, DAMP) if full else (np.diag(STIFF), np.diag(DAMP))
    K, C = (STIFF, DAMP) if full else (np.diag(k), np.diag(c))
    support = jr.LinearSupport(k, c, OFFSET)
    q, v = RNG.normal(size=(2, 6))
    motion = (jnp.asarray(q), jnp.asarray(v))
    force = -K @ (q - OFFSET) - C @ v
    np.testing.assert_allclose(pull(support, motion)[0], force, rtol=1e-12)
    # the power of its force is what it stores and loses less of
    energy, rate = jax.jvp(
        lambda q: support.energy(0.0, ((q, motion[1]),), None), motion[:1], motion[1:]
    )
    np.testing.assert_allclose(
        rate + support.power_lost(0.0, (motion,), None), -force @ v, rtol=1e-12
    )
    np.testing.assert_allclose(energy, 0.5 * (q - OFFSET) @ K @ (q - OFFSET), rtol=1e-12)


def test_a_rotor_rests_where_its_supports_stand():
    """Two supports of unlike offsets: the rotor rests at the mean, weighed by stiffness."""
    k1, k2 = np.array([1e5, 2e5, 3e5, 40, 50, 60.0]), np.array([3e5, 1e5, 2e5, 10, 20, 30.0])
    o1, o2 = 1e-4 * RNG.normal(size=(2, 6))
    machine = jr.Machine.in_line(
        {"r": jr.Rotor(3.0, J, 0.01)},
        attachments={
            "a": (jr.LinearSupport(k1, offset=o1), "r"),
            "b": (jr.LinearSupport(k2, offset=o2), "r"),
        },
    )
    rest = np.array(jr.static_equilibrium(machine).position[0])
    rest[5] += rest[3] * rest[4] / 2  # what holds a turning holds chi
    np.testing.assert_allclose(rest, (k1 * o1 + k2 * o2) / (k1 + k2), rtol=1e-9)


@pytest.mark.parametrize("name", TABLES)
def test_a_speed_dependent_support(name):
    stiffness, damping = TABLES[name]
    support = jr.SpeedDependentSupport(SPEEDS, stiffness, damping)
    assert not isinstance(support, jr.protocols.Energetic)

    def full(table, at):
        flat = table.reshape(3, -1)
        found = np.array([monotone(SPEEDS, column)(at) for column in flat.T])
        return found.reshape(6, 6) if table.ndim == 3 else np.diag(found)

    for w in (0.0, 10.0, 25.0, -25.0, 40.0, 77.0, -300.0):
        q, v = RNG.normal(size=(2, 6))
        v[5] = w
        # the other way round: x, theta and phi as a mirror upright along the shaft shows them
        seen = np.array([-1.0, 1, 1, 1, -1, -1]) if w < 0 else np.ones(6)
        expected = -full(stiffness, abs(w)) @ (seen * q) - full(damping, abs(w)) @ (seen * v)
        expected = seen * expected
        np.testing.assert_allclose(pull(support, (q, v))[0], expected, rtol=1e-11, atol=1e-12)
        # by the speed of another station, on which it does not act
        still = v * np.array([1, 1, 1, 1, 1, 0])
        rotor = RNG.normal(size=6), np.array([0, 0, 0, 0, 0, w])
        found = pull(support, (q, still), rotor)
        expected += seen * (full(damping, abs(w)) @ (seen * (v - still)))
        np.testing.assert_allclose(found, [expected, np.zeros(6)], rtol=1e-11, atol=1e-12)


SEAL = np.zeros((2, 6, 6))
SEAL[:, 0, 0] = SEAL[:, 1, 1] = 1e4
SEAL[:, 0, 1], SEAL[:, 1, 0] = 2e3, -2e3


@pytest.mark.parametrize("speed", [150.0, -150.0])
def test_a_seal_drives_the_whirl_with_the_spin(speed):
    """Cross terms k_xy = -k_yx of a mass on a table, by hand: (lambda² + k/m)² = -(k_xy/m)². The root that
    grows whirls with the spin, whichever way that is, and one table on a pedestal goes by the rotor's
    speed."""
    table = jr.SpeedDependentSupport([50.0, 500.0], SEAL, np.zeros((2, 6)))
    held = ("z", "psi", "theta")
    machine = jr.Machine(
        {"d": jr.Rotor(1.0, 0.01, 0.006), "seal": table}, {"seal": "d"}, fixed={"d": held}
    )
    unstable = max(
        jr.modes(jr.linearize(machine, speed, "undeformed")), key=lambda m: m.eigenvalue.real
    )
    assert unstable.eigenvalue == pytest.approx(np.sqrt(-1e4 + 2e3j), rel=1e-9)
    assert unstable.whirl == pytest.approx(1.0) and unstable.name == "1 forward"


def test_leaving_a_table_is_said():
    """Once for each element, with the speeds outside and the table's."""
    line = {
        "table": jr.SpeedDependentSupport([40.0, 90.0], np.ones((2, 6)), np.ones((2, 6))),
        "load": jr.SpeedTorque([0.0, 90.0], [0.0, -1.0]),
    }
    machine = apart(line, J)
    run = at_instants(
        machine,
        np.zeros((3, 2, 6)),
        np.stack([spinning([w, -w]).velocity for w in (10, 50, 100)]),
        np.arange(3.0),
    )
    with pytest.warns(UserWarning) as said:
        tell_ranges(run)
    assert sorted(str(w.message).split(" rad/s: its")[0] for w in said) == [
        "`load: SpeedTorque`: its table ends at 0 and 90 rad/s, but the run goes to -100",
        "`table: SpeedDependentSupport`: its table ends at 40 and 90 rad/s, but the run goes to 10 and 100",
    ]


# Derivatives

OTHERS = {
    "kloss": jr.KlossMotor(20.0, 0.2, 150.0, jr.Step(1.0, 0.0, 1.0)),
    "support": jr.LinearSupport(STIFF, DAMP, OFFSET),
    "table": jr.SpeedDependentSupport(SPEEDS, *TABLES["mixed"]),
    "dc": jr.DCMotor(0.5, 0.01, 0.3, 24.0),
    "induction": jr.InductionMotor(0.4, 0.8, 0.075, 0.076, 0.07, 180.0, 60.0, pole_pairs=2),
    "opened": jr.InductionMotor(
        0.4, 0.8, 0.075, 0.076, 0.07, 180.0, 60.0, 2, jr.Step(0.0, 0.0, 1.0)
    ),
} | {
    name: jr.elements.SynchronousMachine(
        *(0.01, 0.1, 0.4, 0.25, 0.02, 0.12, 0.3, 0.15, [0.2, 0.1], [0.1, 0.2], 9.0, 150.0, 6.0),
        phase=0.3,
        connected=closed,
        line_fault=joined,
        discharge_resistance=0.1,
        start=0.1 * np.arange(7.0),
    )
    for name, closed, joined in (("synchronous", 1, 0), ("cut off", 0, 0), ("two lines", 0, 1))
}
RIPPLE = (6.0, 12.0), (0.04, 0.01)
OTHERS["ripple"] = jr.elements.TorqueRipple(
    RIPPLE[0], [10.0, 60.0], [[3.0, 2.0], [5.0, 1.0]], (0.1, 0.4), 0.9, pole_pairs=2
)
OTHERS["inverter"] = jr.elements.InverterDrive(
    jr.elements.PI(2.0, 5.0),
    jr.elements.SpeedError(30.0),
    *RIPPLE,
    jr.elements.Actuator(limit=8.0, bandwidth=200.0, delay=1e-3),
    (0.1, 0.4),
)
ELEMENTS = {name: e[0] if isinstance(e, tuple) else e for name, e in LINE.items()} | OTHERS


@pytest.mark.parametrize("name", [n for n in ELEMENTS if n not in ("backward", "released", "free")])
def test_derivatives_by_numbers_and_motion(name):
    """Force and rates by all parameters, the motion and the states; no NaN at rest."""
    element = ELEMENTS[name]
    numbers, rest = eqx.partition(element, eqx.is_array)
    leaves, tree = jax.tree.flatten(numbers)
    states = element.initial().size if hasattr(element, "initial") else 0
    ends = np.cumsum([leaf.size for leaf in leaves])

    def answer(x):
        parts = jnp.split(x, ends)
        own = [p.reshape(leaf.shape) for p, leaf in zip(parts, leaves)]
        part = eqx.combine(jax.tree.unflatten(tree, own), rest)
        q, v, z = parts[-1][:6], parts[-1][6:12], parts[-1][12:]
        forces = part.forces(jnp.asarray(0.1), ((q, v),), z)
        rates = part.rates(jnp.asarray(0.1), ((q, v),), None, z) if states else jnp.zeros(0)
        return jnp.concatenate([*forces, rates])

    given = jnp.concatenate([jnp.ravel(leaf) for leaf in leaves])
    moving = jnp.asarray(np.random.default_rng(2).uniform(0.5, 1.5, 12 + states))
    moving = moving.at[11].set(37.0)  # rad/s: not at a corner of a table or limit
    x = jnp.concatenate([given, moving])
    expected = assert_derivatives_agree(answer, x, rtol=1e-7, step=1e-4)
    at_rest = jnp.concatenate([given, jnp.zeros(12 + states)])
    batch = jax.jit(jax.vmap(jax.jacrev(answer)))(jnp.stack([x, at_rest]))
    np.testing.assert_allclose(batch[0], expected, rtol=1e-9, atol=1e-9)
    assert np.all(np.isfinite(batch))


# Wrong input

WRONG = {
    "`m`: coefficient must be zero or positive, but is -1 N": jr.FanLoad(-1.0),
    "`m`: speeds must increase, but row 2 has 1 rad/s after 2 rad/s": jr.SpeedTorque(
        [2, 1], [1, 1]
    ),
    "`m`: speeds and torques must be equally long": jr.SpeedTorque([1, 2, 3], [1, 1]),
    "`m`: torque must be zero or positive at all times, but is -2 N.m at 1 s": jr.Brake(
        jr.Step(1.0, -2.0, 1.0)
    ),
    "`m`: reversal_speed must be positive, but is 0 rad/s": jr.Brake(1.0, 0.0),
    "`m`: torque.level must be finite, but is nan": jr.Brake(np.nan),
    "`m`: offset must be 6 numbers, but has shape": jr.LinearSupport(np.ones(6), offset=np.ones(3)),
    "`m`: speeds and damping must be equally long, two rows at least, but have 3 and 2": (
        jr.SpeedDependentSupport(SPEEDS, np.ones((3, 6)), np.ones((2, 6)))
    ),
    "`m`: speeds must be zero or positive, but is -1": jr.SpeedDependentSupport(
        [-1, 2], np.ones((2, 6)), np.ones((2, 6))
    ),
    "`m`: stiffness must be n x 6 numbers or n x 6 x 6 numbers": jr.SpeedDependentSupport(
        [1, 2], np.ones((2, 5)), np.ones((2, 6))
    ),
    "`m`: breakdown_slip must be positive, but is 0": jr.KlossMotor(1.0, 0.0, 10.0),
    "`m`: synchronous_speed must not be zero": jr.KlossMotor(1.0, 0.1, 0.0),
    "`m`: inductance must be positive, but is 0 H": jr.DCMotor(1.0, 0.0, 1.0, 1.0),
    "`m`: voltage.level must be a number, but is 'high'": jr.DCMotor(1.0, 1.0, 1.0, "high"),
    "`m`: orders, amplitudes and phases must be equally long, but have 2, 1 and 2": (
        jr.EngineTorque(1.0, [1, 2], [1])
    ),
    "`m`: orders must be positive, but is 0": jr.EngineTorque(1.0, [0], [1]),
    "`m`: torque_limit must be positive, but is -3 N.m": jr.SpeedGovernor(1.0, 1.0, 1.0, -3.0),
    "pole_pairs must be a whole number from 1 to 1000, but is 0": lambda: jr.InductionMotor(
        1.0, 1.0, 0.2, 0.2, 0.1, 100.0, 50.0, pole_pairs=0
    ),
    "`m`: rotor_inductance must be more than the magnetizing inductance, 0.1 H, but is 0.05 H": (
        jr.InductionMotor(1.0, 1.0, 0.2, 0.05, 0.1, 100.0, 50.0)
    ),
}


@pytest.mark.parametrize("words", WRONG)
def test_wrong_parts_are_refused(words):
    with pytest.raises(jr.InputError, match=words):
        wrong = WRONG[words]() if callable(WRONG[words]) else WRONG[words]
        jr.Machine.in_line({"r": jr.Rotor(1.0, J, 0.012)}, attachments={"m": (wrong, "r")})
