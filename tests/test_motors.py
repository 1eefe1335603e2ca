"""Motors: against closed forms, the classical equivalent circuit, and scipy in another frame."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from apart import apart, spinning
from helpers import pull
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import jaxrotor as jr

END, RATE, STEP = 0.4, 500.0, 2e-4

# Krause, Wasynczuk & Sudhoff, Analysis of Electric Machinery, table of induction machines, 60 Hz:
# hp, line voltage, rpm, rs, Xls, XM, Xlr', rr' (ohm)
KRAUSE = {
    3: (220, 1710, 0.435, 0.754, 26.13, 0.754, 0.816),
    500: (2300, 1773, 0.262, 1.206, 54.02, 1.206, 0.187),
    2250: (2300, 1786, 0.029, 0.226, 13.04, 0.226, 0.022),
}
TURN = 2 * np.pi * 60
HP = 745.7  # W


def krause(hp, voltage=None, **changes):
    volts, _, rs, xls, xm, xlr, rr = KRAUSE[hp]
    peak = volts * np.sqrt(2 / 3) if voltage is None else voltage
    numbers = dict(
        stator_resistance=rs,
        rotor_resistance=rr,
        stator_inductance=(xls + xm) / TURN,
        rotor_inductance=(xlr + xm) / TURN,
        magnetizing_inductance=xm / TURN,
        voltage=peak,
        frequency=60.0,
        pole_pairs=2,
    )
    return jr.InductionMotor(**(numbers | changes))


def circuit(volts, rs, xls, xm, xlr, rr, slip, synchronous):
    """Torque (N·m) and stator current (A rms) by the equivalent circuit, one phase at a time."""
    rotor = rr / slip + 1j * xlr
    stator = volts / np.sqrt(3) / (rs + 1j * xls + 1 / (1 / rotor + 1 / (1j * xm)))
    inner = stator * 1j * xm / (rotor + 1j * xm)
    return 3 * abs(inner) ** 2 * rr / slip / synchronous, stator


def settled(motor, speed):
    """The fluxes at a constant speed: the rates are linear in them."""
    motion = (jnp.zeros(6), jnp.zeros(6).at[5].set(speed))

    def rates(z):
        return motor.rates(jnp.zeros(()), (motion,), None, z)

    z = -np.linalg.solve(jax.jacfwd(rates)(jnp.zeros(4)), rates(jnp.zeros(4)))
    return motion, jnp.asarray(z)


# One machine with all of them

KLOSS, OUT = (20.0, 0.15, 100.0), 0.31
R, L, K, V = 0.6, 0.015, 0.4, 60.0
ON, OFF = 0.05, 0.35  # s: the small induction motor is switched on, and blacked out
PEAK = 220 * np.sqrt(2 / 3)
FAN = 3e-4
SOON = 0.25  # s: voltage and frequency of the soft start are whole
SOFT, SWEEP = jr.Ramp(0.0, SOON, PEAK, 25.0), jr.Ramp(0.0, SOON, 60.0, 6.0)
PULSE = jr.PulseTrain(1.0, OFF - ON, PEAK, start=ON)
LINE = {
    "kloss": (jr.KlossMotor(*KLOSS, jr.Step(OUT, 0.0, 1.0)), 0.025),
    "backward": (jr.KlossMotor(20.0, 0.15, -100.0), 0.025),
    "dc": (jr.DCMotor(R, L, K, V), 0.02),
    "small": ((krause(3, PULSE), jr.FanLoad(FAN)), 0.089),
    "locked": (krause(2250), 1e9),
    "soft": ((krause(3, SOFT, frequency=SWEEP), jr.FanLoad(FAN)), 0.089),
}


@pytest.fixture(scope="module")
def run():
    machine = apart({n: e for n, (e, _) in LINE.items()}, [j for _, j in LINE.values()])
    start = spinning(np.zeros(len(LINE)))
    return jr.simulate(machine, END, RATE, start, solver=diffrax.Dopri8(), step=STEP)


def speed(run, name):
    return np.asarray(run[name].velocity[:, 5])


def kloss_time(slip, inertia):
    """When a motor alone has come to `slip`, from rest: J ws/(2 Tk) int (s/sk + sk/s) ds."""
    torque, sk, ws = KLOSS
    return inertia * ws / (2 * torque) * ((1 - slip**2) / (2 * sk) - sk * np.log(slip))


def test_kloss_motor_runs_up_and_is_blacked_out(run):
    w, t = speed(run, "kloss"), np.asarray(run.t)
    on = (t > 0) & (t < OUT)
    np.testing.assert_allclose(kloss_time(1 - w[on] / KLOSS[2], 0.025), t[on], rtol=1e-10)
    assert 70 < w[on][-1] < 100
    np.testing.assert_allclose(w[~on][1:], w[-1], rtol=1e-13)  # no torque afterwards
    assert w[-1] > w[on][-1]  # the last row before the blackout is not yet its speed
    # turned about, it does the same backward
    np.testing.assert_allclose(speed(run, "backward")[on], -w[on], rtol=1e-12)


def test_kloss_torque_at_its_marks():
    torque, sk, ws = KLOSS
    motor = jr.KlossMotor(*KLOSS)

    def at(slip):
        return pull(motor, (np.zeros(6), np.eye(6)[5] * ws * (1 - slip)))[0]

    np.testing.assert_allclose(at(sk), [0, 0, 0, 0, 0, torque], rtol=1e-14)
    np.testing.assert_allclose(at(-sk)[5], -torque, rtol=1e-13)  # a generator
    assert at(0.0)[5] == 0.0
    np.testing.assert_allclose(at(1.0)[5], 2 * torque * sk / (1 + sk**2), rtol=1e-14)


def test_dc_motor_is_the_matrix_exponential(run):
    A = np.array([[0, K / 0.02, 0], [-K / L, -R / L, V / L], [0, 0, 0]])
    expected = np.array([expm(A * t) @ [0, 0, 1] for t in np.asarray(run.t)])
    np.testing.assert_allclose(speed(run, "dc"), expected[:, 0], rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(run["dc: DCMotor"].current, expected[:, 1], rtol=0, atol=1e-8)
    assert np.max(expected[:, 1]) > 60


# Induction motor


def stationary(hp, grid, times, inertia, fan=0.0, corners=()):
    """(speed, torque, stator current) of a motor that starts from rest, in the stator's own frame:
    complex flux linkages. `grid(t)`: the voltage, a phasor that turns; it jumps at `corners`."""
    _, _, rs, xls, xm, xlr, rr = KRAUSE[hp]
    inverse = np.linalg.inv(np.array([[xls + xm, xm], [xm, xlr + xm]]) / TURN)

    def torque_of(y):
        current = inverse @ (y[:2] + 1j * y[2:4])
        return 3.0 * np.imag(np.conj(y[0] + 1j * y[2]) * current[0]), current

    def field(t, y, middle):
        torque, current = torque_of(y)
        w = y[4]
        stator = grid(t, middle) - rs * current[0]
        rotor = -rr * current[1] + 2j * w * (y[1] + 1j * y[3])
        turning = (torque - fan * abs(w) * w) / inertia
        return np.array([stator.real, rotor.real, stator.imag, rotor.imag, turning])

    y, found = np.zeros(5), []
    ends = [0.0, *corners, times[-1]]
    for first, last in zip(ends, ends[1:]):
        inside = times[(times >= first) & (times < last)]
        middle = (first + last) / 2  # tells which piece, where t is at its very end
        piece = solve_ivp(
            field,
            (first, last),
            y,
            "DOP853",
            [*inside, last],
            args=(middle,),
            rtol=1e-11,
            atol=1e-11,
        )
        found += list(piece.y.T[: inside.size])
        y = piece.y[:, -1]
    found = np.array([*found, y])
    torque, current = zip(*(torque_of(y) for y in found))
    return found[:, 4], np.array(torque), np.abs([c[0] for c in current])


def switched(t, middle):
    return PEAK * (ON < middle < OFF) * np.exp(1j * TURN * t)


def swept(t, middle):
    """25 V at 6 Hz to the whole at 60 Hz, straight; the phase is the integral of the frequency."""
    if middle > SOON:
        return PEAK * np.exp(2j * np.pi * (33 * SOON + 60 * (t - SOON)))
    phase = 6 * t + 27 * t**2 / SOON
    return (25 + (PEAK - 25) * t / SOON) * np.exp(2j * np.pi * phase)


@pytest.mark.parametrize(
    "name, grid, corners", [("small", switched, (ON, OFF)), ("soft", swept, (SOON,))]
)
def test_transients_against_the_stators_own_frame(run, name, grid, corners):
    """Switched on at rest with a fan, run up, and shorted at full speed; and a soft start."""
    w, torque, current = stationary(3, grid, np.asarray(run.t), 0.089, FAN, corners)
    motor = run[f"{name}: InductionMotor"]
    np.testing.assert_allclose(speed(run, name), w, rtol=0, atol=1e-7)
    np.testing.assert_allclose(motor.torque, torque, rtol=0, atol=1e-6)
    np.testing.assert_allclose(motor.current, current, rtol=0, atol=1e-6)
    assert np.max(w) > 110 and np.max(torque) > 40 and np.ptp(torque[-20:]) > 1


def test_torque_at_switching_on_swings_with_the_grid(run):
    """A rotor too heavy to move: the torque swings about that of standstill at 60 Hz, for the flux
    of switching on stands still in the stator while the grid's turns."""
    peak = 2300 * np.sqrt(2 / 3)
    _, torque, _ = stationary(
        2250, lambda t, _: peak * np.exp(1j * TURN * t), np.asarray(run.t), 1e9
    )
    ours = np.asarray(run["locked: InductionMotor"].torque)
    np.testing.assert_allclose(ours, torque, rtol=0, atol=1e-4)
    lines = np.abs(np.fft.rfft(ours[:50]))  # the first 0.1 s: lines at 0, 10, ... Hz
    assert np.argmax(lines[1:]) + 1 == 6
    standstill, _ = circuit(2300, *KRAUSE[2250][2:], 1.0, TURN / 2)
    assert np.max(ours) > 3 * standstill and np.min(ours) < 0


