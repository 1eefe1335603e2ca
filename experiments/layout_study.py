"""Where must rotors and bearings sit on the 287 mm shaft for what the paper observes to hold?

Matyja & Łazarz (2014) show the layout of their machine in a figure alone. Here the four sections of the
shaft are drawn at random (all splits of 287 mm are equally likely), each machine is run up through its
critical speed, and asked:

    comparable   the overhung rotor, with a fiftieth of the unbalance, deflects 0.4 to 2.5 times as far as
                 main
    tilts        it tilts more than main
    self-centres at full speed main's mass centre is half as far from the axis as at its farthest, or less

    python experiments/layout_study.py [--out DIR] [--layouts 800]
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
from active_torsional_damper import line

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

WHOLE, LEAST = 0.287, 0.02  # m: of the shaft, and of a section
OURS = (0.060, 0.080, 0.127, 0.020)
T_END, RATE = 2.6, 1000.0
SECTIONS = [f"shaft {k}.length" for k in (1, 2, 3, 4)]


class Tilt(jr.sensors.AbstractSensor):
    """Tilt of a station against the axis, rad."""

    station: str = eqx.field(static=True)
    unit = "rad"

    def signal(self, response):
        at = response[self.station]
        return jnp.sqrt(at.psi**2 + at.theta**2 + 1e-24)


class MassCentre(jr.sensors.AbstractSensor):
    """Distance of a station's mass centre from the axis, m."""

    station: str = eqx.field(static=True)
    unit = "m"

    def signal(self, response):
        centre = response[self.station].mass_centre
        return jnp.sqrt(centre[:, 0] ** 2 + centre[:, 1] ** 2 + 1e-24)


OUTPUTS = {
    "main": jr.objectives.PeakValue(jr.sensors.Radial("main")),
    "second": jr.objectives.PeakValue(jr.sensors.Radial("second")),
    "tilt of main": jr.objectives.PeakValue(Tilt("main")),
    "tilt of second": jr.objectives.PeakValue(Tilt("second")),
    "centre": jr.objectives.PeakValue(MassCentre("main")),
    "centre at speed": jr.objectives.PeakValue(MassCentre("main"), start=2.4),
}


def layouts(count: int, seed: int = 0) -> jr.Cases:
    """The first is ours (physics.md); a split is a point of a simplex, drawn evenly."""
    drawn = np.random.default_rng(seed).dirichlet(np.ones(4), count - 1)
    lengths = np.concatenate([[OURS], LEAST + (WHOLE - 4 * LEAST) * drawn])
    return jr.Cases(dict(zip(SECTIONS, lengths.T)), f"{count} splits of 287 mm, seed {seed}")


def swept(count: int, seed: int = 0, **more):
    machine = line(0.002, jr.PrescribedSpin(jr.CosineRamp(1000.0, 2.5)), {}, twist="paper")
    return jr.sweep(machine, layouts(count, seed), OUTPUTS, t_end=T_END, sample_rate=RATE, **more)


def observed(found) -> dict[str, np.ndarray]:
    ratio = found["second"].values / found["main"].values
    return {
        "comparable": (ratio > 0.4) & (ratio < 2.5),
        "tilts": found["tilt of second"].values > found["tilt of main"].values,
        "self-centres": found["centre at speed"].values < 0.5 * found["centre"].values,
    }


def draw(found, holds: np.ndarray):
    fig, axes = figure(1, 2, (12.0, 5.0))
    lengths = {path: 1e3 * found[path].values for path in SECTIONS}
    for ax, (a, b), words in (
        (axes[0, 0], (0, 1), ("overhang of second, mm", "left bearing to main, mm")),
        (axes[0, 1], (2, 3), ("main to right bearing, mm", "right bearing to drive, mm")),
    ):
        x, y = lengths[SECTIONS[a]], lengths[SECTIONS[b]]
        ax.plot(x[~holds], y[~holds], ".", color=GREY, markersize=3, alpha=0.5, label="some fail")
        ax.plot(
            x[holds], y[holds], ".", color=COLOURS[0], markersize=6, label="all observations hold"
        )
        ax.plot(x[:1], y[:1], "*", color=COLOURS[1], markersize=14, label="the layout used here")
        label(ax, *words)
    legend(axes[0, 0])
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/layout_study"))
    parser.add_argument("--layouts", type=int, default=800, help="how many (default: 800)")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    found = swept(given.layouts, given.seed)
    seen = observed(found)
    failed = np.asarray(found["failure"] != "")
    for name, holds in seen.items():
        print(
            f"{name:13} {100 * np.mean(holds[~failed]):5.1f} % of the layouts; ours: {bool(holds[0])}"
        )
    together = np.all(list(seen.values()), axis=0) & ~failed
    words = f"({together.sum()} of {together.size}; {failed.sum()} runs failed)"
    print(f"all together  {100 * np.mean(together):5.1f} % {words}")
    if together.any():
        for path, words in zip(
            SECTIONS, ("overhang", "left to main", "main to right", "right to drive")
        ):
            x = 1e3 * found[path].values[together]
            print(
                f"  {words:15} {np.percentile(x, 5):6.1f} to {np.percentile(x, 95):6.1f} mm (90 % of them)"
            )
    save_figure(draw(found, together), given.out / "layouts.png")
    print(f"{time.perf_counter() - began:.0f} s in all; figure in {given.out}/")


if __name__ == "__main__":
    main()
