"""Effort against vibration: what a given amount of control torque can do about a torsional vibration.

The start by an induction motor of `active_torsional_damper.py`, its bending held (only the twisting counts
here). For each of a row of efforts (RMS of the actuator's torque) three controllers are tuned by gradient
for the least vibration that this effort allows: a PD controller, one that is resonant at the torsional
mode, and a small neural network. A limit moves from design to design; nothing is compiled anew for it.

    python experiments/pareto.py [--out DIR] [--points 5] [--controllers PD,resonant,neural]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np
from active_torsional_damper import RATE, STEP, TWIST, line, motor
from tqdm import tqdm

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

T_END = 0.6
RMS = jr.objectives.RootMeanSquare(TWIST, moving=0.03)
EFFORT = jr.objectives.RootMeanSquare(jr.sensors.Signal("damper", "torque"))
MODE = 326.0  # rad/s


def controllers() -> dict[str, tuple[jr.elements.AbstractController, list[jr.Unknown]]]:
    at = "damper.controller."
    network = jr.elements.NeuralController.start([0.05, 15.0], 5.0, jax.random.PRNGKey(0), width=4)
    return {
        "PD": (
            jr.elements.PD(0.0, 0.5),
            [jr.Unknown(at + "stiffness", scale=100.0), jr.Unknown(at + "damping", positive=True)],
        ),
        "resonant": (
            jr.elements.ResonantController(0.5, MODE, 0.5),
            [
                jr.Unknown(at + name, positive=True)
                for name in ("damping", "frequency", "bandwidth")
            ],
        ),
        "neural": (network, [jr.Unknown(at + "weights", scale=0.3)]),
    }


def machine(controller: jr.elements.AbstractController) -> jr.Machine:
    actuator = jr.elements.Actuator(limit=20.0, bandwidth=3000.0)
    damper = jr.elements.ActiveTorque(controller, jr.elements.TwistOf(0, 1), actuator)
    lateral = ("x", "y", "z", "psi", "theta")
    stations = ("second", "left", "main", "right", "end")
    attachments = {"motor": (motor(), "end"), "damper": (damper, ("end", "main"))}
    end = jr.Rotor(8.0, 0.016, 0.016)
    return line(1e-5, end, attachments, fixed=dict.fromkeys(stations, lateral))


RUN = jr.optimization.SimulatedRun(T_END, RATE, "undeformed", step=STEP)


def front(name: str, efforts, progress: bool | None = None) -> list[jr.optimization.Optimum]:
    """The best of one kind of controller for each effort, N·m, each from where the last one ended."""
    controller, unknowns = controllers()[name]
    m = machine(controller)
    found = []
    for effort in tqdm(
        efforts, name, leave=False, disable=None if progress is None else not progress
    ):
        best = jr.optimize(
            m,
            unknowns,
            RUN.measure(RMS),
            [RUN.measure(EFFORT) <= effort],
            iterations=40,
            tolerance=1e-4,
            progress=False,
        )
        found.append(best)
        m = best.machine
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/pareto"))
    parser.add_argument("--points", type=int, default=5, help="efforts (default: 5)")
    parser.add_argument("--controllers", default="PD,resonant,neural", help="which (default: all)")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    efforts = np.geomspace(0.2, 5.0, given.points)
    off = machine(jr.elements.PD(0.0, 0.0))
    alone = float(RMS(jr.simulate(off, T_END, RATE, "undeformed", step=STEP)))
    print(f"without: {np.degrees(alone):.4f} deg RMS")
    fig, axes = figure(1, 1, (7.5, 4.8))
    ax = axes[0, 0]
    ax.axhline(np.degrees(alone), color=GREY, linestyle="--", label="without")
    for name, colour, mark in zip(given.controllers.split(","), COLOURS, "os^"):
        designs = front(name, efforts)
        effort = [one.constraints[0].value for one in designs]
        rms = [np.degrees(one.objective) for one in designs]
        for x, y, one in zip(effort, rms, designs):
            price = np.degrees(one.constraints[0].price)
            gain = f"{price:+.4f} deg for one more N·m"
            print(f"{name:9} {x:6.3f} N·m RMS: {y:.4f} deg RMS, {gain}; {one.stopped}")
        ax.semilogy(effort, rms, mark + "-", color=colour, label=name)
    label(ax, "effort: RMS torque of the actuator, N·m", "RMS twist about its moving mean, deg")
    legend(ax)
    save_figure(fig, given.out / "pareto.png")
    print(f"{time.perf_counter() - began:.0f} s in all; figure in {given.out}/")


if __name__ == "__main__":
    main()
