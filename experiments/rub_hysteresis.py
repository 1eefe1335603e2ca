"""A rotor that rubs in its ring jumps at one speed on the way up and at another on the way down.

Between the two the same speed has three steady motions. Run up and down slowly a machine shows two of them;
the branch of periodic motions, followed by its arc length through both folds, has all three with their
stability, and is found in a fraction of the time. Printed: the speeds of the folds beside those at which
the runs jump, and the time that either took.

    python experiments/rub_hysteresis.py [--out DIR] [--seconds 20]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np

import jaxrotor as jr
from jaxrotor.commands.output import save_figure

LOW, HIGH = 240.0, 760.0  # rad/s
RATE, GAP = 2000.0, 1.5e-3
_RPM = 30 / np.pi


def machine(motion: jr.ConstantSpeed | jr.LinearRamp) -> jr.Machine:
    """A disc of 2 kg on springs, natural frequency 50 Hz, in a ring of 1.5 mm clearance with some
    friction."""
    spring = jr.LinearSupport([2e5] * 2 + [0.0] * 4, [20.0] * 2 + [0.0] * 4)
    ring = jr.Rub(gap=GAP, stiffness=1e6, radius=0.05, friction=0.01)
    return jr.Machine.in_line(
        {"disc": jr.Rotor(2.0, 0.01, 0.006, unbalance=jr.Unbalance(1e-4))},
        attachments={"spring": (spring, "disc"), "ring": (ring, "disc")},
        fixed={"disc": ("z", "psi", "theta")},
        prescribed={"disc": {"phi": motion}},
    )


def swept(first: float, last: float, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Speed (rad/s) and distance from the centre (m) of a slow run."""
    run = jr.simulate(machine(jr.LinearRamp(last, seconds, first)), seconds, RATE, "steady")
    return np.asarray(run["disc"].speed), np.hypot(run["disc"].x, run["disc"].y)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/rub_hysteresis"))
    parser.add_argument("--seconds", type=float, default=20.0, help="of each run")
    given = parser.parse_args()

    began = time.perf_counter()
    branch = jr.periodic.continuation(machine(jr.ConstantSpeed(LOW)), (LOW, HIGH), harmonics=3)
    first = time.perf_counter() - began
    began = time.perf_counter()
    branch = jr.periodic.continuation(machine(jr.ConstantSpeed(LOW)), (LOW, HIGH), harmonics=3)
    again = time.perf_counter() - began
    began = time.perf_counter()
    up, down = swept(LOW, HIGH, given.seconds), swept(HIGH, LOW, given.seconds)
    runs = time.perf_counter() - began

    print(f"branch: {len(branch)} motions in {again:.2f} s ({first:.1f} s with compiling)")
    print(f"runs up and down: {runs:.1f} s")
    for point in branch.special:
        print(f"{point.kind:16} {point.speed * _RPM:7.1f} rpm")
    for name, (speed, radius) in (("up", up), ("down", down)):
        # where the rotor leaves the ring, or meets it on the way down
        touching = np.flatnonzero(radius > GAP)
        at = touching[-1] if name == "up" else touching[0]
        print(f"jumps on the way {name:5} {speed[at] * _RPM:7.1f} rpm")

    panel = branch.plot(
        place="disc.x", title="A rotor in its ring: slow runs, and the branch of steady motions"
    )
    for (speed, radius), colour, words in (
        (up, "0.45", "slow run up"),
        (down, "0.75", "slow run down"),
    ):
        panel.plot(speed * _RPM, 1e3 * radius, color=colour, linewidth=0.8, zorder=1, label=words)
    panel.axhline(1e3 * GAP, color="black", linewidth=0.6, linestyle=":", label="clearance")
    panel.set_ylabel("distance from the centre, mm")
    panel.legend(fontsize=8, loc="upper left")
    given.out.mkdir(parents=True, exist_ok=True)
    save_figure(panel.figure, given.out / "rub_hysteresis.png")


if __name__ == "__main__":
    main()
