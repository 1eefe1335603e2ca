"""Pictures of an identification: how the channels are met, what is left, what is told apart."""

import numpy as np
from matplotlib.figure import Figure

from ..inverse.identification import Identification
from .style import COLOURS, GREY, figure, label, legend


def channel_fits(found: Identification) -> Figure:
    """Measured over simulated, and what is left with twice the standard deviation of the noise; a row for
    each channel of each run."""
    fits = found.channels
    several = len({f.run for f in fits}) > 1
    fig, axes = figure(len(fits), 2, (13.0, 2.6 * len(fits) + 0.6), sharex="row")
    for (left, right), fit in zip(axes, fits):
        name = f"{fit.channel} of {fit.run}" if several else fit.channel
        left.plot(fit.t, fit.measured, color=GREY, linewidth=1.6, label="measured")
        left.plot(fit.t, fit.simulated, color=COLOURS[0], linewidth=0.7, label="identified")
        right.plot(fit.t, fit.residual, color=COLOURS[1], linewidth=0.5)
        for side in (-2, 2):
            right.axhline(side * fit.std, color="black", linewidth=0.9, linestyle="--")
        unit = f", {fit.unit}" if fit.unit else ""
        label(left, "time, s", f"{name}{unit}")
        chance = "" if fit.white is None else f"; white with probability {fit.white:.2g}"
        label(
            right,
            "time, s",
            f"left over{unit}",
            f"{name}: 2 std of its noise dashed{chance}",
        )
    axes[0, 0].legend(frameon=False, fontsize=9, loc="upper left", ncols=2)
    return fig


def correlations(found: Identification) -> Figure:
    """How far the parameters are told apart: 1 or -1, and only a combination of two is known."""
    n = len(found.paths)
    fig, axes = figure(1, 1, (2.5 + 0.9 * n, 2.0 + 0.7 * n))
    ax = axes[0, 0]
    image = ax.imshow(found.correlation, cmap="RdBu_r", vmin=-1, vmax=1)
    ax.set_xticks(range(n), found.paths, rotation=30, ha="right")
    ax.set_yticks(range(n), found.paths)
    ax.grid(False)
    for i in range(n):
        for j in range(n):
            r = found.correlation[i, j]
            words = f"{r:.2f}" if np.isfinite(r) else "unseen"
            ax.text(j, i, words, ha="center", va="center", fontsize=8,
                    color="white" if abs(r) > 0.6 else "black")  # fmt: skip
    fig.colorbar(image, ax=ax, label="correlation")
    return fig


def costs(found: Identification) -> Figure:
    """Half the sum of squared residuals, in standard deviations, at each iteration of each stage."""
    fig, axes = figure(1, 1, (7.0, 4.0))
    ax, first = axes[0, 0], 1
    for k, history in enumerate(found.histories):
        at = np.arange(first, first + len(history))
        ax.semilogy(at, history, "o-", color=COLOURS[k % len(COLOURS)], label=f"stage {k + 1}")
        first += len(history)
    label(ax, "iteration", "cost")
    legend(ax)
    return fig
