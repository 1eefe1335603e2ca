"""A map: the torsional vibration and the passage of a start-up over its duration and the unbalance.

The lightly damped two-rotor machine (beta = 1e-5 s) is run up to 1000 rad/s by a cosine ramp, for every
combination of ramp time and eccentricity of its main rotor, in one batch.

    python experiments/ramp_map.py [--out DIR] [--points 12]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np
from active_torsional_damper import line

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import figure, label

OUTPUTS = {
    "twist": jr.objectives.RootMeanSquare(jr.sensors.Twist("main", "end"), moving=0.03),
    "deflection": jr.objectives.PeakValue(jr.sensors.Radial("main")),
}
T_END, RATE, STEP = 3.0, 1000.0, 1.25e-4
AXES = ("end.profile.duration", "main.unbalance.eccentricity")


def swept(points: int, **more):
    machine = line(1e-5, jr.PrescribedSpin(jr.CosineRamp(1000.0, 1.0)), {})
    grid = {AXES[0]: np.geomspace(0.2, 2.5, points), AXES[1]: np.linspace(2e-5, 5e-4, points)}
    return jr.sweep(
        machine, jr.Cases.grid(grid), OUTPUTS, t_end=T_END, sample_rate=RATE, step=STEP, **more
    )


def draw(found):
    fig, axes = figure(1, 2, (13.0, 4.8))
    x, y = found[AXES[0]].values, 1e3 * found[AXES[1]].values
    for ax, name, factor, words in (
        (axes[0, 0], "twist", 180 / np.pi, "RMS twist main to drive, deg"),
        (axes[0, 1], "deflection", 1e3, "largest deflection of main, mm"),
    ):
        picture = ax.pcolormesh(
            x, y, factor * found[name].values.T, cmap="viridis", shading="nearest"
        )
        fig.colorbar(picture, ax=ax, label=words)
        ax.set_xscale("log")
        ticks = (0.2, 0.5, 1.0, 2.0)
        ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
        ax.minorticks_off()
        label(ax, "ramp time, s", "eccentricity of main, mm")
        ax.grid(False)
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/ramp_map"))
    parser.add_argument("--points", type=int, default=12, help="of each axis (default: 12)")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    found = swept(given.points)
    twist = np.degrees(found["twist"].values)
    print(f"{twist.size} start-ups; RMS twist {twist.min():.4f} to {twist.max():.4f} deg")
    growth = twist[:, -1] / twist[:, 0]
    print(
        f"from the least to the largest unbalance the twist grows {growth[0]:.3g} times "
        f"in the quickest ramp, {growth[-1]:.3g} times in the slowest"
    )
    save_figure(draw(found), given.out / "map.png")
    print(f"{time.perf_counter() - began:.0f} s in all; figure in {given.out}/")


if __name__ == "__main__":
    main()
