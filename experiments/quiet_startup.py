"""A quiet start-up: the ramp itself is designed, at equal time to reach the same speed.

The two-rotor machine of Matyja & Łazarz (2014), its shafts damped a twentieth as much, is run up to
1000 rad/s through its critical speed. The ramp is a spline of speed; its points are found by gradient for
the smallest deflection of the main rotor on the way, while the drive may pull little harder than a cosine
ramp of the same duration does. For several durations; beside them the cosine ramp and a ramp at constant
acceleration.

    python experiments/quiet_startup.py [--out DIR] [--durations 1.5,2.5,4]
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
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend
from jaxrotor.study.written import save_figure

SPEED, BETA = 1000.0, 1e-4  # rad/s, s
POINTS = 9  # of the spline, the two ends among them
T_END, RATE = 5.0, 1000.0
DEFLECTION = jr.Radial("main")
TORQUE = jr.DriveTorque("end")
SHARPNESS = 100.0  # of the smooth maximum that is designed with; what is told is the exact one


def shapes(duration: float) -> dict[str, np.ndarray]:
    """Speeds at the points of the spline, rad/s."""
    s = np.linspace(0, 1, POINTS)
    return {"cosine": 0.5 * SPEED * (1 - np.cos(np.pi * s)), "constant acceleration": SPEED * s}


def machine(duration: float, speeds) -> jr.Machine:
    times = np.linspace(0.0, duration, POINTS)
    return line(BETA, jr.PrescribedSpin(jr.SpeedSpline(times, speeds)), {})


RUN = jr.Transient(T_END, RATE)


def judged(m: jr.Machine) -> tuple[float, float]:
    """Largest deflection (m) and drive torque (N·m)."""
    r = jr.simulate(m, T_END, RATE)
    return float(jr.PeakValue(DEFLECTION)(r)), float(jr.PeakValue(TORQUE)(r))


def designed(duration: float, allowed: float, progress: bool | None = None) -> jr.Optimum:
    """`allowed`: drive torque, N·m."""
    start = machine(duration, shapes(duration)["cosine"])
    points = [jr.Unknown(f"end.profile.speeds[{i}]", scale=100.0) for i in range(1, POINTS - 1)]
    return jr.optimize(
        start,
        points,
        RUN.measure(jr.PeakValue(DEFLECTION, sharpness=SHARPNESS)),
        [RUN.measure(jr.PeakValue(TORQUE, sharpness=SHARPNESS)) <= 1.15 * allowed],
        iterations=60,
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
        axes[2, 0].plot(r.t, 1e3 * DEFLECTION.signal(r), linewidth=0.6, **kwargs)
        axes[3, 0].plot(r.t, TORQUE.signal(r), linewidth=0.6, **kwargs)
    label(axes[0, 0], "", "speed, rad/s", f"The same speed in the same {duration:g} s")
    label(axes[1, 0], "", "acceleration, rad/s²")
    label(axes[2, 0], "", "deflection of main, mm")
    label(axes[3, 0], "time, s", "drive torque, N·m")
    axes[3, 0].set_xlim(0, 1.3 * duration)
    legend(axes[0, 0], loc="lower right")
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/quiet_startup"))
    parser.add_argument(
        "--durations", default="1.5,2.5,4", help="s, between commas (default: 1.5,2.5,4)"
    )
    given = parser.parse_args()
    durations = [float(x) for x in given.durations.split(",")]
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    print("duration  ramp                   deflection  drive torque")
    table = []
    for duration in tqdm(durations, "durations", leave=False):
        rows = {}
        for name, speeds in shapes(duration).items():
            rows[name] = machine(duration, speeds)
        _, allowed = judged(rows["cosine"])
        found = designed(duration, allowed)
        rows["designed"] = found.machine
        for name, m in rows.items():
            peak, torque = judged(m)
            table.append((duration, name, peak, torque))
            tqdm.write(f"{duration:6.3g} s  {name:21}  {1e3 * peak:7.4f} mm  {torque:8.3f} N·m")
        runs = {name: jr.simulate(m, T_END, RATE) for name, m in rows.items()}
        save_figure(draw(runs, duration), given.out / f"ramp_{duration:g}s.png")
        found.save(given.out / f"optimum_{duration:g}s.json")
    fig, axes = figure(1, 1, (6.5, 4.2))
    for name, colour in zip(
        ("cosine", "constant acceleration", "designed"), (GREY, *COLOURS[1::-1])
    ):
        own = [(d, 1e3 * p) for d, n, p, _ in table if n == name]
        axes[0, 0].plot(*zip(*own), "o-", color=colour, label=name)
    label(axes[0, 0], "time to reach the speed, s", "largest deflection of main, mm")
    axes[0, 0].set_ylim(bottom=0)
    legend(axes[0, 0])
    save_figure(fig, given.out / "durations.png")
    print(f"{time.perf_counter() - began:.0f} s in all; figures in {given.out}/")


if __name__ == "__main__":
    main()
