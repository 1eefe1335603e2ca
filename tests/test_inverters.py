"""Drives on inverters: torque ripple, and the loop that sets the torque, in closed form."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from apart import apart
from helpers import pull

import jaxrotor as jr
from jaxrotor.elements import PI, ActiveTorque, Actuator, InverterDrive, SpeedError, TorqueRipple

PAIRS, ORDERS = 2, (6.0, 12.0)
SPEEDS, TABLE = [50.0, 150.0], [[30.0, 12.0], [20.0, 6.0]]
HELD = ("x", "y", "z", "psi", "theta")
J, K, C = (1.5, 4.0), 2.5e4, 8.0
KP, KI, LAG = 6.0, 40.0, 300.0
SETPOINT, LOAD = 100.0, 55.0


def moving(angle, speed):
    return np.eye(6)[5] * angle, np.eye(6)[5] * speed


def coupling():
    return jr.Coupling([0, 0, 0, 0, 0, K], [0, 0, 0, 0, 0, C])


def test_ripple_by_angle_and_speed():
    """Six and twelve periods in one of the electrical angle, straight between two rows of the table."""
    one = TorqueRipple(ORDERS, SPEEDS, TABLE, (0.3, -0.8), jr.Step(1.0, 1.0), PAIRS)
    angles, cases = (
        2 * np.pi * np.arange(64) / 64,
        {100.0: (25.0, 9.0), 20.0: TABLE[0], 900.0: TABLE[1]},
    )
    unit = jnp.eye(6)[5]

    @jax.jit
    def over_a_turn(speed):
        def torque(a):
            return one.forces(jnp.asarray(2.0), ((a * unit, speed * unit),), None)[0]

        return jax.vmap(torque)(angles)

    for speed, amplitudes in cases.items():
        found = np.asarray(over_a_turn(speed))
        assert not np.any(found[:, :5])
        lines = np.fft.rfft(found[:, 5]) / 32
        expected = np.zeros(33, complex)
        expected[6 * PAIRS] = amplitudes[0] * np.exp(0.3j)
        expected[12 * PAIRS] = amplitudes[1] * np.exp(-0.8j)
        np.testing.assert_allclose(lines, expected, atol=1e-12 * amplitudes[0])
    assert not np.any(pull(one, moving(0.4, 100.0), t=0.5))


def test_response_to_ripple_at_each_order():
    """A motor behind a shaft on an end that turns evenly: torque in the shaft over speed, each order with
    its amplitude there; the first meets the mode at f/(6 p)."""
    ripple = TorqueRipple(ORDERS, SPEEDS, TABLE, pole_pairs=PAIRS)
    machine = jr.Machine.in_line(
        {
            "motor": jr.Rotor(1.0, J[0], J[0]),
            "shaft": coupling(),
            "end": jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
        },
        {"ripple": (ripple, "motor")},
        fixed={"motor": HELD},
    )
    natural = np.sqrt(K / J[0])
    speeds = np.array([60.0, natural / (6 * PAIRS), 100.0])
    orders = tuple(PAIRS * np.array(ORDERS))
    found = np.asarray(jr.order_response(machine, "shaft.torque", speeds, orders).values)[:, :, 0]
    for k, order in enumerate(orders):
        w = order * speeds
        amplitude = np.interp(speeds, SPEEDS, np.array(TABLE)[:, k])
        expected = amplitude * (K + 1j * C * w) / (K - J[0] * w**2 + 1j * C * w)
        np.testing.assert_allclose(np.abs(found[:, k]), np.abs(expected), rtol=1e-8)
    assert np.abs(found[:, 0]).argmax() == 1
    # the linear machine is that without the ripple
    model = jr.linearize(machine, 100.0)
    np.testing.assert_allclose(np.abs(np.linalg.eigvals(model.A)), natural, rtol=1e-3)


def drive(shares=(0.04, 0.01), limit=None, **changes):
    actuator = Actuator(bandwidth=LAG, limit=limit)
    given = dict(actuator=actuator, pole_pairs=PAIRS) | changes
    return InverterDrive(PI(KP, KI), SpeedError(SETPOINT), ORDERS, shares, **given)


def driven(one, at="motor"):
    return jr.Machine.in_line(
        {
            "motor": jr.Rotor(1.0, J[0], J[0]),
            "shaft": coupling(),
            "load": jr.Rotor(1.0, J[1], J[1]),
        },
        {"drive": (one, at), "load torque": (jr.Torque(-LOAD), "load")},
        fixed={"motor": HELD, "load": HELD},
    )


def matrix(encoder=0):
    """Of the twist (load less motor), both speeds, the integral's share, and the torque behind its lag."""
    A = np.zeros((5, 5))
    A[0, 1:3] = -1, 1
    A[1] = [K / J[0], -C / J[0], C / J[0], 0, 1 / J[0]]
    A[2] = [-K / J[1], C / J[1], -C / J[1], 0, 0]
    A[3, 1 + encoder] = -KI
    A[4, 3:] = LAG, -LAG
    A[4, 1 + encoder] = -LAG * KP
    return A


