"""What an earthquake does to a machine on a stiff and on an isolated foundation.

A rotor of 300 kg between two bearings turns at 3000 rpm on a block of concrete. The ground shakes across the
shaft for ten seconds, 0.3 g at the most: noise coloured as by soil (Kanai 1957, Tajimi 1960), a made record,
integrated twice and freed of drift. Once the block stands on stiff ground, once on isolators of 3 Hz. Shown
are the ground, how far the shaft bends between its journals, and what the isolators cost: how far the block
sways.

    python experiments/earthquake.py [--out results/earthquake] [--record north.at2]

Sources: Tajimi, Proc. 2nd World Conf. Earthquake Eng. (1960) 781; Chopra, Dynamics of Structures, ch. 6.
"""

import argparse
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import matplotlib

matplotlib.use("Agg")
import numpy as np
from scipy.signal import lsim

import jaxrotor as jr
from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, figure, label, legend

RPM = np.pi / 30
GRAVITY = 9.80665
JOURNALS = ("left", "right")
# Mass and springs of the block: stiff ground, or isolators of 3 Hz.
MASS, FEET = 3000.0, 4
TOTAL = MASS + 320.0


def made_record(peak: float = 0.3 * GRAVITY, seed: int = 3) -> jr.profiles.AccelerationRecord:
    """Soil of 2.5 Hz with 60 % damping over noise, that grows for 2 s and dies away after 6 s."""
    t = np.arange(0.0, 10.0, 0.005)
    noise = np.random.default_rng(seed).normal(size=t.size)
    w, z = 2 * np.pi * 2.5, 0.6
    soil = lsim(([2 * z * w, w**2, 0.0], [1.0, 2 * z * w, w**2]), noise, t)[1]
    shape = np.minimum(t / 2.0, 1.0) ** 2 * np.exp(-np.maximum(t - 6.0, 0.0))
    values = soil * shape
    return jr.profiles.AccelerationRecord(t, values * peak / np.abs(values).max()).at_rest()


def build(record: jr.profiles.AccelerationRecord, frequency: float, ratio: float) -> jr.Machine:
    """`frequency`, Hz, and damping ratio of the block with its machine on its springs, across."""
    w = 2 * np.pi * frequency
    foot, foot_damping = TOTAL * w**2 / FEET, TOTAL * 2 * ratio * w / FEET
    block = jr.elements.FoundationBlock(
        mass=MASS,
        inertia=[900.0, 1000.0, 500.0],
        places=[[0.0, 0.6, -0.6], [0.0, 0.6, 0.6]],
        stiffness=[1.5e8, 1.5e8, 5e7, 0.0, 0.0, 0.0],
        damping=[2e5, 2e5, 5e4, 0.0, 0.0, 0.0],
        springs=[[x, -0.3, z] for x in (-0.7, 0.7) for z in (-0.9, 0.9)],
        spring_stiffness=[foot, foot, foot, 0.0, 0.0, 0.0],
        spring_damping=[foot_damping] * 3 + [0.0] * 3,
        base=jr.elements.BaseMotion(x=record),
    )
    shaft = jr.Shaft(0.6, 0.1, rayleigh=(0.0, 2e-5))
    journal = jr.Rotor(10.0, 0.02, 0.03)
    disc = jr.Rotor(300.0, 12.0, 7.0)  # balanced: what is seen is the ground's
    line = {"left": journal, "shaft 1": shaft, "disc": disc, "shaft 2": shaft, "right": journal}
    return jr.Machine.in_line(line, {"foundation": (block, JOURNALS)}, gravity=(0.0, -GRAVITY, 0.0))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("results/earthquake"))
    parser.add_argument("--record", type=Path, help="a file that read_accelerations reads")
    given = parser.parse_args()
    record = made_record() if given.record is None else jr.interop.read_accelerations(given.record)
    end = float(record.times[-1])
    axes = figure(3, 1, (9.0, 7.5))[1]
    shaking, bending, swaying = np.ravel(axes)
    shaking.plot(record.times, np.asarray(record.accelerations) / GRAVITY, color="grey", lw=0.8)
    for colour, words, frequency, ratio in (
        (COLOURS[0], "stiff ground, 25 Hz", 25.0, 0.05),
        (COLOURS[1], "isolators, 3 Hz", 3.0, 0.15),
    ):
        machine = build(record, frequency, ratio)
        run = jr.simulate(machine, end, 500.0, speed=3000 * RPM)
        bent = np.asarray(run["disc"].x - 0.5 * (run["left"].x + run["right"].x))
        sway = np.asarray(run["foundation"].amplitudes)[:, 0]
        bending.plot(run.t, 1e6 * bent, color=colour, lw=0.8, label=words)
        swaying.plot(run.t, 1e3 * sway, color=colour, label=words)
        print(
            f"{words}: the shaft bends by {1e6 * np.abs(bent).max():.0f} um, the block sways by "
            f"{1e3 * np.abs(sway).max():.1f} mm"
        )
    label(shaking, "time, s", "ground, g")
    label(bending, "time, s", "bend of the shaft, µm")
    label(swaying, "time, s", "sway of the block, mm")
    legend(bending)
    legend(swaying)
    given.out.mkdir(parents=True, exist_ok=True)
    save_figure(axes, given.out / "earthquake.png")
    print(given.out / "earthquake.png")


if __name__ == "__main__":
    main()
