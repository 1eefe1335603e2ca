"""What the seals of a pump do to its rotor: wet critical speeds, and instability by preswirl.

A pump of three stages between bearings, whose head grows with the speed squared. Left: whirl in bending over
the speed, dry, with the seals in liquid, and with their clearances worn to twice what they were; where it
meets the dashed line, unbalance excites it. Right: damping of the least damped forward whirl at the running
speed over the swirl with which the liquid enters the seals, which swirl brakes take away.

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

RUNNING = 3600 * np.pi / 30
STATIONS = ("stage 1", "stage 2", "stage 3")


def ring(length: float, share: float) -> jr.elements.AnnularSeal:
    """A seal in water at 20 degC that sees a share of a stage's rise of pressure, 15 bar when running."""
    return jr.elements.AnnularSeal(
        diameter=0.16,
        length=length,
        clearance=2.5e-4,
        pressure_drop=1e4,
        pressure_rise=share * 15e5 / RUNNING**2,
        viscosity=1.0e-3,
        density=998.0,
        preswirl=0.5,
        inlet_loss=0.2,
    )


def build(wet: bool = True) -> jr.Machine:
    """Driven at its left end."""
    stages = {name: jr.Rotor(22.0, 0.25, 0.14, jr.Unbalance(1e-5, 0.0)) for name in STATIONS}
    line = {"left": jr.Node()}
    for k, (name, stage) in enumerate(stages.items()):
        line |= {f"shaft {k + 1}": jr.FiniteElementShaft(0.4, 0.06, elements=3), name: stage}
    line |= {"shaft 4": jr.FiniteElementShaft(0.4, 0.06, elements=3), "right": jr.Node()}
    bearing = jr.LinearSupport([6e7, 6e7, 0, 0, 0, 0], [4e3, 4e3, 0, 0, 0, 0])
    held = {f"bearing at {end}": (bearing, end) for end in ("left", "right")}
    if wet:
        held |= {f"neck {k + 1}": (ring(0.03, 0.75), at) for k, at in enumerate(STATIONS)}
        held |= {"piston": (ring(0.12, 3.0), "stage 3")}
    return jr.Machine.in_line(
        line,
        attachments=held,
        fixed={"left": ("z",)},
        prescribed={"left": {"phi": jr.ConstantSpeed(RUNNING)}},
    )


def changed(machine: jr.Machine, field: str, value: float) -> jr.Machine:
    names = [n for n, e in machine.elements().items() if isinstance(e, jr.elements.AnnularSeal)]
    return machine.set({f"{name}.{field}": value for name in names})


def bending(axes, machines: dict[str, jr.Machine]) -> None:
    speeds = np.linspace(30.0, 1.25 * RUNNING, 16)
    rpm = speeds * 30 / np.pi
    for colour, (words, machine) in zip(COLOURS, machines.items()):
        found = [
            [
                m.frequency / (2 * np.pi)
                for m in jr.modes(model, 40)
                if m.kind == "lateral" and m.damping_ratio < 0.4
            ]
            for model in (jr.linearize(machine, s, at="undeformed") for s in speeds)
        ]
        for x, frequencies in zip(rpm, found):
            axes.plot(np.full(len(frequencies), x), frequencies, ".", ms=4, color=colour)
        axes.plot([], [], "o", ms=5, color=colour, label=words)
    axes.plot(rpm, rpm / 60, "--", color="grey", lw=1, label="once a turn")
    axes.set_ylim(0, 130)
    label(axes, "speed, rpm", "whirl in bending, Hz")
    axes.set_title("With a damping ratio below 0.4", loc="left")
    legend(axes)


def first_forward(machine: jr.Machine) -> float:
    """Damping ratio of the first forward whirl at the running speed."""
    found = jr.modes(jr.linearize(machine, RUNNING, at="undeformed"), 40)
    return min(m.damping_ratio for m in found if m.kind == "lateral" and m.whirl > 0.3)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/pump_seals"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    new = build()
    worn = changed(new, "clearance", 5e-4)
    ((left, right),) = axes = figure(1, 2, (11.0, 4.6))[1]
    bending(left, {"dry": build(wet=False), "wet, as new": new, "wet, worn": worn})
    swirl = np.linspace(0.0, 1.0, 6)
    for colour, (words, machine) in zip(COLOURS[1:], (("as new", new), ("worn", worn))):
        ratio = [first_forward(changed(machine, "preswirl", x)) for x in swirl]
        right.plot(swirl, ratio, "-o", ms=4, color=colour, label=words)
        print(
            f"{words}: damping ratio {ratio[0]:.3f} without swirl, {ratio[-1]:.3f} with all of it"
        )
    right.axhline(0.0, color="grey", lw=1)
    label(right, "preswirl, of the rotor's surface speed", "damping ratio")
    right.set_title("Least damped forward whirl at 3600 rpm", loc="left")
    legend(right)
    save_figure(axes, given.out / "pump_seals.png")
    print(f"Figure in {given.out}")


if __name__ == "__main__":
    main()
