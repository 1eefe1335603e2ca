"""Design by gradient: a rotor's critical speeds moved away from the speed at which it runs.

The two-disc rotor of Friswell, Penny, Garvey & Lees (2010), example 5.9.1, runs at 2100 rpm, seven per cent
below its torsional critical speed. The diameters of its three shafts and the stiffness of its bearings are
changed, as little as possible, until no critical speed lies within 20 %. Each step takes the exact
derivatives of all critical speeds by all parameters in one reverse sweep.

    python experiments/critical_speed_design.py [--out results/critical_speed_design] [--steps 160]
"""

import argparse
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import matplotlib

matplotlib.use("Agg")
import numpy as np
import optax
from tqdm import tqdm

import jaxrotor as jr
from jaxrotor.core.files import written_whole
from jaxrotor.plot.style import COLOURS, GREY, figure, label, legend

RPM = 30 / np.pi
RUNNING = 2100 / RPM  # rad/s
MARGIN = 0.2
NAMES = ("shaft 1 diameter", "shaft 2 diameter", "shaft 3 diameter", "bearing stiffness")
START = np.array([0.05, 0.05, 0.05, 1e6])  # m, N/m
UNITS = ("mm", "mm", "mm", "kN/m")
SCALES = np.array([1e3, 1e3, 1e3, 1e-3])
COUNT = 6  # the lowest critical speeds, forward, backward and torsional
STEEL = jr.Material(2.11e11, 8.12e10, 7810.0)


def build(values=START) -> jr.Machine:
    """The book's rotor on isotropic bearings; torsion is held, for it is not what is designed here."""
    stiffness = jnp.zeros(6).at[:2].set(values[3])
    bearing = jr.LinearSupport(stiffness)

    def shaft(i):
        return jr.FiniteElementShaft(0.5, values[i], material=STEEL, elements=2)

    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft 1": shaft(0),
            "disc 1": jr.Rotor(32.58972765304033, 0.32956362089137037, 0.17808928257067666),
            "shaft 2": shaft(1),
            "disc 2": jr.Rotor(51.5252611115262, 0.8050822048675967, 0.42358058405433824),
            "shaft 3": shaft(2),
            "right": jr.Node(),
        },
        attachments={"bearing 1": (bearing, "left"), "bearing 2": (bearing, "right")},
        fixed={"left": ("z", "phi")},
    )


MACHINE = build()


def with_values(values) -> jr.Machine:
    stiffness = jnp.zeros(6).at[:2].set(values[3])
    shafts = {f"shaft {i + 1}.diameter": values[i] for i in range(3)}
    return MACHINE.set(shafts | {f"bearing {i}.stiffness": stiffness for i in (1, 2)})


@jax.jit
def loss(logs):
    """How deep critical speeds lie in the forbidden range, and how much the design has changed. Every
    critical speed counts, backward and torsional ones too: what is not excited now may be one day."""
    speeds = jr.critical_speeds(with_values(START * jnp.exp(logs)), count=COUNT)
    gap = jnp.abs(jnp.log(speeds / RUNNING))
    short = jax.nn.relu(jnp.log1p(MARGIN) * 1.05 - gap)
    return 100.0 * jnp.sum(short**2) + 0.05 * jnp.sum(logs**2), speeds


def optimise(steps: int = 160):
    """(step, values, critical speeds) of every step."""
    value_and_grad = jax.jit(jax.value_and_grad(loss, has_aux=True))
    solver = optax.adam(0.02)
    logs = jnp.zeros(4)
    state = solver.init(logs)
    path = []
    for _ in tqdm(range(steps + 1), "design", leave=False):
        (_, speeds), slope = value_and_grad(logs)
        path.append((np.asarray(START * np.exp(logs)), np.asarray(speeds)))
        change, state = solver.update(slope, state)
        logs = optax.apply_updates(logs, change)
    return path


def separation(speeds) -> float:
    """How far the nearest critical speed is, as a part of the running speed."""
    return float(np.min(np.abs(speeds / RUNNING - 1)))


def draw(path, out: Path) -> Path:
    fig, axes = figure(1, 2, (12.0, 5.0))
    left, right = axes[0]
    steps = np.arange(len(path))
    speeds = np.stack([s for _, s in path]) * RPM
    for k in range(speeds.shape[1]):
        left.plot(steps, speeds[:, k], color=COLOURS[0], linewidth=1.2)
    left.plot([], [], color=COLOURS[0], label="critical speeds")
    left.axhline(RUNNING * RPM, color="black", label="running speed")
    band = (RUNNING * RPM * (1 - MARGIN), RUNNING * RPM * (1 + MARGIN))
    left.axhspan(*band, color=GREY, alpha=0.2, label=f"{100 * MARGIN:g} % to either side")
    left.set_ylim(0, 1.6 * RUNNING * RPM)
    label(left, "step", "critical speed, rpm")
    legend(left, loc="lower right")
    values = np.stack([v for v, _ in path]) / START
    for k, (name, style) in enumerate(zip(NAMES, ("-", "--", "-.", ":"))):
        right.plot(steps, 100 * (values[:, k] - 1), linestyle=style, color=COLOURS[k], label=name)
    label(right, "step", "change, %")
    legend(right, loc="best")
    with written_whole(out / "critical_speed_design.png") as part:
        fig.savefig(part, dpi=150, format="png", bbox_inches="tight")
    return out / "critical_speed_design.png"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/critical_speed_design"))
    parser.add_argument("--steps", type=int, default=160)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    path = optimise(given.steps)
    for words, speeds in (("before", path[0][1]), ("after", path[-1][1])):
        listed = ", ".join(f"{w * RPM:.5g}" for w in speeds)
        print(
            f"{words}: critical speeds {listed} rpm; the nearest {100 * separation(speeds):.3g} % off"
        )
    for name, unit, scale, a, b in zip(NAMES, UNITS, SCALES, path[0][0], path[-1][0]):
        print(f"{name:>18}: {a * scale:.5g} -> {b * scale:.5g} {unit} ({100 * (b / a - 1):+.1f} %)")
    print(f"figure: {draw(path, given.out)}")
    print(f"{time.perf_counter() - began:.0f} s in all")


if __name__ == "__main__":
    main()
