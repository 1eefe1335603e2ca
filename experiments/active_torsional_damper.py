"""Active damping of torsional vibration: the two-rotor machine, started by an induction motor.

With lightly damped shafts (beta = 1e-5 s) the torque that surges at 50 Hz when the motor is switched on
meets a torsional mode of 52 Hz. A torque actuator on the motor's shaft answers to the twist between motor
and main rotor: a PD controller with a lag, a delay and a limit. Its two gains are found by gradient, for
the least mean twist of a batch of machines that differ from the drawing. Then 500 others are started with
and without it, every parameter of theirs off by up to 20 %: sizes, materials, unbalance, bearings, motor,
grid, and the actuator itself.

At the end the paper's own machine, whose shafts are damped 200 times as much, run up by its kinematic
drive: what can an actuator at the right bearing still gain there?

    python experiments/active_torsional_damper.py [--out DIR] [--machines 500] [--limit 18] [--seed 0]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

T_END, RATE, STEP = 1.5, 2000.0, 1.25e-4
MOVING = 0.03  # s, of the mean about which the twist vibrates
TWIST = jr.sensors.Twist("main", "end")
RMS = jr.objectives.RootMeanSquare(TWIST, moving=MOVING)
EFFORT = jr.objectives.Integral(jr.sensors.Signal("damper", "torque"), power=2)
PRICE = 3e-6  # rad for each (N·m)² s
GAINS = ("damper.controller.stiffness", "damper.controller.damping")
REDUCED = 10.0  # dB
CHUNK = 25  # machines in one batch


def motor() -> jr.InductionMotor:
    """2.2 kW, two poles, 400 V, 50 Hz: rated torque 7.2 N·m, breakdown torque 21.7 N·m."""
    return jr.InductionMotor.from_nameplate(
        2200.0, 400.0, 50.0, 2900 * np.pi / 30, 0.86, 0.85, breakdown_torque_ratio=3.0
    )


def line(beta: float, end, attachments, fixed=None, twist: str = "invariant") -> jr.Machine:
    def shaft(length: float) -> jr.Shaft:
        return jr.Shaft(length=length, diameter=0.012, rayleigh=(0.002, beta), twist=twist)

    def bearing() -> jr.SelfAligningBearing:
        return jr.SelfAligningBearing(
            1.0, stiffness=1e6, damping=200.0, swing_damping=5.0, friction_arm=0.002
        )

    unbalance = jr.Unbalance(eccentricity=5e-4, inclination=np.deg2rad(1.0))
    return jr.Machine.in_line(
        {
            "second": jr.Rotor(3.0935, 0.00485, 0.002837, unbalance=jr.Unbalance(1e-5)),
            "shaft 1": shaft(0.060),
            "left": bearing(),
            "shaft 2": shaft(0.080),
            "main": jr.Rotor(6.0788, 0.01873, 0.01018, unbalance=unbalance),
            "shaft 3": shaft(0.127),
            "right": bearing(),
            "shaft 4": shaft(0.020),
            "end": end,
        },
        attachments,
        gravity=(0.0, -9.81, 0.0),
        fixed=fixed,
    )


def started_by_a_motor(limit: float) -> jr.Machine:
    """The motor's rotor with its half of the coupling stands at the driven end; the damper is off."""
    actuator = jr.elements.Actuator(limit=limit, bandwidth=3000.0, delay=2e-4)
    damper = jr.elements.ActiveTorque(jr.elements.PD(0.0, 0.0), jr.elements.TwistOf(0, 1), actuator)
    return line(
        1e-5,
        jr.Rotor(8.0, 0.016, 0.016),
        {"motor": (motor(), "end"), "damper": (damper, ("end", "main"))},
        fixed={"end": ("x", "y", "z", "psi", "theta")},
    )


def papers_machine(limit: float) -> jr.Machine:
    actuator = jr.elements.Actuator(limit=limit, bandwidth=3000.0, delay=2e-4)
    damper = jr.elements.ActiveTorque(jr.elements.PD(0.0, 0.0), jr.elements.TwistOf(0, 1), actuator)
    drive = jr.PrescribedSpin(jr.CosineRamp(speed=1000.0, duration=2.5))
    return line(0.002, drive, {"damper": (damper, ("right", "main"))}, twist="paper")