@pytest.mark.parametrize("hp", KRAUSE)
def test_settled_torque_and_current_are_the_equivalent_circuits(hp):
    motor, numbers = krause(hp), KRAUSE[hp]
    for slip in (1.5, 1.0, 0.3, 0.05, 0.01, -0.02, -0.3):
        motion, z = settled(motor, (1 - slip) * TURN / 2)
        torque, stator = circuit(numbers[0], *numbers[2:], slip, TURN / 2)
        np.testing.assert_allclose(pull(motor, motion, state=z)[0, 5], torque, rtol=1e-9)
        at = jnp.zeros(()), (motion,), z
        np.testing.assert_allclose(motor.current(*at), np.sqrt(2) * abs(stator), rtol=1e-10)
        drawn = 3 * numbers[0] / np.sqrt(3) * stator.real
        np.testing.assert_allclose(motor.power_in(*at), drawn, rtol=1e-10)
        # settled, nothing is stored: what is drawn is lost or goes to the shaft
        shaft = torque * (1 - slip) * TURN / 2
        np.testing.assert_allclose(motor.power_lost(*at), drawn - shaft, rtol=1e-8)


def test_krauses_500_hp_machine_has_500_hp():
    """At its rated speed of 1773 rpm, which is given to 1 rpm: of 27 rpm slip, 4 %."""
    motion, z = settled(krause(500), 1773 * np.pi / 30)
    power = float(pull(krause(500), motion, state=z)[0, 5]) * 1773 * np.pi / 30
    assert power == pytest.approx(500 * HP, rel=0.02)


