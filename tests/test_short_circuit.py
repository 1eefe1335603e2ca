"""Short circuits, reclosing and the start of a synchronous motor: against the flux equations of electrical
machines, closed forms and the balance of energy."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from apart import apart, spinning
from helpers import assert_derivatives_agree
from scipy.linalg import expm
from test_schedules import monotone

import jaxrotor as jr
from jaxrotor.profiles import Reclosing, ShortCircuit, short_circuit_amplitude

LINE, W, PAIRS = 60.0, 2 * np.pi * 60.0, 2
LS, LM, LR = 0.0713, 0.0693, 0.0713
PEAK = 179.6  # V, of a phase
LOSSLESS = 1e-8  # ohm: fluxes stay
SYNCHRONOUS = W / PAIRS
SHORT = LS - LM**2 / LR  # H: what a short circuit sees
FLUX = PEAK / W  # V s, of the stator at no load
REACTANCE = W * SHORT / (PEAK / 10.0)  # per unit of 10 A
RATED = 1.5 * PEAK * 10.0  # V A


def motor(resistance=LOSSLESS, voltage=0.0):
    return jr.InductionMotor(resistance, resistance, LS, LR, LM, voltage, LINE, PAIRS)


def torque_after(machine, start, times):
    """N·m of an `InductionMotor` at synchronous speed, from its fluxes at t = 0."""
    motion = (jnp.zeros(6), jnp.zeros(6).at[5].set(SYNCHRONOUS))

    def rates(z):
        return machine.rates(jnp.zeros(()), (motion,), None, z)

    zero = jnp.zeros(4)
    A, b = np.asarray(jax.jacfwd(rates)(zero)), np.asarray(rates(zero))
    whole = np.zeros((5, 5))
    whole[:4, :4], whole[:4, 4] = A, b
    fluxes = [expm(whole * t)[:4] @ np.append(start, 1.0) for t in times]
    return np.array([machine.torque(jnp.zeros(()), (motion,), jnp.asarray(z)) for z in fluxes])


def amplitude():
    """Behind the locked rotor's reactance stands the rotor's flux: at no load Lm/Lr of it is the share of
    the stator's flux that is left when the currents of the rotor are none."""
    full = float(short_circuit_amplitude(RATED, SYNCHRONOUS, REACTANCE))
    assert full == pytest.approx(1.5 * PAIRS * FLUX**2 / SHORT, rel=1e-12)
    return full * LM**2 / (LS * LR)


TIMES = np.linspace(0.0, 2.5 / LINE, 60)


def at(schedule, times):
    return np.asarray(jax.vmap(schedule.value)(jnp.asarray(times)))


def test_three_phases_shorted():
    """Fluxes of the fifth-order model, shorted at no load: d lies where the flux stood, one quarter behind
    the voltage."""
    stator = np.array([0.0, -FLUX])
    start = np.concatenate([stator, LM / LS * stator])
    found = torque_after(motor(), start, TIMES)
    closed = at(ShortCircuit.three_phase(0.0, LINE, amplitude(), decay=1e6), TIMES)
    np.testing.assert_allclose(closed, found, atol=1e-6 * amplitude())
    assert found[1] < 0  # it brakes first
    # decay: both fluxes', with L''/R each; what is left is of the order of the square of R/(w L'')
    resistance = 0.01
    found = torque_after(motor(resistance), start, TIMES)
    rate = resistance / SHORT + resistance / (LR - LM**2 / LS)
    closed = at(ShortCircuit.three_phase(0.0, LINE, amplitude(), decay=1 / rate), TIMES)
    assert np.exp(-rate * TIMES[-1]) < 0.9
    far = 4 * resistance / (W * SHORT)
    np.testing.assert_allclose(closed, found, atol=far * amplitude())


def test_two_phases_shorted():
    """One winding of two axes closed (its flux is held), the other open, and a flux that turns behind L'':
    voltages from Faraday's law, torque from the power that the winding takes from the rotor's turning."""
    schedule = ShortCircuit.two_phase(0.0, LINE, 100.0, decay=1e6)
    s = np.linspace(0.0, 1.0 / LINE, 20001)
    turning = W * s + np.pi / 2  # zero of the voltage of the closed winding: its flux at the crest
    behind = np.stack([np.cos(turning), np.sin(turning)])
    current = behind[1, 0] - behind[1]  # L'' i + psi'' = const, in parts of Psi/L''
    # the power that turning moves into the winding: -i dpsi''/dt, and torque times speed takes it
    power = -current * np.gradient(behind[1], s, edge_order=2)
    expected = -100.0 * power / W
    np.testing.assert_allclose(at(schedule, s)[1:-1], expected[1:-1], atol=1e-4)
    peak = np.abs(at(schedule, s)).max()
    assert peak == pytest.approx(100 * 3 * np.sqrt(3) / 4, rel=1e-6)