def scattered(machine: jr.Machine, count: int, seed: int, spread: float = 0.2) -> jr.Variations:
    """Every parameter of the machine by its own factor; the motor's inductances by those of its leakages and
    its magnetizing inductance, for independent ones would be no motor."""
    drawn = jr.Variations.uniform(machine, spread=spread, count=count, seed=seed).factors
    whole, s, r = (f"motor.{k}_inductance" for k in ("magnetizing", "stator", "rotor"))
    L = {path: float(machine.get(path)) for path in (whole, s, r)}
    shared = drawn[whole]
    for path in (s, r):
        leakage = L[path] - L[whole]
        drawn[path] = (shared * L[whole] + drawn[path] * leakage) / L[path]
    # the gains are designed on top of what scatters
    return jr.Variations({p: x for p, x in drawn.items() if p not in GAINS})


def designed(
    machine: jr.Machine, count: int, seed: int, progress: bool | None = None
) -> jr.optimization.Optimum:
    """Gains for the least mean vibration of a batch, at a price for the torque squared."""
    start = jr.optimization.SimulatedRun(
        T_END, RATE, step=STEP, variations=scattered(machine, count, seed) if count > 1 else None
    )
    return jr.optimize(
        machine.set({GAINS[1]: 5.0}),
        [jr.Unknown(GAINS[0], scale=200.0), jr.Unknown(GAINS[1], positive=True)],
        start.measure(RMS, over="mean") + PRICE * start.measure(EFFORT, over="mean"),
        iterations=15,
        tolerance=1e-4,
        progress=progress,
    )


@jax.jit
def _compared(machine: jr.Machine, factors):
    """RMS of the twist without and with the damper (rad), its largest torque (N·m), the energy it puts in and
    takes out (J), and the final speed."""

    def one(own):
        m = jr.Variations.member(jr.Variations({"main.mass": [1.0]}), machine, own)
        off = jr.simulate(m.set(dict.fromkeys(GAINS, 0.0)), T_END, RATE, step=STEP)
        on = jr.simulate(m, T_END, RATE, step=STEP)
        power = on["damper"].power
        energy = [jnp.sum(jnp.maximum(s * power, 0.0)) / RATE for s in (1, -1)]
        largest = jnp.max(jnp.abs(on["damper"].torque))
        return jnp.stack([RMS(off), RMS(on), largest, *energy, on["end"].speed[-1]])

    return jax.vmap(one)(factors)


def compared(machine: jr.Machine, variations: jr.Variations, progress: bool = True) -> np.ndarray:
    """A row for each machine of the batch."""
    count = variations.count
    found = []
    for first in tqdm(range(0, count, CHUNK), "machines", disable=not progress, leave=False):
        # the last batch is filled up: another size would be compiled anew
        at = np.minimum(np.arange(first, first + CHUNK), count - 1)
        rows = _compared(machine, {p: jnp.asarray(x)[at] for p, x in variations.factors.items()})
        found.append(np.asarray(rows)[: count - first])
    return np.concatenate(found)


def reduction(rows: np.ndarray) -> np.ndarray:
    """dB."""
    return 20 * np.log10(rows[:, 0] / rows[:, 1])


def draw_start(off: jr.Response, on: jr.Response, limit: float):
    fig, axes = figure(4, 1, (10.0, 10.5), sharex=True)
    speed, surge, twist, effort = axes[:, 0]
    t = off.t
    speed.plot(t, on["end"].speed, color=COLOURS[0], label="motor")
    label(speed, "", "speed, rad/s", "Start by an induction motor")
    surge.plot(t, on["motor"].torque, color=COLOURS[1], linewidth=0.8)
    label(surge, "", "motor torque, N·m")
    for response, colour, words in (
        (off, GREY, "without"),
        (on, COLOURS[0], "with the active damper"),
    ):
        twist.plot(t, np.degrees(TWIST.signal(response)), color=colour, linewidth=0.7, label=words)
    label(twist, "", "twist main to motor, deg")
    legend(twist, loc="upper right")
    effort.plot(t, on["damper"].torque, color=COLOURS[2], linewidth=0.7)
    for side in (-limit, limit):
        effort.axhline(side, color="black", linestyle="--", linewidth=0.9)
    label(effort, "time, s", "damper torque, N·m", "limit dashed")
    return fig