def test_without_stator_resistance_it_is_klosss_formula():
    """Breakdown torque 3/2 p (M/Ls)² V²/w1² / (2 L'), slip Rr/(w1 L') with L' = Lr - M²/Ls."""
    motor = krause(3, stator_resistance=0.0)
    ls, lr, m = (
        float(getattr(motor, f"{n}_inductance")) for n in ("stator", "rotor", "magnetizing")
    )
    short = lr - m**2 / ls
    breakdown = 1.5 * 2 * (m / ls * PEAK / TURN) ** 2 / (2 * short)
    kloss = jr.KlossMotor(breakdown, 0.816 / (TURN * short), TURN / 2)
    for slip in np.array([0.2, 0.6, 0.9, 1.0, 1.1, 1.7, -1.0]) * float(kloss.breakdown_slip):
        motion, z = settled(motor, (1 - slip) * TURN / 2)
        ours = pull(motor, motion, state=z)
        np.testing.assert_allclose(ours[0, 5], pull(kloss, motion)[0, 5], rtol=1e-9)


def test_a_negative_frequency_turns_backward():
    forward, backward = krause(3), krause(3, frequency=-60.0)
    (motion, z), (reverse, y) = settled(forward, 150.0), settled(backward, -150.0)
    torque = pull(forward, motion, state=z)[0, 5]
    np.testing.assert_allclose(pull(backward, reverse, state=y)[0, 5], -torque, rtol=1e-12)
    assert torque > 10