@pytest.mark.parametrize("degrees", [0.0, 40.0, 120.0, -120.0])
def test_reclosing_out_of_phase(degrees):
    """The fifth-order model, its stator open until then, thrown on a line that lags by the angle."""
    angle = np.deg2rad(degrees)
    # open: no stator current, so psi_s = Lm/Lr psi_r; its voltage is as high as the line's
    stator = FLUX * np.array([np.cos(angle - np.pi / 2), np.sin(angle - np.pi / 2)])
    start = np.concatenate([stator, LR / LM * stator])
    found = torque_after(motor(voltage=PEAK), start, TIMES)
    full = float(short_circuit_amplitude(RATED, SYNCHRONOUS, REACTANCE))
    closed = Reclosing(-0.3, -0.2, 0.0, LINE, full, angle, decay=1e6, mean_decay=1e6)
    np.testing.assert_allclose(at(closed, TIMES), found, atol=1e-6 * full)
    if degrees == 120.0:
        worst = np.sin(angle) + 2 * np.sin(angle / 2)
        assert np.abs(at(closed, np.linspace(0, 0.02, 4001))).max() == pytest.approx(
            full * worst, rel=1e-5
        )


def test_a_reclosing_has_three_dates():
    one = Reclosing(0.1, 0.18, 0.5, LINE, 500.0, 2.0, -250.0, 0.2, 0.3, 80.0)
    np.testing.assert_allclose(one.jumps(), [0.1, 0.18, 0.5])
    early, cut, closed, late = at(one, [0.05, 0.3, 0.5, 9.0])
    assert early == 80.0 and cut == 0.0
    assert closed == pytest.approx(0.0, abs=1e-9)  # the fluxes are what they were
    assert late == pytest.approx(80.0, abs=1e-6)
    fault = ShortCircuit(0.1, LINE, 500.0, -250.0, 0.2, before=80.0, mean_decay=0.3)
    np.testing.assert_allclose(at(one, [0.1, 0.13, 0.17]), at(fault, [0.1, 0.13, 0.17]))
    assert float(one.top_frequency()) == pytest.approx(2 * W)
    plain = ShortCircuit.three_phase(0.1, LINE, 500.0)
    assert float(plain.top_frequency()) == pytest.approx(W)
    with pytest.raises(jr.InputError, match="clearing_time must be after fault_time, 0.3 s"):
        apart({"m": jr.Torque(Reclosing(0.3, 0.2, 0.5, LINE, 1.0))}, 1.0).check()


@pytest.mark.parametrize(
    "schedule",
    [
        ShortCircuit(0.1, LINE, 500.0, -250.0, 0.2, 0.1, 80.0, -4.0, 0.15),
        Reclosing(0.1, 0.18, 0.25, LINE, 500.0, 2.0, -250.0, 0.2, 0.3, 80.0),
    ],
)
def test_derivatives_by_all_numbers(schedule):
    """At instants in each piece, before it too, where exp(-s/decay) must not overflow."""
    leaves, tree = jax.tree.flatten(schedule)
    times = jnp.array([-400.0, 0.05, 0.14, 0.2, 0.31])

    def values(x):
        own = jax.tree.unflatten(tree, list(x))
        return jax.vmap(own.value)(times)

    assert_derivatives_agree(values, jnp.stack(leaves), rtol=1e-6, step=1e-5)


# The start of a synchronous motor

POLES = 2
NS = 2 * np.pi * LINE / POLES  # 1800 rpm
SPEEDS = np.linspace(0.0, NS, 7)
MEANS = np.array([900.0, 850.0, 800.0, 850.0, 950.0, 700.0, 0.0])
SWINGS = np.array([500.0, 480.0, 450.0, 430.0, 480.0, 560.0, 650.0])
START = jr.elements.SynchronousStart(SPEEDS, MEANS, SWINGS, LINE, pole_pairs=POLES)