def steady(one):
    """The machine as it runs at the setpoint under its load."""
    q, v = np.zeros((2, 6)), np.zeros((2, 6))
    v[:, 5], q[1, 5] = SETPOINT, -LOAD / K
    return jr.State(q, v, jnp.array([LOAD, LOAD]))


def sorted_values(A):
    found = np.linalg.eigvals(np.asarray(A))
    return found[np.lexsort((found.imag.round(6), found.real.round(6)))]


@pytest.mark.parametrize("encoder", [0, 1])
def test_the_loop_closes_over_the_shaft(encoder):
    """Eigenvalues of both masses, the integral and the lag: the speed of the motor fed back damps the shaft's
    mode, that of the load drives it."""
    one = eqx.tree_at(lambda d: d.measured, drive(), SpeedError(SETPOINT, station=encoder))
    machine = driven(one, ("motor", "load"))
    found = sorted_values(jr.linearize(machine, SETPOINT, at=steady(one)).A)
    expected = sorted_values(matrix(encoder))
    turning = np.abs(found) > 1e-6  # the angle of the whole has no spring
    np.testing.assert_allclose(found[turning], expected, rtol=1e-6)
    mode = expected[np.abs(np.abs(expected) - 150).argmin()]
    free = -C / 2 * (1 / J[0] + 1 / J[1])
    assert abs(mode.imag) > 100
    assert mode.real < 1.2 * free if encoder == 0 else mode.real > 0.9 * free


def test_forced_vibration_with_the_loop_closed():
    """Ripple is a part of the torque that is given; the loop answers to the vibration that it makes."""
    one = drive()
    found = jr.order_response(
        driven(one), "shaft.torque", [SETPOINT], (6.0 * PAIRS, 12.0 * PAIRS), at=steady(one)
    )
    for k, (order, share) in enumerate(zip(ORDERS, (0.04, 0.01))):
        w = order * PAIRS * SETPOINT
        push = np.zeros(5)
        push[1] = share * LOAD / J[0]
        x = np.linalg.solve(1j * w * np.eye(5) - matrix(), push)
        expected = K * x[0] + C * (x[2] - x[1])
        assert np.abs(found.values[0, k, 0]) == pytest.approx(abs(expected), rel=1e-6)


@pytest.mark.parametrize("limit", [None, 40.0])
def test_what_reaches_the_shaft(limit):
    """The torque of the same loop as `ActiveTorque`, and its ripple."""
    one = drive(limit=limit, phases=(0.2, 0.5), actuator=Actuator(limit=limit), cutoff=80.0)
    plain = ActiveTorque(PI(KP, KI), SpeedError(SETPOINT), Actuator(limit=limit), cutoff=80.0)
    state = jnp.array([-9.0, 4.0, 25.0])
    motion, angle = moving(0.31, 93.0), 0.31 * PAIRS
    own, other = (pull(x, motion, t=0.1, state=state)[0, 5] for x in (one, plain))
    factor = 1 + 0.04 * np.cos(6 * angle + 0.2) + 0.01 * np.cos(12 * angle + 0.5)
    assert own == pytest.approx(factor * other, rel=1e-13)
    now = jnp.asarray(0.1), (motion,)
    np.testing.assert_array_equal(one.rates(*now, (), state), plain.rates(*now, (), state))
    assert float(one.ripple(*now, state)) == pytest.approx((factor - 1) * other, rel=1e-12)
    assert float(one.wanted(*now, state)) == pytest.approx(25.0 + KP * 9.0, rel=1e-12)
    assert float(one.power(*now, state)) == pytest.approx(own * 93.0, rel=1e-12)
    assert np.abs(other) < 40.0 if limit else other > 60.0


@pytest.mark.parametrize(
    "one, words",
    [
        (
            TorqueRipple(ORDERS, SPEEDS, [[1.0], [2.0]]),
            "orders and amplitudes must be equally long",
        ),
        (
            TorqueRipple(ORDERS, SPEEDS, TABLE, (0.1,)),
            "orders and phases must be equally long, but",
        ),
        (TorqueRipple(ORDERS, [2.0, 1.0], TABLE), "speeds must increase"),
        (drive(shares=(0.1,)), "orders and shares must be equally long, but have 2 and 1 entries"),
    ],
)
def test_rows_that_do_not_fit_are_refused(one, words):
    with pytest.raises(jr.InputError, match=words):
        apart({"m": one}, 1.0)
