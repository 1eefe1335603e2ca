"""A magnetic bearing's controller, designed by the gradient of its peak sensitivity; run-up and drop.

The rotor of configs/magnetic_bearings.toml with first guesses of its PID gains: they bear the weight and damp
the first critical speed, but a bending mode at 900 Hz all but loses its stability, for the sensors stand
beside the magnets and the amplifiers lag. The largest |1/(1 + L)| over all frequencies and both axes, at full
speed, is lowered by its exact gradient until two of its peaks are equally high.

    python experiments/magnetic_bearing_design.py [--out DIR] [--evaluations 24]
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
from scipy.optimize import minimize

import jaxrotor as jr
from jaxrotor.core.files import written_whole
from jaxrotor.plot.style import COLOURS, figure, label

ROOT = Path(__file__).parents[1]
SPEED = 6000 * np.pi / 30
# A/m, A·s/m, Hz: of both bearings
GAINS = ("proportional", "derivative", "cutoff")
GUESS = np.array([11e3, 27.0, 2.3e3])
BOUNDS = ((8e3, 30e3), (5.0, 80.0), (800.0, 8e3))


def with_gains(machine: jr.Machine, gains) -> jr.Machine:
    paths = [f"{side} magnets.controller" for side in ("left", "right")]
    return machine.set({f"{p}.{name}": gains[k] for p in paths for k, name in enumerate(GAINS)})


def designed(machine: jr.Machine, evaluations: int) -> tuple[np.ndarray, list[float]]:
    """The gains, and the peak sensitivity of every evaluation."""

    def level(x):
        changed = with_gains(machine, jnp.exp(x))
        found = jr.standards.peak_sensitivity(
            changed, "left magnets", SPEED, at="undeformed", points=201
        )
        return (jnp.log(found.value),) * 2

    both = jr.jit(jax.jacfwd(level, has_aux=True))
    history: list[float] = []
    best = [np.inf, GUESS]

    def value(x):
        slope, found = both(jnp.asarray(x))
        history.append(float(np.exp(found)))
        if history[-1] < best[0]:
            best[:] = history[-1], np.exp(x)
        print(
            f"  {len(history):2}: peak {history[-1]:.4f} with {np.array2string(np.exp(x), precision=5)}"
        )
        return float(found), np.asarray(slope)

    bounds = [(np.log(a), np.log(b)) for a, b in BOUNDS]
    options = dict(maxfun=evaluations, maxls=8)
    minimize(value, np.log(GUESS), jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return np.asarray(best[1]), history


def drawn(before, after, run: jr.Response, out: Path) -> Path:
    fig, axes = figure(2, 2, (12.5, 9.5))
    jr.plot.sensitivity_curves(after, ax=axes[0, 0])
    hertz = np.asarray(before.frequencies) / (2 * np.pi)
    axes[0, 0].plot(
        hertz, np.asarray(before.decibels)[:, 0], color=COLOURS[3], linewidth=1.0, label="as guessed"
    )  # fmt: skip
    axes[0, 0].legend(frameon=False, fontsize=8, loc="lower right")
    axes[0, 0].set_title("Sensitivity of the loops at 6000 rpm", fontsize=10, loc="left")
    jr.plot.nyquist(after, ax=axes[0, 1])
    axes[0, 1].set_title("The open loops near -1", fontsize=10, loc="left")
    t = np.asarray(run.t)
    for name, colour in (("disc", COLOURS[5]), ("left", COLOURS[0])):
        axes[1, 0].plot(t, 1e6 * np.asarray(run[name].y), color=colour, linewidth=0.9, label=name)
    axes[1, 0].legend(frameon=False, fontsize=9)
    label(axes[1, 0], "t, s", "height y, µm", "Run-up, and drop at 0.7 s")
    after_drop, orbit = t > 0.69, run["left"]
    x, y = (1e6 * np.asarray(c)[after_drop] for c in (orbit.x, orbit.y))
    turn = np.linspace(0, 2 * np.pi, 181)
    axes[1, 1].plot(200 * np.cos(turn), 200 * np.sin(turn), color="black", linewidth=1.0)
    axes[1, 1].plot(x, y, color=COLOURS[0], linewidth=0.7)
    axes[1, 1].set_aspect("equal")
    label(axes[1, 1], "x, µm", "y, µm", "The left journal in its ring from 0.69 s on")
    path = out / "magnetic_bearing_design.png"
    with written_whole(path) as part:
        fig.savefig(part, dpi=110, format="png")
    return path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/magnetic_bearing_design"))
    parser.add_argument("--evaluations", type=int, default=24)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    machine = jr.load(ROOT / "configs" / "magnetic_bearings.toml", run=False).machine
    begin = time.perf_counter()
    gains, history = designed(machine, given.evaluations)
    print(
        f"peak sensitivity {history[0]:.3f} -> {min(history):.3f} in {time.perf_counter() - begin:.0f} s"
    )
    for name, guess, found in zip(GAINS, GUESS, gains):
        print(f"  {name:13} {guess:8.5g} -> {found:8.5g}")
    frequencies = 2 * np.pi * np.geomspace(2.0, 3000.0, 1500)
    guessed, found = (with_gains(machine, x) for x in (GUESS, gains))
    loops = [
        jr.linear.control_loops(m, frequencies, SPEED, "left magnets", at="undeformed")
        for m in (guessed, found)
    ]
    print(jr.standards.loop_sensitivity(found, "left magnets", SPEED))
    run = jr.simulate(found, 0.95, 4000.0, initial="running")
    print(f"written: {drawn(*loops, run, given.out)}")


if __name__ == "__main__":
    main()