def test_an_opened_stator_leaves_the_rotors_flux():
    """The current dies with the breaker's time, as a phase sees it; then the rotor's flux decays with Lr/Rr,
    turning with the rotor, and the stator's is Lm/Lr of it: the residual voltage."""
    motor = krause(3, connected=0.0, breaker_time=4e-4)
    running, speed = settled(krause(3), 180.0)[1], 180.0
    motion = (jnp.zeros(6), jnp.zeros(6).at[5].set(speed))

    def rates(z):
        return motor.rates(jnp.zeros(()), (motion,), None, z)

    A = np.asarray(jax.jacfwd(rates)(jnp.zeros(4)))
    assert np.abs(rates(jnp.zeros(4))).max() == 0.0  # no voltage from the grid
    ls, lr, m = (getattr(motor, f"{n}_inductance") for n in ("stator", "rotor", "magnetizing"))

    def after(t):
        z = jnp.asarray(expm(A * t) @ running)
        current = np.asarray(motor._currents(z))
        return current[0] + 1j * current[1], complex(z[2], z[3]), complex(z[0], z[1])

    first = after(0.0)[0]
    for t in (1e-4, 1e-3):
        # the grid's frame runs away from what stands still
        expected = first * np.exp(-t / 4e-4 - 1j * TURN * t)
        assert after(t)[0] == pytest.approx(expected, rel=1e-9)
    early, late = after(0.02), after(0.32)
    decay = np.exp(-0.3 * float(motor.rotor_resistance / lr) - 0.3j * (TURN - 2 * speed))
    assert late[1] == pytest.approx(early[1] * decay, rel=1e-9)
    assert late[2] == pytest.approx(late[1] * float(m / lr), rel=1e-9)


@pytest.mark.parametrize("closed", [0.0, 1.0])
def test_what_a_motor_draws_is_stored_lost_or_given(closed):
    """At any state, also while an arc burns in the breaker."""
    motor = krause(3, connected=closed, phase=0.6)
    motion = (jnp.zeros(6), jnp.zeros(6).at[5].set(140.0))
    z = jnp.array([0.5, -0.3, 0.4, 0.1])
    now = jnp.zeros(()), (motion,)
    slope = jax.grad(lambda z: motor.energy(*now, z))(z)
    stored = float(slope @ motor.rates(*now, (), z))
    given = float(motor.torque(*now, z)) * 140.0
    lost, drawn = float(motor.power_lost(*now, z)), float(motor.power_in(*now, z))
    assert stored == pytest.approx(drawn - lost - given, rel=1e-10)
    if closed:
        i = motor._currents(z)
        grid = PEAK * (np.cos(0.6) * i[0] + np.sin(0.6) * i[1])
        assert drawn == pytest.approx(1.5 * float(grid), rel=1e-10)


