"""The same rotor in bearings of different bores: which of them keeps it from whirling.

A flexible rotor, 800 kg, in two bearings alike. Each bore is solved under half the weight from 600 to 9000
rpm: two axial grooves, an ellipse, three lobes, offset halves, four tilting pads. Left: damping of the first
forward whirl; below zero the rotor whirls by itself. Middle: where the journal runs, from the slowest speed
(lowest) to the fastest. Right: pressure on the pads at 3000 rpm, outward from the bore.

    python experiments/pad_bearings.py [--out results/pad_bearings]

Sources: Lund & Thomsen (1978) and Someya (1989) for the bores; Lund, J. Eng. Ind. 96 (1974) 509 for whirl.
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

RPM, DEG = np.pi / 30, np.pi / 180
SPEEDS = np.linspace(600 * RPM, 9000 * RPM, 15)
MASS = 800.0
OIL = dict(diameter=0.1, length=0.05, clearance=1e-4, viscosity=0.02)
OIL |= dict(load=(0.0, -0.5 * MASS * 9.81), speeds=SPEEDS)
HALVES, THREE = (-90 * DEG, 90 * DEG), (-90 * DEG, 30 * DEG, 150 * DEG)
CORNERS = (-135 * DEG, -45 * DEG, 45 * DEG, 135 * DEG)
# all of the same clearance where they are nearest, so the same shaft fits
BORES = {
    "two axial grooves": dict(pads=HALVES, arc=160 * DEG),
    "elliptical, preload 0.5": dict(pads=HALVES, arc=160 * DEG, preload=0.5),
    "three lobes, preload 0.5": dict(pads=THREE, arc=100 * DEG, preload=0.5),
    "offset halves, preload 0.5": dict(pads=HALVES, arc=160 * DEG, preload=0.5, offset=1.0),
    "four tilting pads, preload 0.3": dict(pads=CORNERS, arc=75 * DEG, preload=0.3),
}


def bearing(name: str) -> jr.elements.FixedPadBearing | jr.elements.TiltingPadBearing:
    if "tilting" not in name:
        return jr.elements.FixedPadBearing(**OIL, **BORES[name])
    frequencies = np.linspace(0.0, 2 * SPEEDS[-1], 13)
    return jr.elements.TiltingPadBearing(frequencies=frequencies, **OIL, **BORES[name])


def build(part) -> jr.Machine:
    half = jr.FiniteElementShaft(0.75, 0.1, elements=3)
    line = {
        "left": jr.Node(),
        "shaft 1": half,
        "disc": jr.Rotor(MASS - 92.0, 40.0, 25.0),
        "shaft 2": half,
        "right": jr.Node(),
    }
    return jr.Machine.in_line(line, {f"film {end}": (part, end) for end in ("left", "right")})


def first_whirl(machine: jr.Machine) -> np.ndarray:
    """Damping ratio of the least damped forward whirl over the speeds."""
    found = jr.campbell(machine, SPEEDS, count=10, at="undeformed", progress=False)
    lateral = np.array([kind == "lateral" for kind in found.kinds])
    forward = lateral & (np.asarray(found.whirl) > 0) & (np.asarray(found.frequencies) > 1.0)
    return np.min(np.where(forward, found.damping_ratios, np.inf), axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/pad_bearings"))
    given = parser.parse_args()
    ((left, middle, right),) = axes = figure(1, 3, (15.0, 4.8))[1]
    for colour, name in zip(COLOURS, BORES):
        part = bearing(name)
        ratios = first_whirl(build(part))
        left.plot(SPEEDS / RPM, ratios, color=colour, label=name)
        points = [part.working_point(speed) for speed in SPEEDS]
        x, y = np.array([point.eccentricity for point in points]).T * 1e6
        middle.plot(x, y, ".-", color=colour)
        point = part.working_point(3000 * RPM)
        for angles, pressures in zip(point.angles, point.pressures):
            out = 50.0 + 8e-6 * np.asarray(pressures)
            right.plot(out * np.cos(angles), out * np.sin(angles), color=colour)
        unstable = SPEEDS[ratios < 0]
        words = f"whirls from {unstable[0] / RPM:.0f} rpm on" if len(unstable) else "does not whirl"
        print(
            f"{name}: {words}; {float(point.power):.0f} W, {float(point.leakage) * 6e4:.1f} l/min"
        )
    left.axhline(0.0, color="grey", lw=1)
    label(left, "speed, rpm", "damping ratio of the first forward whirl")
    legend(left)
    turn = np.linspace(0, 2 * np.pi, 200)
    middle.plot(100 * np.cos(turn), 100 * np.sin(turn), ":", color="grey")
    right.plot(50 * np.cos(turn), 50 * np.sin(turn), ":", color="grey")
    for axis in (middle, right):
        axis.set_aspect("equal")
    label(middle, "x of the journal, µm", "y, µm")
    label(right, "x, mm", "y, mm (8 mm outward for 1 MPa)")
    given.out.mkdir(parents=True, exist_ok=True)
    save_figure(axes, given.out / "pad_bearings.png")
    print(given.out / "pad_bearings.png")


if __name__ == "__main__":
    main()