def draw_batch(rows: np.ndarray, share: float):
    fig, axes = figure(1, 2, (12.0, 4.4))
    left, right = axes[0]
    dB = reduction(rows)
    left.hist(dB, bins=40, color=COLOURS[0], alpha=0.85)
    left.axvline(REDUCED, color="black", linestyle="--", label=f"{REDUCED:g} dB")
    words = f"{100 * share:.1f} % of {len(dB)} machines gain {REDUCED:g} dB or more"
    label(left, "reduction of the RMS twist, dB", "machines", words)
    legend(left)
    limits = np.degrees([rows[:, :2].min(), rows[:, :2].max()])
    right.loglog(
        np.degrees(rows[:, 0]), np.degrees(rows[:, 1]), ".", color=COLOURS[0], markersize=4
    )
    right.loglog(limits, limits, color=GREY, label="no gain")
    right.loglog(
        limits, limits * 10 ** (-REDUCED / 20), "--", color="black", label=f"{REDUCED:g} dB"
    )
    label(right, "RMS twist without, deg", "RMS twist with, deg")
    legend(right)
    return fig


def on_the_papers_machine(limit: float, progress: bool | None = None):
    """RMS of the twist over the run-up without and with the best damper, and the optimum."""
    machine = papers_machine(limit)
    run = jr.optimization.SimulatedRun(4.0, 1000.0)
    start = machine.set({GAINS[1]: 1.0})
    measure = jr.objectives.RootMeanSquare(jr.sensors.Twist("main", "right"), moving=MOVING)
    found = jr.optimize(
        start,
        [jr.Unknown(GAINS[0], scale=200.0), jr.Unknown(GAINS[1], positive=True)],
        run.measure(measure),
        iterations=20,
        tolerance=1e-4,
        progress=progress,
    )
    off = float(measure(jr.simulate(machine, 4.0, 1000.0)))
    on = jr.simulate(found.machine, 4.0, 1000.0)
    return off, float(measure(on)), float(jnp.max(jnp.abs(on["damper"].torque))), found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/active_torsional_damper"))
    parser.add_argument(
        "--machines", type=int, default=500, help="uncertain machines (default: 500)"
    )
    parser.add_argument(
        "--design", type=int, default=6, help="machines it is designed on (default: 6)"
    )
    parser.add_argument(
        "--limit", type=float, default=18.0, help="actuator torque, N·m (default: 18)"
    )
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    machine = started_by_a_motor(given.limit)
    found = designed(machine, given.design, given.seed + 1)
    print(found)
    off, on = (jr.simulate(m, T_END, RATE, step=STEP) for m in (machine, found.machine))
    alone = 20 * np.log10(float(RMS(off) / RMS(on)))
    surge = float(jnp.max(jnp.abs(off["motor"].torque)))
    before, after = (np.degrees(float(RMS(r))) for r in (off, on))
    print(
        f"the machine as drawn: {before:.4f} -> {after:.4f} deg RMS, {alone:.1f} dB; "
        f"the motor surges to {surge:.0f} N·m, the actuator gives {given.limit:g} N·m at most"
    )
    finer = jr.simulate(found.machine, T_END, RATE, step=STEP / 2)
    print(f"with half the step: {np.degrees(float(RMS(finer))):.4f} deg")
    rows = compared(found.machine, scattered(found.machine, given.machines, given.seed))
    dB, share = reduction(rows), float(np.mean(reduction(rows) >= REDUCED))
    print(
        f"{given.machines} machines, every parameter off by up to 20 %: {100 * share:.1f} % gain "
        f"{REDUCED:g} dB or more; 5th percentile {np.percentile(dB, 5):.1f} dB, median {np.median(dB):.1f} dB"
    )
    mean, most = rows.mean(axis=0), rows.max(axis=0)
    print(
        f"energy in a start: {mean[3]:.0f} J put into the shaft, {mean[4]:.0f} J taken out of it (means; "
        f"largest {most[3]:.0f} and {most[4]:.0f} J); largest torque {most[2]:.1f} N·m, for the limit "
        f"scatters too, up to {1.2 * given.limit:g} N·m"
    )
    save_figure(draw_start(off, on, given.limit), given.out / "start.png")
    save_figure(draw_batch(rows, share), given.out / "batch.png")
    found.save(given.out / "optimum.json")
    before, after, torque, _ = on_the_papers_machine(given.limit)
    print(
        f"the paper's own machine: {np.degrees(before):.5f} -> {np.degrees(after):.5f} deg RMS, "
        f"{20 * np.log10(before / after):.1f} dB, with {torque:.1f} N·m: what its shafts leave to be gained"
    )
    print(f"{time.perf_counter() - began:.0f} s in all; figures in {given.out}/")


if __name__ == "__main__":
    main()
