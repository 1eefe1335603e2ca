"""A quiet start-up: the ramp itself is designed, at equal time to reach the same speed.

The two-rotor machine of Matyja & Łazarz (2014), its shafts damped 200 times less, is run up to 1000 rad/s
through its critical speed. The ramp is a spline of speed; its points are found by gradient for the least
torsional vibration (RMS of the twist about its moving mean), while the drive may pull little harder than a
cosine ramp of the same duration does. Beside it the cosine ramp and a ramp at constant acceleration.

What no ramp changes much is the deflection on the way: the housings damp it so well that the passage is all
but a row of steady whirls. It is printed too.

    python experiments/quiet_startup.py [--out DIR] [--durations 1,2]
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
from active_torsional_damper import line
from tqdm import tqdm

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

SPEED, BETA = 1000.0, 1e-5  # rad/s, s
POINTS = 9  # of the spline, the two ends among them
T_END, RATE, STEP = 3.0, 1000.0, 1.25e-4
DEFLECTION = jr.sensors.Radial("main")
TORQUE = jr.sensors.DriveTorque("end")
RMS = jr.objectives.RootMeanSquare(jr.sensors.Twist("main", "end"), moving=0.03)
SHARPNESS = 100.0  # of the smooth maximum that is designed with; what is told is the exact one


def shapes(duration: float) -> dict[str, np.ndarray]:
    """Speeds at the points of the spline, rad/s."""
    s = np.linspace(0, 1, POINTS)
    return {"cosine": 0.5 * SPEED * (1 - np.cos(np.pi * s)), "constant acceleration": SPEED * s}


def machine(duration: float, speeds) -> jr.Machine:
    times = np.linspace(0.0, duration, POINTS)
    return line(BETA, jr.PrescribedSpin(jr.SpeedSpline(times, speeds)), {})


RUN = jr.optimization.SimulatedRun(T_END, RATE, step=STEP)


def judged(r: jr.Response) -> tuple[float, float, float]:
    """RMS twist (rad), largest drive torque (N·m) and deflection (m)."""
    return (
        float(RMS(r)),
        float(jr.objectives.PeakValue(TORQUE)(r)),
        float(jr.objectives.PeakValue(DEFLECTION)(r)),
    )


def designed(
    duration: float, allowed: float, progress: bool | None = None
) -> jr.optimization.Optimum:
    """`allowed`: drive torque, N·m."""
    start = machine(duration, shapes(duration)["cosine"])
    points = [jr.Unknown(f"end.profile.speeds[{i}]", scale=100.0) for i in range(1, POINTS - 1)]
    return jr.optimize(
        start,
        points,
        RUN.measure(RMS),
        [RUN.measure(jr.objectives.PeakValue(TORQUE, sharpness=SHARPNESS)) <= 1.15 * allowed],
        iterations=50,
        tolerance=1e-4,
        progress=progress,
    )


def draw(runs: dict[str, jr.Response], duration: float):
    fig, axes = figure(4, 1, (10.0, 11.0), sharex=True)
    styles = dict(zip(runs, ((GREY, "-"), (COLOURS[1], "-"), (COLOURS[0], "-"))))
    for name, r in runs.items():
        colour, style = styles[name]
        kwargs = dict(color=colour, linestyle=style, label=name)
        axes[0, 0].plot(r.t, r["end"].speed, linewidth=1.4, **kwargs)
        axes[1, 0].plot(r.t, jnp.gradient(r["end"].speed, r.t), linewidth=1.2, **kwargs)
        axes[2, 0].plot(r.t, np.degrees(RMS.sensor.signal(r)), linewidth=0.6, **kwargs)
        axes[3, 0].plot(r.t, TORQUE.signal(r), linewidth=0.6, **kwargs)
    label(axes[0, 0], "", "speed, rad/s", f"The same speed in the same {duration:g} s")
    label(axes[1, 0], "", "acceleration, rad/s²")
    label(axes[2, 0], "", "twist main to drive, deg")
    label(axes[3, 0], "time, s", "drive torque, N·m")
    axes[3, 0].set_xlim(0, 1.3 * duration)
    legend(axes[0, 0], loc="lower right")
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/quiet_startup"))
    parser.add_argument("--durations", default="1,2", help="s, between commas (default: 1,2)")
    given = parser.parse_args()
    durations = [float(x) for x in given.durations.split(",")]
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    print("duration  ramp                       RMS twist  drive torque  deflection")
    table = []
    for duration in tqdm(durations, "durations", leave=False):
        machines = {name: machine(duration, speeds) for name, speeds in shapes(duration).items()}
        runs = {name: jr.simulate(m, T_END, RATE, step=STEP) for name, m in machines.items()}
        found = designed(duration, judged(runs["cosine"])[1])
        runs["designed"] = jr.simulate(found.machine, T_END, RATE, step=STEP)
        for name, r in runs.items():
            rms, torque, deflection = judged(r)
            table.append((duration, name, rms))
            tqdm.write(
                f"{duration:6.3g} s  {name:21}  {np.degrees(rms):9.5f} deg  {torque:8.3f} N·m  "
                f"{1e3 * deflection:7.4f} mm"
            )
        save_figure(draw(runs, duration), given.out / f"ramp_{duration:g}s.png")
        found.save(given.out / f"optimum_{duration:g}s.json")
    fig, axes = figure(1, 1, (6.5, 4.2))
    for name, colour in zip(runs, (GREY, COLOURS[1], COLOURS[0])):
        own = [(d, np.degrees(rms)) for d, n, rms in table if n == name]
        axes[0, 0].semilogy(*zip(*own), "o-", color=colour, label=name)
    label(axes[0, 0], "time to reach the speed, s", "RMS twist about its moving mean, deg")
    legend(axes[0, 0])
    save_figure(fig, given.out / "durations.png")
    print(f"{time.perf_counter() - began:.0f} s in all; figures in {given.out}/")


if __name__ == "__main__":
    main()
