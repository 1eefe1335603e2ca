"""What the labyrinths of a compressor do to its stability, with and without swirl brakes.

A compressor of five impellers between bearings; each impeller's eye and the balance piston have a labyrinth
of teeth on the stator, computed from its dimensions and the gas, which enters turning along with the
impellers. Left: the logarithmic decrement of the first forward whirl at the running speed over that preswirl,
for three pressures of suction, with the coefficients at the whirl's own frequency; below zero the rotor
whirls by itself. Swirl brakes before the teeth take the swirl down, here to a tenth. Right: the swirl in the
chambers of the piston: along the teeth the walls bring it to what they settle it at.

    python experiments/compressor_labyrinths.py [--out results/compressor_labyrinths]

Sources: Childs & Scharrer, J. Eng. Gas Turbines Power 108 (1986) 325; Benckert & Wachter, NASA CP-2133
(1980) 189 (swirl brakes).
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import equinox as eqx
import jax.numpy as jnp
import numpy as np

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, figure, label, legend

RPM = np.pi / 30
RUNNING = 9000 * RPM
STAGES = tuple(f"impeller {k}" for k in range(1, 6))
# Of the suction, Pa.
PRESSURES = (10e5, 30e5, 60e5)
# Swirl of the gas over the surface's speed, as it comes from the impellers' sides, and behind brakes.
BARE, BRAKED = 0.6, 0.1


def eye(suction: float, stage: int) -> jr.elements.LabyrinthSeal:
    """Of natural gas; an impeller raises the pressure by a quarter."""
    before = suction * 1.25**stage
    return labyrinth(0.26, 6, before * 1.18, before)


def labyrinth(
    diameter: float, teeth: int, high: float, low: float, preswirl: float = BARE
) -> jr.elements.LabyrinthSeal:
    return jr.elements.LabyrinthSeal(
        diameter=diameter,
        clearance=3e-4,
        pitch=4e-3,
        height=3.5e-3,
        inlet_pressure=high,
        outlet_pressure=low,
        temperature=330.0,
        gas_constant=440.0,
        viscosity=1.2e-5,
        heat_ratio=1.27,
        preswirl=preswirl,
        tooth_width=2e-4,
        teeth=teeth,
        on="stator",
    )


def seals(suction: float) -> dict[str, tuple[jr.elements.LabyrinthSeal, str]]:
    """Each with its place."""
    found = {f"eye {k + 1}": (eye(suction, k), name) for k, name in enumerate(STAGES)}
    piston = labyrinth(0.22, 24, suction * 1.25**5, suction)
    return found | {"piston": (piston, STAGES[-1])}


def build(supports: dict) -> jr.Machine:
    shaft = jr.FiniteElementShaft(0.2, 0.11, elements=2)
    line: dict = {"left": jr.Node()}
    for name in STAGES:
        line |= {f"to {name}": shaft, name: jr.Rotor(35.0, 0.7, 0.4)}
    line |= {"shaft end": shaft, "right": jr.Node()}
    bearing = jr.LinearSupport([1.5e8, 1.5e8, 1e7, 0, 0, 0], [8e4, 8e4, 1e3, 0, 0, 0])
    held = {f"bearing {end}": (bearing, end) for end in ("left", "right")}
    return jr.Machine.in_line(line, held | supports)


FREQUENCIES = np.linspace(100.0, 1000.0, 10)


def tables(suction: float, preswirl: float) -> dict[str, jr.elements.WhirlDependentSupport]:
    """Of each labyrinth at the running speed, over the frequency of the whirl."""
    found = {}
    for name, (seal, _) in seals(suction).items():
        swirling = eqx.tree_at(lambda s: s.preswirl, seal, jnp.asarray(preswirl))
        found[name] = swirling.support([0.99 * RUNNING, 1.01 * RUNNING], FREQUENCIES)
    return found


def first_forward(machine: jr.Machine) -> jr.linear.Mode:
    found = jr.linear.matched_modes(machine, RUNNING, count=6, at="undeformed")
    forward = [m for m in found if m.whirl > 0 and m.frequency > 10.0 and m.damping_ratio < 0.5]
    return min(forward, key=lambda m: m.frequency)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/compressor_labyrinths"))
    given = parser.parse_args()
    ((left, right),) = axes = figure(1, 2, (11.0, 4.6))[1]
    swirls, machine = np.array([0.0, 0.3, 0.6, 0.9]), None
    for colour, suction in zip(COLOURS, PRESSURES):
        decrements = []
        for preswirl in swirls:
            found = tables(suction, preswirl)
            if machine is None:
                places = {name: at for name, (_, at) in seals(suction).items()}
                machine = build({name: (part, places[name]) for name, part in found.items()})
            ratio = first_forward(machine.set(found)).damping_ratio
            decrements.append(2 * np.pi * ratio / (1 - ratio**2) ** 0.5)
        left.plot(swirls, decrements, "o-", color=colour, label=f"{suction / 1e5:.0f} bar")
        bare, braked = np.interp((BARE, BRAKED), swirls, decrements)
        print(
            f"{suction / 1e5:.0f} bar: logarithmic decrement {bare:.3f}, with brakes {braked:.3f}"
        )
    left.axhline(0.0, color="grey", lw=1)
    for swirl, words in ((BARE, "without brakes"), (BRAKED, "with swirl brakes")):
        left.axvline(swirl, color="grey", lw=1, ls=":")
        left.annotate(
            words, (swirl, 0.03), (4, 0), left.get_xaxis_transform(), "offset points", fontsize=8
        )
    for colour, swirl, words in zip(
        COLOURS, (BARE, BRAKED), ("without brakes", "with swirl brakes")
    ):
        piston = labyrinth(0.22, 24, PRESSURES[1] * 1.25**5, PRESSURES[1], swirl)
        found = np.asarray(piston.coefficients(RUNNING).swirl) / (0.11 * RUNNING)
        right.plot(np.arange(24), [swirl, *found], "o-", ms=3, color=colour, label=words)
    label(left, "preswirl over the surface's speed", "logarithmic decrement")
    label(right, "chamber of the piston", "swirl over the surface's speed")
    right.set_ylim(0.0, None)
    legend(left, title="suction")
    legend(right)
    given.out.mkdir(parents=True, exist_ok=True)
    save_figure(axes, given.out / "compressor_labyrinths.png")
    print(given.out / "compressor_labyrinths.png")


if __name__ == "__main__":
    main()