def test_the_resonance_in_a_start():
    """At 60 Hz, 1800 rpm, a mode of 20 Hz is met at 1500 rpm: there the torque pulsates 20 times a second."""
    rpm = np.pi / 30
    assert float(START.synchronous_speed) == pytest.approx(1800 * rpm)
    speed = 1500 * rpm
    t = np.arange(4000) / 4000.0

    def torque(t):
        q, v = (jnp.zeros(6).at[5].set(x) for x in (speed * t, speed))
        return START.forces(t, ((q, v),), None)[0][5]

    seen = np.asarray(jax.vmap(torque)(jnp.asarray(t)))
    spectrum = np.abs(np.fft.rfft(seen)) / len(t) * 2
    assert spectrum[1:].argmax() + 1 == 20
    assert speed == pytest.approx(SPEEDS[5])
    assert spectrum[20] == pytest.approx(SWINGS[5], rel=1e-9)
    assert spectrum[0] / 2 == pytest.approx(MEANS[5], rel=1e-9)


def test_a_start_gains_what_its_torque_does_of_work():
    """A free rotor: J w²/2 is the integral of the torque over the angle, its pulsation with it; and behind a
    date the motor is off."""
    off = 0.9
    drive = jr.elements.SynchronousStart(
        SPEEDS, MEANS, SWINGS, LINE, 0.3, jr.Step(off, 0.0, 1.0), POLES
    )
    machine = apart({"m": drive}, 6.0, fixed=("x", "y", "z", "psi", "theta"))
    run = jr.simulate(machine, 1.2, 5000.0, spinning([0.0]), solver=diffrax.Dopri8(), step=2e-4)
    torque = np.asarray(run["m: SynchronousStart"].torque)
    w, t = np.asarray(run["m"].speed), np.asarray(run.t)
    # Simpson's rule over the samples in which it is on
    on = int(round(off * 5000))
    weights = np.r_[1, np.tile([4, 2], on // 2 - 1), 4, 1] / 3 / 5000
    power = (torque * w)[: on + 1]
    power[-1] = power[-2] * 3 - power[-3] * 3 + power[-4]  # the sample at the date has it off
    assert weights @ power == pytest.approx(3.0 * w[on] ** 2, rel=1e-6)
    np.testing.assert_allclose(w[on:], w[on], rtol=1e-12)
    assert w[on] > 0.6 * NS and t[on] == pytest.approx(off)
    audit = jr.energy_audit(machine, 1.2, 1000.0, spinning([0.0]), step=2e-4)
    assert float(audit.relative) < 1e-6


def test_a_short_circuit_in_a_run():
    """Two discs that hang on a spring, one of them struck: against the convolution with damped sines, in
    closed form by the matrix exponential of the whole; the step lands on the date of the fault."""
    J, k, c = (2.0, 3.0), 8e4, 20.0
    fault = ShortCircuit.two_phase(0.0123, LINE, 400.0, 0.15, 0.09)
    held = ("x", "y", "z", "psi", "theta")
    machine = jr.Machine.in_line(
        {
            "a": jr.Rotor(1.0, J[0], J[0]),
            "shaft": jr.Coupling([0] * 5 + [k], [0] * 5 + [c]),
            "b": jr.Rotor(1.0, J[1], J[1]),
        },
        {"grid": (jr.Torque(fault), "a")},
        fixed={"a": held, "b": held},
    )
    run = jr.simulate(machine, 0.4, 1000.0, spinning([SYNCHRONOUS] * 2), step=1e-4)
    # states: twist, its rate, and e^(-s/d) (sin, cos) of both frequencies
    reduced = J[0] * J[1] / sum(J)
    A = np.zeros((6, 6))
    A[0, 1] = 1.0
    A[1, :2] = -k / reduced, -c / reduced
    for at_, w, decay, level in ((2, W, 0.15, -400.0), (4, 2 * W, 0.09, 200.0)):
        A[at_, at_], A[at_, at_ + 1] = -1 / decay, w
        A[at_ + 1, at_], A[at_ + 1, at_ + 1] = -w, -1 / decay
        A[1, at_] = -level / J[0]  # twist = b - a
    first = np.array([0, 0, 0, 1.0, 0, 1.0])
    t = np.asarray(run.t)
    x = np.array([expm(A * max(s - 0.0123, 0.0)) @ first for s in t])
    x[t < 0.0123, :2] = 0.0
    expected = k * x[:, 0] + c * x[:, 1]
    found = np.asarray(run["shaft"].torque)
    np.testing.assert_allclose(found, expected, atol=2e-5 * np.abs(expected).max())
    assert np.abs(expected).max() > 150.0
    # the same on a rotor beside a given spin; a motor that starts there pulsates by the slip that is given
    driven = jr.Machine.in_line(
        {
            "a": jr.Rotor(1.0, J[0], J[0]),
            "shaft": jr.Coupling([0] * 5 + [k], [0] * 5 + [c]),
            "end": jr.PrescribedSpin(jr.ConstantSpeed(0.9 * SYNCHRONOUS)),
        },
        {"grid": (jr.Torque(fault), "a"), "motor": (START, "end")},
        fixed={"a": held},
    )
    run = jr.simulate(driven, 0.2, 1000.0, step=1e-4)
    lag = 2 * (W - POLES * SYNCHRONOUS * 0.9) * np.asarray(run.t)
    at_speed = [float(monotone(SPEEDS, y)(0.9 * SYNCHRONOUS)) for y in (MEANS, SWINGS)]
    np.testing.assert_allclose(
        run["motor"].torque, at_speed[0] + at_speed[1] * np.cos(lag), rtol=1e-9
    )
    np.testing.assert_allclose(
        np.asarray(run["end"].reaction)[:, 5],
        -np.asarray(run["motor"].torque) + np.asarray(run["shaft"].torque),
        atol=1e-6,
    )
    A[1, :2] = -k / J[0], -c / J[0]
    t = np.asarray(run.t)
    x = np.array([expm(A * max(s - 0.0123, 0.0)) @ first for s in t])
    x[t < 0.0123, :2] = 0.0
    expected = k * x[:, 0] + c * x[:, 1]
    found = np.asarray(run["shaft"].torque)
    np.testing.assert_allclose(found, expected, atol=2e-5 * np.abs(expected).max())


def test_the_damage_of_a_fault_has_a_derivative():
    """By stiffness and damping of the shaft and the amplitude of the fault, through the run: forward, reverse
    and central differences."""
    held = ("x", "y", "z", "psi", "theta")
    curve = jr.standards.SNCurve([400.0, 100.0], [1e3, 1e6], of="torque")
    machine = jr.Machine.in_line(
        {
            "a": jr.Rotor(1.0, 2.0, 2.0),
            "shaft": jr.Coupling([0] * 5 + [8e4], [0] * 5 + [20.0]),
            "b": jr.Rotor(1.0, 3.0, 3.0),
        },
        {"grid": (jr.Torque(ShortCircuit.two_phase(0.0123, LINE, 400.0)), "a")},
        fixed={"a": held, "b": held},
    )
    unit = jnp.array([0.0, 0, 0, 0, 0, 1])

    def damage(x):
        other = machine.set(
            {
                "shaft.stiffness": 8e4 * x[0] * unit,
                "shaft.damping": 20.0 * x[1] * unit,
                "grid.value.fundamental": 400.0 * x[2],
            }
        )
        run = jr.simulate(other, 0.12, 2000.0, spinning([0.0] * 2), step=5e-4)
        torque = jr.standards.shaft_torque(run, "shaft")
        return jnp.log(jr.standards.cycle_damage(torque, curve))

    slopes = assert_derivatives_agree(damage, np.ones(3), rtol=1e-6, step=1e-4)
    assert slopes[1] < 0 < slopes[2]


def test_slip_is_no_order_of_the_shaft():
    """The pulsation of a start laps the field, so it answers at no order of the speed; the linear model has
    the mean torque's slope alone."""
    held = ("x", "y", "z", "psi", "theta")
    machine = jr.Machine.in_line(
        {
            "m": jr.Rotor(1.0, 2.0, 2.0),
            "shaft": jr.Coupling([0] * 5 + [8e4], [0] * 5 + [20.0]),
            "f": jr.Rotor(1.0, 3.0, 3.0),
        },
        {"motor": (START, "m")},
        fixed={"m": held, "f": held},
    )
    found = jr.order_response(machine, "shaft.torque", [100.0], (1.0, 4.0), at="undeformed")
    np.testing.assert_allclose(found.values, 0.0, atol=1e-9)
    model = jr.linearize(machine, 100.0, at="undeformed")
    np.testing.assert_allclose(model.K.sum(), 0.0, atol=1e-6)
    slope = float(model.C.sum())

    def mean(v):
        return START.nominal().torque(0.0, ((jnp.zeros(6), jnp.zeros(6).at[5].set(v)),), None)

    assert slope == pytest.approx(-float(jax.grad(mean)(100.0)), rel=1e-9)
