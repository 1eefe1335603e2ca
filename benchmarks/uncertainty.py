"""Are the stated uncertainties true? Six unbalance parameters of the two-rotor machine's run-up,
identified from 200 records with fresh noise each, for noise of 1 % and of 5 % of what the sensors see;
all 200 in one batched run.

    python benchmarks/uncertainty.py [--count 200] [--figure coverage.png]
"""

import argparse
import sys
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np
from machine import header

sys.path.insert(0, str(Path(__file__).parent.parent / "experiments"))
from identify_unbalance import unknowns
from synthetic import RUN_UP, run_up, two_rotors

import jaxrotor as jr
from jaxrotor.plot.style import COLOURS, figure, label, legend

LEVELS = (0.01, 0.05)


def picture(replicas: dict[float, jr.identification.Replicas]):
    """Distance from the truth in stated standard deviations, beside the bell it should make."""
    paths = next(iter(replicas.values())).paths
    fig, axes = figure(2, 3, (13.0, 7.0), sharex=True, sharey=True)
    z = np.linspace(-4, 4, 201)
    for i, (ax, path) in enumerate(zip(axes.ravel(), paths)):
        ax.plot(z, np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi), color="black", label="normal")
        for colour, (level, found) in zip(COLOURS, replicas.items()):
            away = (found.values[:, i] - found.truth[i]) / found.stated[:, i]
            words = f"{100 * level:g} % noise: {100 * found.covered[:, i].mean():.1f} % covered"
            ax.hist(
                away,
                bins=np.linspace(-4, 4, 25),
                density=True,
                histtype="step",
                color=colour,
                label=words,
            )
        label(ax, "distance from the truth, stated standard deviations", "density", path)
        legend(ax, loc="upper left")
    axes[0, 0].set_ylim(0, 0.72)
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--figure", type=Path)
    given = parser.parse_args()
    print(header("jaxlib", "optimistix"))
    found = {}
    print("| parameter | noise | 95 % intervals that cover the truth | spread / stated |")
    print("|---|---|---|---|")
    for level in LEVELS:
        sensed, record = run_up(level, 1)
        base = jr.identify(
            two_rotors(),
            unknowns(),
            sensed,
            jr.MeasuredRun(record, step=RUN_UP["step"]),
            shaft="main",
        )
        began = time.perf_counter()
        found[level] = jr.identification.bootstrap(base, given.count, seed=2)
        took = time.perf_counter() - began
        for path in base.paths:
            covered, spread = found[level].coverage[path], found[level].spread[path]
            print(f"| `{path}` | {100 * level:g} % | {100 * covered:.1f} % | {spread:.3f} |")
        print(f"{given.count} identifications: {took:.0f} s, compiling included", file=sys.stderr)
    if given.figure:
        picture(found).savefig(given.figure, dpi=130, bbox_inches="tight")


if __name__ == "__main__":
    main()
