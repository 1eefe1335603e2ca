"""A pump rotor dry and wet: what stiffness and inertia of its seals do to critical speeds and stability.

The shaft of a multistage pump on two bearings carries four impellers. In water each wear ring adds the
coefficients of an annular seal: direct stiffness that grows with the pressure (Lomakin), cross stiffness,
damping and the inertia of the water (Childs, Turbomachinery Rotordynamics, 1993, ch. 4, for how they
grow with the speed). The same rotor is looked at dry, wet without inertia, and wet.

    python experiments/wet_pump.py [--out results/wet_pump]
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import jaxrotor as jr

RPM = np.pi / 30
# Of one wear ring at the rated speed: N/m, N/m, N·s/m, kg.
RATED = 3600 * RPM
STIFFNESS, CROSS, DAMPING, INERTIA = 2.0e6, 1.0e6, 8.0e3, 12.0
PLACES = ("impeller 1", "impeller 2", "impeller 3", "impeller 4")


def ring(inertia: float) -> jr.SpeedDependentSupport:
    """Stiffness with the square of the speed, cross stiffness and damping in proportion, inertia constant."""
    speeds = np.linspace(0.0, 6000 * RPM, 13)
    share = speeds / RATED
    k, c, m = np.zeros((3, speeds.size, 6, 6))
    k[:, 0, 0] = k[:, 1, 1] = STIFFNESS * share**2
    k[:, 0, 1], k[:, 1, 0] = CROSS * share, -CROSS * share
    c[:, 0, 0] = c[:, 1, 1] = DAMPING * share
    m[:, 0, 0] = m[:, 1, 1] = inertia
    return jr.SpeedDependentSupport(speeds, k, c, m)


def pump(rings: bool, inertia: float = 0.0) -> jr.Machine:
    names = ["left", *PLACES, "right"]
    shaft = jr.FiniteElementShaft(0.4, 0.08, elements=2)
    line: dict = {"left": jr.Node()}
    for before, name in zip(names, names[1:]):
        line[f"{before} to {name}"] = shaft
        line[name] = jr.Rotor(25.0, 0.3, 0.2) if name in PLACES else jr.Node()
    bearing = jr.LinearSupport([5e7, 5e7, 1e7, 0, 0, 0], [2e4, 2e4, 1e3, 0, 0, 0])
    attached = {"bearing 1": (bearing, "left"), "bearing 2": (bearing, "right")}
    if rings:
        attached |= {f"ring {k + 1}": (ring(inertia), name) for k, name in enumerate(PLACES)}
    return jr.Machine.in_line(line, attached)


def study(speeds: np.ndarray) -> dict[str, jr.linear.Campbell]:
    """Lateral modes over speed of the three."""
    machines = {
        "dry": pump(False),
        "wet, without inertia": pump(True),
        "wet": pump(True, INERTIA),
    }
    return {
        name: jr.campbell(machine, speeds, count=8, at="undeformed", progress=False)
        for name, machine in machines.items()
    }


def figure(found: dict[str, jr.linear.Campbell], speeds: np.ndarray) -> plt.Figure:
    drawing, (above, below) = plt.subplots(
        2, 1, figsize=(8.5, 7), sharex=True, layout="constrained"
    )
    rpm = speeds / RPM
    for (name, one), colour in zip(found.items(), ("0.5", "tab:orange", "tab:blue")):
        lateral = [k for k, kind in enumerate(one.kinds) if kind == "lateral"]
        above.plot([], [], color=colour, label=name)
        for k in lateral:
            # the lowest pair of each sense, and the next
            frequency = one.frequencies[:, k] / (2 * np.pi)
            if np.nanmin(frequency) > 110:
                continue
            style = "-" if one.whirl[-1, k] > 0 else "--"
            above.plot(rpm, frequency, style, color=colour)
            if one.whirl[-1, k] > 0:
                below.plot(rpm, one.damping_ratios[:, k], color=colour)
                number = one.names[k].split()[0]
                end = rpm[-1] * 1.01, one.damping_ratios[-1, k]
                below.text(*end, number, va="center", color=colour)
    above.plot(rpm, rpm / 60, ":", color="k", lw=1)
    above.text(3600, 63, "1x", ha="right")
    above.set(ylabel="frequency / Hz", ylim=(0, 110))
    above.set_title("Forward (full) and backward (dashed) whirl of a pump rotor")
    above.legend()
    below.axhline(0, color="k", lw=0.8)
    below.set(xlabel="speed / rpm", ylabel="damping ratio of forward whirl 1 and 2")
    below.set_xlim(0, rpm[-1] * 1.05)
    return drawing


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/wet_pump"))
    given = parser.parse_args()
    speeds = np.linspace(0.0, 6000 * RPM, 41)
    found = study(speeds)
    for name, one in found.items():
        crossings = {
            mode: [round(w / RPM) for w in met]
            for mode, met in one.crossings().items()
            if "forward" in mode
        }
        print(f"{name}: forward whirl meets the speed at {crossings} rpm")
    given.out.mkdir(parents=True, exist_ok=True)
    figure(found, speeds).savefig(given.out / "wet_pump.png", dpi=130)
    print(given.out / "wet_pump.png")


if __name__ == "__main__":
    main()
