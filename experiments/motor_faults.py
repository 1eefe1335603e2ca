"""What its supply does to the coupling of a synchronous motor: start, short circuits, reclosing, an inverter.

A motor of 1.5 MW with a damper cage drives a compressor through a coupling; torsion alone. Above: its start
as an induction motor, the field on its discharge resistor and then excited, over the speed (twice the slip's
frequency meets the torsional mode on the way); and the air-gap torque of short circuits at its terminals.
Below: its supply is cut off for a while and returns, by then out of phase: the peaks of torque over the dead
time; and the same train on an inverter, with a load whose torque is the same at all speeds: the torque in
the coupling at six and twelve times the electrical frequency.

    python experiments/motor_faults.py [--out results/motor_faults] [--quick]

The numbers of the motor are made up, as of a salient-pole motor of its size.
"""

import argparse
import time
from pathlib import Path

import equinox as eqx
import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import jax.numpy as jnp
import numpy as np

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.elements import InverterDrive, SynchronousMachine
from jaxrotor.plot.style import COLOURS, figure, label, legend
from jaxrotor.profiles import PulseTrain, Step
from jaxrotor.standards import start_resonance

LINE, PAIRS = 60.0, 2
SYNCHRONOUS = 2 * np.pi * LINE / PAIRS
POWER, APPARENT = 1.5e6, 1.76e6
NOMINAL = POWER / SYNCHRONOUS
INERTIAS, STIFFNESS, DAMPING = (60.0, 40.0), 4.6e5, 90.0
HELD = ("x", "y", "z", "psi", "theta")
FAULT = 0.05
RPM = np.pi / 30


def motor(**changes) -> SynchronousMachine:
    plain = SynchronousMachine.from_standard(
        APPARENT,
        6.6e3,
        LINE,
        1.3,
        0.8,
        0.3,
        0.2,
        0.22,
        2.5,
        0.04,
        0.06,
        0.12,
        0.012,
        pole_pairs=PAIRS,
    )
    return altered(plain, **changes)


def altered(machine, **changes):
    return eqx.tree_at(lambda m: [getattr(m, n) for n in changes], machine, [*changes.values()])


def loaded(**changes) -> SynchronousMachine:
    """At its rated power, overexcited."""
    return altered(motor().running(POWER, -0.4 * POWER), **changes)


def train(drive, torque=NOMINAL) -> jr.Machine:
    """`torque` of the load at the synchronous speed."""
    zero = [0.0] * 5
    return jr.Machine.in_line(
        {
            "motor": jr.Rotor(1e3, INERTIAS[0], INERTIAS[0]),
            "coupling": jr.Coupling(zero + [STIFFNESS], zero + [DAMPING]),
            "compressor": jr.Rotor(1e3, INERTIAS[1], INERTIAS[1]),
        },
        {"drive": (drive, "motor"), "gas": (jr.FanLoad(torque / SYNCHRONOUS**2), "compressor")},
        fixed={"motor": HELD, "compressor": HELD},
    )


def turning(torque=NOMINAL) -> jr.State:
    q, v = np.zeros((2, 6)), np.zeros((2, 6))
    v[:, 5], q[1, 5] = SYNCHRONOUS, -torque / STIFFNESS
    return jr.State(q, v)


def steady_torque() -> float:
    machine = loaded()
    motion = ((jnp.zeros(6), jnp.zeros(6).at[5].set(SYNCHRONOUS)),)
    return float(machine.torque(jnp.zeros(()), motion, machine.initial()))


def started(t_end: float):
    """The start with a throttled compressor, and the speed and time at which the field is switched on."""
    plain = motor()
    still = jr.State(np.zeros((2, 6)), np.zeros((2, 6)))
    resistor = 10 * plain.field_resistance

    def run(date):
        drive = altered(
            plain,
            excitation=Step(date, 1.6 * plain.excitation.level),
            discharge_resistance=Step(date, 0.0, resistor),
        )
        return jr.simulate(train(drive, 0.35 * NOMINAL), t_end, 4000.0, still, step=2.5e-4)

    without = run(t_end)
    slip = 1 - np.asarray(without["motor"].speed) / SYNCHRONOUS
    on = float(without.t[np.argmax(slip < 0.03)])
    return run(on), on


