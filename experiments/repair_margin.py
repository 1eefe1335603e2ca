"""A separation margin that is missing, bought by gradient: which dimension pays for it?

A rotor with a disc in the middle runs from 4500 to 7500 rpm. Its first resonance keeps 13.4 % below the least
speed; by its amplification factor it needs 13.8 %. The diameter of the shafts, the stiffness and the damping
of the bearings may change within bounds, and as little as possible. The check is `separation_margins` itself,
as a constraint of `jr.optimize`, with its exact derivatives.

    python experiments/repair_margin.py [--out DIR] [--iterations 60]
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

import jaxrotor as jr
from jaxrotor import standards
from jaxrotor.core.files import written_whole
from jaxrotor.plot.style import figure

RPM = np.pi / 30
LEAST, GREATEST = 4500 * RPM, 7500 * RPM
PLACED = {"disc": 1e-4}  # kg·m
ROOM = 0.5  # % more than asked for
# The diameter of both shafts (m), radial stiffness (N/m) and damping (N·s/m) of both bearings.
START = np.array([0.080, 2.0e7, 2.0e4])
BOUNDS = ((0.070, 0.090), (1.0e7, 4.0e7), (1.0e4, 3.0e4))
NAMES = ("shaft diameter", "bearing stiffness", "bearing damping")
UNITS, SCALES = ("mm", "MN/m", "kN·s/m"), (1e3, 1e-6, 1e-3)


def build() -> jr.Machine:
    def bearing():
        return jr.LinearSupport([START[1]] * 2 + [0.0] * 4, [START[2]] * 2 + [0.0] * 4)

    def shaft():
        return jr.FiniteElementShaft(0.5, START[0], elements=2)

    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft 1": shaft(),
            "disc": jr.Rotor(60.0, 1.0, 0.6),
            "shaft 2": shaft(),
            "right": jr.Node(),
        },
        attachments={"bearing 1": (bearing(), "left"), "bearing 2": (bearing(), "right")},
        fixed={"left": ("z", "phi")},
    )


def unknowns() -> list[jr.Unknown]:
    """Both shafts are one, and both bearings alike in x and y."""

    def bearings(what: str, bounds: tuple[float, float]) -> jr.Unknown:
        first, *rest = [f"bearing {i}.{what}[{k}]" for i in (1, 2) for k in (0, 1)]
        return jr.Unknown(first, bounds=bounds, also=dict.fromkeys(rest, 1.0))

    shafts = jr.Unknown("shaft 1.diameter", bounds=BOUNDS[0], also={"shaft 2.diameter": 1.0})
    return [shafts, bearings("stiffness", BOUNDS[1]), bearings("damping", BOUNDS[2])]


def check(machine, **more):
    return standards.separation_margins(
        machine, "disc.x", LEAST, GREATEST, PLACED, at="undeformed", **more
    )


def dimensions(machine):
    return jnp.stack(
        [
            machine.get("shaft 1.diameter"),
            machine.get("bearing 1.stiffness")[0],
            machine.get("bearing 1.damping")[0],
        ]
    )


def change(machine):
    """Squares of relative changes, in %²."""
    return jnp.sum((100 * jnp.log(dimensions(machine) / START)) ** 2)


def missing(machine):
    return check(machine, count=1, points=61)


def repaired(iterations: int = 60) -> jr.optimization.Optimum:
    short = standards.Shortfall(missing)
    return jr.optimize(
        build(), unknowns(), change, [short <= -ROOM], iterations=iterations, tolerance=1e-7
    )


def draw(before, after, out: Path) -> Path:
    fig, axes = figure(2, 1, (9.5, 8.0))
    for panel, (words, found) in zip(axes[:, 0], (("before", before), ("after", after))):
        found.plot(ax=panel)
        panel.set_title(words, fontsize=10, loc="left")
    with written_whole(out / "repair_margin.png") as part:
        fig.savefig(part, dpi=150, format="png", bbox_inches="tight")
    return out / "repair_margin.png"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/repair_margin"))
    parser.add_argument("--iterations", type=int, default=60)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    found = repaired(given.iterations)
    before, after = check(build()), check(found.machine)
    print(before, after, sep="\n\n")
    for name, unit, scale, a, b in zip(NAMES, UNITS, SCALES, START, dimensions(found.machine)):
        print(
            f"{name:>18}: {a * scale:.5g} -> {float(b) * scale:.5g} {unit} ({100 * (b / a - 1):+.2f} %)"
        )
    print(f"figure: {draw(before, after, given.out)}")
    print(f"{time.perf_counter() - began:.0f} s in all")


if __name__ == "__main__":
    main()