# From the nameplate


def nameplate(hp, starting=False):
    """What a maker of this circuit would print on it."""
    volts, rpm, *numbers = KRAUSE[hp]
    speed = rpm * np.pi / 30
    slips = np.geomspace(0.005, 1, 200001)
    torques = circuit(volts, *numbers, slips, TURN / 2)[0]
    torque, stator = circuit(volts, *numbers, 1 - speed / (TURN / 2), TURN / 2)
    power_factor = stator.real / abs(stator)
    data = dict(
        power=torque * speed,
        line_voltage=volts,
        frequency=60.0,
        speed=speed,
        power_factor=power_factor,
        efficiency=torque * speed / (np.sqrt(3) * volts * stator.real),
        breakdown_torque_ratio=np.max(torques) / torque,
    )
    if starting:
        start_torque, start = circuit(volts, *numbers, 1.0, TURN / 2)
        data["starting_torque_ratio"] = start_torque / torque
        data["starting_current_ratio"] = abs(start) / abs(stator)
    return data


@pytest.mark.parametrize("hp", KRAUSE)
@pytest.mark.parametrize("starting", [False, True])
def test_the_nameplate_gives_the_circuit_back(hp, starting):
    found = jr.InductionMotor.from_nameplate(**nameplate(hp, starting))
    expected = krause(hp)
    assert found.pole_pairs == 2
    for name in ("stator_resistance", "rotor_resistance", "magnetizing_inductance"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-4)
    for name in ("stator", "rotor"):
        whole = [getattr(m, f"{name}_inductance") for m in (found, expected)]
        leak = [w - m.magnetizing_inductance for w, m in zip(whole, (found, expected))]
        np.testing.assert_allclose(*leak, rtol=1e-4)
    np.testing.assert_allclose(found.voltage.level, expected.voltage.level, rtol=1e-15)


def test_a_motor_from_its_nameplate_is_switched_on():
    """No voltage before, the line's rms times sqrt(2/3) from then on; a solver steps on the instant."""
    motor = jr.InductionMotor.from_nameplate(**nameplate(3), switch_on=0.2)
    peak = nameplate(3)["line_voltage"] * np.sqrt(2 / 3)
    values = [float(motor.voltage.value(t)) for t in (0.0, 0.1999, 0.2, 1.0)]
    np.testing.assert_allclose(values, [0.0, 0.0, peak, peak], rtol=1e-15)
    assert motor.times().tolist() == [0.2]
    machine = jr.Machine({"rotor": jr.Rotor(1.0, 0.1, 0.1), "motor": motor}, {"motor": "rotor"})
    assert float(machine.parameters()["motor.voltage.time"]) == 0.2


def test_what_the_circuit_misses_is_told():
    data = nameplate(500) | dict(starting_torque_ratio=2.0)
    with pytest.warns(UserWarning, match=r"misses the nameplate by .*starting torque -\d+ %"):
        jr.InductionMotor.from_nameplate(**data)


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(power=-1.0), "power must be a positive number, but is -1.0"),
        (dict(power="3 kW"), "power must be a positive number, but is '3 kW'"),
        (dict(power_factor=1.2), "power_factor must be below 1, but is 1.2"),
        (dict(breakdown_torque_ratio=0.9), "breakdown_torque_ratio must be more than 1"),
        (dict(speed=1710.0), "speed must be a little below a synchronous one, 376.991 rad/s"),
        (dict(speed=130.0), "speed must be a little below a synchronous one, 188.496 rad/s"),
        (dict(switch_on=np.nan), "switch_on must be finite, but is nan s"),
        (dict(switch_on="0.2 s"), "switch_on must be a number in s, but is '0.2 s'"),
    ],
)
def test_wrong_nameplates_are_refused(change, words):
    with pytest.raises(jr.InputError, match=f"InductionMotor.from_nameplate: {words}"):
        jr.InductionMotor.from_nameplate(**(nameplate(3) | change))


