"""Oil whirl and oil whip: a flexible rotor on two plain journal bearings, run up to nearly three times its
critical speed.

Up to the threshold of stability the rotor answers its unbalance alone. Beyond it the film drives it round
at about half the speed (oil whirl); growing from nothing it takes a while to show. The whirl's frequency
grows with the speed until it meets the rotor's first natural frequency and stays there however fast the
shaft turns (oil whip). The threshold of the linear model (Routh and Hurwitz, through the eight coefficients
of either film) is drawn into the waterfall.

    python experiments/oil_whirl.py [--out DIR] [--seconds 12]
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np

import jaxrotor as jr
from jaxrotor import plot
from jaxrotor.commands.output import save_figure

START, TOP = 150.0, 1400.0  # rad/s
RATE, HIGHEST = 1000.0, 240.0  # Hz


def machine(motion: jr.ConstantSpeed | jr.LinearRamp, viscosity: float = 0.04) -> jr.Machine:
    """A disc of 4 kg amid a shaft of 22 mm, 0.5 m between journals of 30 mm."""

    def journal():
        return jr.Rotor(mass=0.4, polar_inertia=5e-5, transverse_inertia=1e-4)

    def shaft():
        return jr.Shaft(length=0.25, diameter=0.022, rayleigh=(0.0, 2e-5))

    film = jr.JournalBearing(diameter=0.03, length=0.012, clearance=1.5e-4, viscosity=viscosity)
    return jr.Machine.in_line(
        {
            "left": journal(),
            "shaft 1": shaft(),
            "disc": jr.Rotor(
                mass=4.0,
                polar_inertia=0.012,
                transverse_inertia=0.007,
                unbalance=jr.Unbalance(1e-5),
            ),
            "shaft 2": shaft(),
            "right": journal(),
        },
        attachments={"left film": (film, "left"), "right film": (film, "right")},
        gravity=(0.0, -9.81, 0.0),
        fixed={"left": ("z",)},
        prescribed={"left": {"phi": motion}},
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/oil_whirl"), metavar="DIR")
    parser.add_argument("--seconds", type=float, default=12.0, help="of the run-up (default: 12)")
    args = parser.parse_args()

    still = machine(jr.ConstantSpeed(START))
    threshold = float(jr.stability_threshold(still, START, TOP, 43, at="equilibrium"))
    rigid = float(jr.linearize(still, threshold).damped_frequencies[0])
    print(
        f"threshold of the linear model: {threshold:.1f} rad/s, whirling at {rigid / threshold:.3f} of it"
    )

    run = jr.simulate(
        machine(jr.LinearRamp(TOP, args.seconds, START)),
        args.seconds,
        RATE,
        "running",
        rtol=1e-6,
        atol=1e-9,
    )
    print(f"{int(run.stats['steps'])} steps in {float(run.stats['seconds']):.1f} s")
    rpm = threshold * 60 / (2 * np.pi)
    for place, words in (("left", "journal in its bearing"), ("disc", "disc")):
        at = run[place]
        found = jr.diagnostics.waterfall(at.x, at.speed, RATE, y=at.y)
        for name, draw in (("map", plot.waterfall_map), ("cascade", plot.cascade)):
            ax = draw(found, highest=HIGHEST, title=f"Oil whirl and whip: {words}")
            if name == "map":
                ax.axhline(rpm, color="white", linewidth=0.8)
                ax.annotate(
                    "threshold of the linear model",
                    (0.01, rpm),
                    (0, 3),
                    xycoords=("axes fraction", "data"),
                    textcoords="offset points",
                    color="white",
                    fontsize=8,
                )
            path = args.out / f"{place}_{name}.png"
            save_figure(ax, path)
            print(f"wrote {path}")


if __name__ == "__main__":
    main()
