"""What wear and preswirl of its seals do to a pump's rotor.

A pump of three stages between bearings, with a ring at each stage and a balance piston, all computed from
their dimensions; the pressures grow with the speed squared. Its first forward whirl over the speed, with
seals as new and worn to twice their clearance, and with water that enters them hardly turning (as behind
swirl brakes) or nearly as fast as the rotor. Left: frequency, whose crossing of the dotted line is the
critical speed. Right: damping; below zero the rotor whirls by itself.

    python experiments/pump_seals.py [--out results/pump_seals]

Sources: Black, J. Mech. Eng. Sci. 11 (1969) 206; Childs, Turbomachinery Rotordynamics (1993), ch. 4.
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, figure, label, legend

RPM = np.pi / 30
RUNNING = 3600 * RPM
STAGES = ("stage 1", "stage 2", "stage 3")
SEALS = ("ring 1", "ring 2", "ring 3", "piston")


def seal(length: float, share: float) -> jr.elements.AnnularSeal:
    """In water at 20 degC, with a share of a stage's rise of pressure, 15 bar when running."""
    return jr.elements.AnnularSeal(
        diameter=0.16,
        length=length,
        clearance=2.5e-4,
        pressure_drop=1e4,
        pressure_rise=share * 15e5 / RUNNING**2,
        viscosity=1.0e-3,
        density=998.0,
        inlet_loss=0.2,
    )


def build() -> jr.Machine:
    shaft = jr.FiniteElementShaft(0.4, 0.07, elements=2)
    line: dict = {"left": jr.Node()}
    for name in STAGES:
        line |= {f"to {name}": shaft, name: jr.Rotor(30.0, 0.35, 0.2)}
    line |= {"shaft end": shaft, "right": jr.Node()}
    bearing = jr.LinearSupport([6e7, 6e7, 1e7, 0, 0, 0], [2e4, 2e4, 1e3, 0, 0, 0])
    held = {f"bearing {end}": (bearing, end) for end in ("left", "right")}
    held |= {name: (seal(0.02, 0.75), at) for name, at in zip(SEALS, STAGES)}
    held |= {"piston": (seal(0.05, 3.0), "stage 3")}
    return jr.Machine.in_line(line, held)


def first_forward(machine: jr.Machine, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequency, Hz, and damping ratio over the speed."""
    found = jr.campbell(machine, speeds, count=8, at="undeformed", progress=False)
    forward = [
        k
        for k, kind in enumerate(found.kinds)
        if kind == "lateral" and found.whirl[-1, k] > 0 and found.damping_ratios[-1, k] < 0.9
    ]
    k = min(forward, key=lambda k: found.frequencies[-1, k])
    return found.frequencies[:, k] / (2 * np.pi), found.damping_ratios[:, k]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/pump_seals"))
    given = parser.parse_args()
    speeds = np.linspace(300 * RPM, 1.5 * RUNNING, 18)
    machine = build()
    ((left, right),) = axes = figure(1, 2, (11.0, 4.6))[1]
    for colour, preswirl in zip(COLOURS, (0.1, 0.9)):
        for style, words, clearance in (("-", "new", 2.5e-4), ("--", "worn", 5e-4)):
            as_is = {"preswirl": preswirl, "clearance": clearance}
            changed = machine.set({f"{s}.{k}": v for s in SEALS for k, v in as_is.items()})
            frequency, damping = first_forward(changed, speeds)
            told = f"{words}, preswirl {preswirl}"
            for axis, values in ((left, frequency), (right, damping)):
                axis.plot(speeds / RPM, values, style, color=colour, label=told)
            print(f"{told}: damping ratio {np.interp(RUNNING, speeds, damping):.3f} at 3600 rpm")
    left.plot(speeds / RPM, speeds / RPM / 60, ":", color="grey", label="once a turn")
    right.axhline(0.0, color="grey", lw=1)
    label(left, "speed, rpm", "first forward whirl, Hz")
    label(right, "speed, rpm", "its damping ratio")
    legend(left)
    given.out.mkdir(parents=True, exist_ok=True)
    save_figure(axes, given.out / "pump_seals.png")
    print(given.out / "pump_seals.png")


if __name__ == "__main__":
    main()
