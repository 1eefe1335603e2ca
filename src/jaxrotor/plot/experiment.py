"""The picture of an experiment that is being designed: what is gained by each further sensor or run."""

import numpy as np
from matplotlib.ticker import PercentFormatter

from ..identification.experiment import ExperimentDesign
from .style import COLOURS, GREY, Given, figure, label, legend_below

_MARKS = "os^Dv<>pXP"


def expected_stds(found: ExperimentDesign, ax: Given | None = None) -> np.ndarray:
    """How the standard deviation of every unknown falls with each further candidate, in the order in which
    they are taken, and which part of the information each candidate brings by itself. A line begins where
    its unknown is first seen; the dashed one parts what is chosen from the rest."""
    count, paths = len(found.names), found.paths
    height = 2.2 + 0.34 * max(count, 6) + 0.2 * len(paths)
    _, axes = figure(1, 2, (12.5, height), ax)
    left, right = axes[0]
    experiment = found.experiment
    steps = np.arange(count + 1)
    relative = found.stds / experiment.sizes
    handles, names = [], []
    for i, (path, unit) in enumerate(zip(paths, experiment.units)):
        look = dict(color=COLOURS[i % len(COLOURS)], marker=_MARKS[i % len(_MARKS)], markersize=5)
        values = np.where(np.isfinite(relative[:, i]), relative[:, i], np.nan)
        (line,) = left.plot(steps, values, **look)
        handles.append(line)
        names.append(_named(path, unit, found.std[path]))
    left.set_yscale("log")
    first = 0 if np.isfinite(relative[0]).any() else 1
    left.set_xlim(first - 0.4, count + 0.4)
    ordered = [found.names[c] for c in found.order]
    ticks = ["priors\nalone", *(f"{k}: +{name}" for k, name in enumerate(ordered, 1))]
    left.set_xticks(steps[first:], ticks[first:], rotation=35, ha="right", fontsize=9)
    if found.count < count:
        left.axvline(found.count + 0.5, color=GREY, linestyle="--", linewidth=1.0)
    heading = "One after the other" + "; chosen: before the dashed line" * (found.count < count)
    label(left, "", "expected std, part of the guess; of angles, rad", heading)
    alone = "Each candidate alone" + "; chosen: bold" * (found.count < count)
    size = 0.8 / len(paths)
    at = np.arange(count)[::-1]
    shares = found.shares[list(found.order)]
    for i in range(len(paths)):
        right.barh(
            at + 0.4 - (i + 0.5) * size, shares[:, i], 0.9 * size, color=COLOURS[i % len(COLOURS)]
        )
    right.set_yticks(at, ordered, fontsize=9)
    right.xaxis.set_major_formatter(PercentFormatter(1.0))
    right.set_xlim(left=0.0)
    label(right, "part of the information on an unknown by itself", "", alone)
    for tick, c in zip(right.get_yticklabels(), found.order):
        tick.set_fontweight("bold" if c in found.order[: found.count] else "normal")
    legend_below(axes, ax, min(3, len(paths)), handles, names)
    return axes[0]


def _named(path: str, unit: str, std: float) -> str:
    """With what is expected of it."""
    words = f"{std:.3g} {unit}".rstrip() if np.isfinite(std) else "unseen"
    return f"{path} (chosen: {words})"