# Energy, derivatives, study files


@pytest.mark.parametrize("start", [0.0, 90.0])
def test_energy_of_motors_is_balanced(start):
    """All on one rotor, of like power; from rest and from half the speed. Two are cut off and reclosed, one
    between lines that are shorted."""
    off, later = (jr.profiles.PulseTrain(1.0, 0.02, 0.0, 1.0, start) for start in (0.03, 0.036))
    synchronous = jr.elements.SynchronousMachine(
        *(0.5, 2e-3, 5e-2, 3e-2, 0.1, 4e-3, 0.9, 3e-3, [0.8], [3e-3], 8.0, PEAK, 60.0),
        connected=later,
        line_fault=jr.Step(0.04, 1.0),
        discharge_resistance=jr.Step(0.07, 0.0, 0.5),
        pole_pairs=2,
    )
    machine = jr.Machine.in_line(
        {"r": jr.Rotor(1.0, 0.05, 0.03)},
        attachments={
            "dc": (jr.DCMotor(R, L, K, 2 * V), "r"),
            "ac": (krause(3, connected=off), "r"),
            "synchronous": (synchronous, "r"),
            "brake": (jr.Brake(10.0, 5.0), "r"),
        },
    )
    audit = jr.energy_audit(machine, 0.1, 1000.0, spinning([start]), step=1e-4)
    assert float(audit.relative) < 1e-6
    assert float(audit.exchanged) > 500 and float(np.ptp(audit.lost)) > 100


def test_derivative_of_a_run_up_by_the_motors_numbers():
    """The speed of the DC motor after 0.1 s, against the derivative of the matrix exponential."""
    machine = jr.Machine.in_line(
        {"r": jr.Rotor(1.0, 0.02, 0.012)}, attachments={"m": (jr.DCMotor(R, L, K, V), "r")}
    )
    names = ("m.resistance", "m.inductance", "m.constant", "m.voltage.level")

    def final(x, adjoint):
        run = jr.simulate(
            machine.set(dict(zip(names, x))),
            0.1,
            100.0,
            "undeformed",
            solver=diffrax.Dopri5(),
            step=2e-4,
            adjoint=adjoint,
        )
        return run["r"].velocity[-1, 5]

    def exact(x):
        r, l, k, v = x
        A = np.array([[0, k / 0.02, 0], [-k / l, -r / l, v / l], [0, 0, 0]])
        return (expm(A * 0.1) @ [0, 0, 1])[0]

    x = np.array([R, L, K, V])
    expected = [
        (8 * (exact(x + d) - exact(x - d)) - exact(x + 2 * d) + exact(x - 2 * d)) / (12 * d[i])
        for i, d in enumerate(np.diag(1e-3 * x))
    ]
    forward = jax.jit(jax.jacfwd(lambda x: final(x, diffrax.ForwardMode())))(x)
    reverse = jax.jit(jax.grad(lambda x: final(x, None)))(x)
    np.testing.assert_allclose(forward, expected, rtol=1e-8)
    np.testing.assert_allclose(reverse, forward, rtol=1e-11)


