"""What a phase is: the vector of a tracking filter, drawn on the shaft and over time.

python experiments/phase_convention.py [--out docs/images/phase_convention.png]
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib.patches import Arc, Circle

from jaxrotor.commands.output import save_figure
from jaxrotor.plot.style import COLOURS, GREY, figure, label

PROBE, HEAVY, LAG = np.radians(45.0), np.radians(100.0), np.radians(70.0)


def drawn() -> np.ndarray:
    """Left: the shaft as the keyphasor fires. Right: what the probe sees, and the lag that is shown."""
    _, axes = figure(1, 2, (13.0, 5.0))
    left, right = axes[0]
    left.add_patch(Circle((0, 0), 1, fill=False, color="black"))
    for angle, words, colour, reach in (
        (PROBE, "probe", COLOURS[0], 1.45),
        (HEAVY, "heavy spot", COLOURS[1], 1.0),
        (0.0, "keyphasor,\nmark under it", COLOURS[2], 1.45),
        (PROBE - LAG, "high spot", COLOURS[3], 1.0),
    ):
        tip = reach * np.array([np.cos(angle), np.sin(angle)])
        inner = 0.0 if reach <= 1.0 else 1.06
        left.plot(
            [inner * np.cos(angle), tip[0]],
            [inner * np.sin(angle), tip[1]],
            color=colour,
            linewidth=3,
        )
        left.annotate(words, 1.24 * tip, color=colour, ha="center", va="center", fontsize=10)
    degrees = np.degrees
    left.add_patch(Arc((0, 0), 1.2, 1.2, theta1=degrees(PROBE - LAG), theta2=degrees(PROBE)))
    left.annotate(
        "lag", (0.72 * np.cos(PROBE - LAG / 2), 0.72 * np.sin(PROBE - LAG / 2)), ha="center"
    )
    left.annotate(
        "",
        (-1.15, -0.55),
        (-0.75, -1.05),
        arrowprops={"arrowstyle": "<-", "connectionstyle": "arc3,rad=-0.2"},
    )
    left.annotate("rotation, from x to y", (-0.98, -1.2), ha="center", fontsize=9)
    left.set_aspect("equal")
    left.set_xlim(-1.9, 1.9)
    left.set_ylim(-1.6, 1.6)
    label(left, "x", "y", "the shaft as the keyphasor fires (theta = 0)")
    left.set_xticks([])
    left.set_yticks([])
    theta = np.linspace(-0.3, 4 * np.pi, 800)
    right.plot(theta / (2 * np.pi), np.cos(theta - LAG), color=COLOURS[0], label="probe")
    for turn in (0, 1, 2):
        right.axvline(
            turn, color=COLOURS[2], linewidth=1.5, label=None if turn else "keyphasor fires"
        )
    right.annotate(
        "", (LAG / (2 * np.pi), 1.12), (0, 1.12), arrowprops={"arrowstyle": "<->", "color": "black"}
    )
    right.annotate("lag", (LAG / (4 * np.pi), 1.18), ha="center")
    right.axhline(0, color=GREY, linewidth=0.6)
    right.set_ylim(-1.3, 1.45)
    label(
        right, "turns, theta/2π", "displacement/|V|", "x = |V| cos(theta - lag), V = |V| e^(i lag)"
    )
    right.legend(frameon=False, fontsize=9, loc="lower right")
    return axes


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("docs/images/phase_convention.png"))
    save_figure(drawn(), parser.parse_args().out)