def shorted():
    """Air-gap torque over time of both short circuits, the motor cut off from the line by the second."""
    found = {}
    three = loaded(voltage=Step(FAULT, 0.0, motor().voltage.level))
    two = loaded(line_fault=Step(FAULT, 1.0), connected=Step(FAULT, 0.0, 1.0))
    torque = steady_torque()
    for name, drive in (("three phases", three), ("two lines", two)):
        run = jr.simulate(train(drive, torque), 0.3, 5000.0, turning(torque), step=2e-4)
        found[name] = np.asarray(run.t), np.asarray(run["drive"].torque)
    return found


def reclosed(dead: np.ndarray):
    """Of each dead time (s): peaks of the air-gap torque and of the coupling's (N·m), and what the line
    meets: how far the field's voltage is behind it (rad), and the residual voltage (V, peak)."""
    torque, machine = steady_torque(), loaded()

    def one(off):
        drive = altered(machine, connected=PulseTrain(3.0, off, 0.0, 1.0, FAULT))
        run = jr.simulate(train(drive, torque), 0.9, 4000.0, turning(torque), step=2.5e-4)
        after = run.t > FAULT + off

        def peak(x):
            return jnp.max(jnp.where(after, jnp.abs(x), 0.0))

        found, last = run["drive"], jnp.argmax(after) - 1
        peaks = peak(found.torque), peak(run["coupling"].torque)
        return *peaks, -found.load_angle[last], found.terminal_voltage[last]

    found = eqx.filter_jit(lambda x: jax.lax.map(one, x))(jnp.asarray(dead))
    return [np.asarray(x) for x in found]


def on_inverter(speeds: np.ndarray) -> np.ndarray:
    """Torque in the coupling at the speeds (rad/s), N·m, (speed, order): the speed of the motor is
    controlled, 3 % and 1 % of the torque ripple."""
    plain = train(jr.Torque(0.0), 0.0).elements()
    found = []
    for speed in speeds:
        drive = InverterDrive(
            jr.elements.PI(500.0, 1000.0),
            jr.elements.SpeedError(speed),
            orders=(6.0, 12.0),
            shares=(0.03, 0.01),
            actuator=jr.elements.Actuator(bandwidth=400.0),
            pole_pairs=PAIRS,
        )
        machine = jr.Machine.in_line(
            {name: plain[name] for name in ("motor", "coupling", "compressor")},
            {"drive": (drive, "motor"), "load": (jr.Torque(-NOMINAL), "compressor")},
            fixed={"motor": HELD, "compressor": HELD},
        )
        q, v = np.zeros((2, 6)), np.zeros((2, 6))
        v[:, 5], q[1, 5] = speed, -NOMINAL / STIFFNESS
        start = jr.State(q, v, jnp.array([NOMINAL, NOMINAL]))
        orders = 6.0 * PAIRS, 12.0 * PAIRS
        response = jr.order_response(machine, "coupling.torque", [speed], orders, at=start)
        found.append(np.abs(np.asarray(response.values))[0, :, 0])
    return np.array(found)