STUDY = """
[[machine.line]]
name = "r"
kind = "Rotor"
mass = "3 kg"
polar_inertia = "0.089 kg*m^2"
transverse_inertia = "0.05 kg*m^2"

[[machine.attachments]]
name = "m"
kind = "InductionMotor"
at = "r"
stator_resistance = "0.435 ohm"
rotor_resistance = "816 mohm"
stator_inductance = "71.3 mH"
rotor_inductance = "71.3 mH"
magnetizing_inductance = "0.0693 H"
voltage = { kind = "Ramp", start_time = "10 ms", duration = "1 s", after = "0.18 kV" }
frequency = "60 Hz"
pole_pairs = 2

[[machine.attachments]]
name = "synchronous"
kind = "SynchronousMachine"
at = "r"
stator_resistance = "10 mohm"
stator_leakage = "0.3 mH"
d_magnetizing = "3 mH"
q_magnetizing = "2 mH"
field_resistance = "2 mohm"
field_leakage = "0.5 mH"
d_damper_resistance = "30 mohm"
d_damper_leakage = "0.4 mH"
q_damper_resistances = ["30 mohm"]
q_damper_leakages = ["0.4 mH"]
excitation = { kind = "Step", time = "1 s", after = "0.1 kA" }
voltage = "325 V"
frequency = "50 Hz"
connected = { kind = "PulseTrain", period = "2 s", width = "80 ms", level = 0.0, base = 1.0 }

[[machine.attachments]]
name = "inverter"
kind = "InverterDrive"
at = "r"
controller = { kind = "PI", proportional = "2 N*m*s/rad", integral = "5 N*m/rad" }
measured = { kind = "SpeedError", setpoint = "1500 rpm" }
actuator = { kind = "Actuator", bandwidth = "400 1/s" }
orders = [6, 12]
shares = [0.03, 0.01]

[[machine.attachments]]
name = "ripple"
kind = "TorqueRipple"
at = "r"
orders = [6]
speeds = { unit = "rpm", values = [0, 1500] }
amplitudes = { unit = "kN*m", values = [[0.2], [0.1]] }

[[machine.attachments]]
name = "dc"
kind = "DCMotor"
at = "r"
resistance = "0.6 ohm"
inductance = "15 mH"
constant = "0.4 N*m/A"
voltage = "60 V"

[[machine.attachments]]
name = "kloss"
kind = "KlossMotor"
at = "r"
breakdown_torque = "20 N*m"
breakdown_slip = 0.15
synchronous_speed = "1500 rpm"
connected = { kind = "PulseTrain", period = "2 s", width = "1 s", level = 1.0, count = 3 }

[[machine.attachments]]
name = "table"
kind = "SpeedTorque"
at = "r"
speeds = { unit = "rpm", values = [0, 600, 1200] }
torques = ["0 N*m", "-1 N*m", "-3 N*m"]

[[machine.attachments]]
name = "support"
kind = "LinearSupport"
at = "r"
stiffness = ["1 kN/m", "1 kN/m", "1 kN/m", "1 N*m/rad", "1 N*m/rad", "0 N*m/rad"]
offset = ["1 mm", "0 mm", "0 mm", "0 deg", "0 deg", "0 deg"]

[simulation]
t_end = "1 s"
sample_rate = "1 kHz"
"""


def test_study_files_know_them(tmp_path):
    path = tmp_path / "motors.toml"
    path.write_text(STUDY, encoding="utf-8")
    machine = jr.load(path).machine
    motor = machine["m"]
    assert (float(motor.frequency.level), motor.pole_pairs) == (60.0, 2)
    assert float(motor.rotor_resistance) == pytest.approx(0.816, rel=1e-14)
    assert float(motor.voltage.value(0.51)) == pytest.approx(90.0, rel=1e-14)
    assert (float(machine["dc"].constant), float(machine["dc"].voltage.level)) == (0.4, 60.0)
    assert float(machine["kloss"].synchronous_speed) == pytest.approx(50 * np.pi, rel=1e-14)
    np.testing.assert_allclose(machine["kloss"].times(), [0, 2, 4, 1, 3, 5])
    np.testing.assert_allclose(machine["table"].speeds, np.array([0, 20, 40]) * np.pi, rtol=1e-14)
    np.testing.assert_allclose(machine["support"].offset, [1e-3, 0, 0, 0, 0, 0])
    synchronous = machine["synchronous"]
    np.testing.assert_allclose(synchronous.q_damper_resistances, [0.03], rtol=1e-14)
    assert float(synchronous.excitation.after) == 100.0
    np.testing.assert_allclose(synchronous.times(), [1.0, 0.0, 0.08])
    np.testing.assert_allclose(machine["ripple"].amplitudes, [[200.0], [100.0]], rtol=1e-14)
    assert float(machine["inverter"].measured.setpoint.level) == pytest.approx(50 * np.pi)