def draw(start, on, faults, dead, peaks, speeds, ripple, natural, out: Path) -> None:
    fig, ((first, second), (third, fourth)) = figure(2, 2, (12.5, 8.2))
    rpm = np.asarray(start["motor"].speed) / RPM
    for colour, part, width in ((COLOURS[5], "drive", 0.5), (COLOURS[1], "coupling", 1.0)):
        words = {"coupling": "in the coupling", "drive": "in the air gap"}[part]
        torque = np.asarray(start[part].torque)
        torque = -torque if part == "coupling" else torque
        first.plot(rpm, torque / NOMINAL, color=colour, linewidth=width, label=words)
    met = float(start_resonance(natural, SYNCHRONOUS, LINE)) / RPM
    first.axvline(met, color="black", linewidth=0.9, linestyle="--")
    first.annotate(f"twice the slip = {natural / 2 / np.pi:.1f} Hz", (met, 0.03), (-6, 0), ha="right",
                   xycoords=("data", "axes fraction"), textcoords="offset points")  # fmt: skip
    label(
        first,
        "speed of the motor, rpm",
        "torque / rated",
        "Start; the field is switched on at 3 % slip",
    )
    legend(first, loc="upper center")
    for colour, (name, (t, torque)) in zip(COLOURS, faults.items()):
        second.plot(t * 1e3, torque / NOMINAL, color=colour, linewidth=1, label=name)
    label(second, "time, ms", "air-gap torque / rated", "Short circuits at the terminals")
    legend(second, loc="lower right")
    air, coupling, angle, _ = peaks
    third.plot(
        dead * 1e3, air / NOMINAL, "o-", color=COLOURS[0], markersize=3, label="in the air gap"
    )
    third.plot(
        dead * 1e3,
        coupling / NOMINAL,
        "o-",
        color=COLOURS[1],
        markersize=3,
        label="in the coupling",
    )
    half = np.interp(np.pi, np.unwrap(angle), dead) * 1e3
    third.axvline(half, color="black", linewidth=0.9, linestyle="--")
    third.annotate("field's voltage half\na turn behind", (half, 0.98), (-6, 0), ha="right", va="top",
                   xycoords=("data", "axes fraction"), textcoords="offset points")  # fmt: skip
    third.set_ylim(bottom=0)
    label(third, "dead time, ms", "peak of torque / rated", "Cut off and reclosed")
    legend(third, loc="lower right")
    for colour, k, order in ((COLOURS[0], 0, 6), (COLOURS[1], 1, 12)):
        fourth.semilogy(
            speeds / RPM, ripple[:, k] / NOMINAL, color=colour, label=f"{order} x electrical"
        )
        fourth.axvline(natural / (order * PAIRS) / RPM, color=colour, linewidth=0.9, linestyle="--")
    label(
        fourth,
        "speed of the motor, rpm",
        "amplitude in the coupling / rated",
        "On an inverter; dashed: mode met",
    )
    legend(fourth, loc="upper right")
    save_figure(fig, out / "motor_faults.png")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/motor_faults"))
    parser.add_argument("--quick", action="store_true", help="fewer dead times and speeds")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()

    natural = np.sqrt(STIFFNESS * sum(1 / j for j in INERTIAS))
    start, on = started(4.0)
    torque = np.asarray(start["coupling"].torque)
    at = np.argmax(np.abs(torque) * (np.asarray(start.t) > 0.5))
    met = float(start_resonance(natural, SYNCHRONOUS, LINE))
    rpm = float(start["motor"].speed[at]) / RPM
    print(f"start: field on at {on:.2f} s; once the switching has died away the coupling carries at most "
          f"{abs(torque[at]) / NOMINAL:.1f} of the rated torque, at {rpm:.0f} rpm "
          f"(twice the slip is the mode's at {met / RPM:.0f} rpm)")  # fmt: skip
    faults = shorted()
    for name, (_, torque) in faults.items():
        print(
            f"short circuit, {name}: {np.abs(torque).max() / NOMINAL:.1f} of the rated torque in the air gap"
        )
    dead = np.linspace(0.01, 0.4, 14 if given.quick else 53)
    peaks = reclosed(dead)
    worst = int(np.argmax(peaks[0]))
    print(f"reclosing: at worst after {dead[worst] * 1e3:.0f} ms, "
          f"{np.degrees(peaks[2][worst]):.0f} deg behind with "
          f"{peaks[3][worst] / float(motor().voltage.level):.2f} of the voltage: "
          f"{peaks[0][worst] / NOMINAL:.1f} of the rated torque in the air gap, "
          f"{peaks[1].max() / NOMINAL:.1f} in the coupling")  # fmt: skip
    speeds = np.linspace(30.0, 400.0, 40 if given.quick else 120) * RPM
    meeting = natural / (np.array([6.0, 12.0]) * PAIRS)
    speeds = np.sort(
        np.concatenate([speeds, *(m * (1 + np.linspace(-0.1, 0.1, 21)) for m in meeting)])
    )
    ripple = on_inverter(speeds)
    print(f"on an inverter: {ripple[:, 0].max() / NOMINAL:.3f} of the rated torque, at "
          f"{speeds[ripple[:, 0].argmax()] / RPM:.0f} rpm, where the sixth meets the mode")  # fmt: skip
    draw(start, on, faults, dead, peaks, speeds, ripple, natural, given.out)
    print(f"figure: {given.out / 'motor_faults.png'}")
    print(f"{time.perf_counter() - began:.0f} s in all")


if __name__ == "__main__":
    main()
