"""One look for all figures."""

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Okabe and Ito's colours: told apart with any colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
GREY = "#808080"


def figure(rows: int = 1, columns: int = 1, size: tuple[float, float] = (9.0, 5.5), **kwargs):
    """A figure and its axes, (rows, columns)."""
    fig, axes = plt.subplots(
        rows, columns, figsize=size, squeeze=False, layout="constrained", **kwargs
    )
    for ax in axes.ravel():
        ax.grid(True, linewidth=0.4, alpha=0.5)
        ax.spines[["top", "right"]].set_visible(False)
    return fig, axes


def label(ax: Axes, x: str, y: str, title: str = "") -> None:
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    if title:
        ax.set_title(title, fontsize=10, loc="left")


def envelope(values: np.ndarray, window: int) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest value in a window of so many samples around each one."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    return minimum_filter1d(values, window), maximum_filter1d(values, window)


def band(
    ax: Axes, x: np.ndarray, values: np.ndarray, colour: str, name: str, window: int = 25
) -> None:
    """An oscillation too dense for a line: its thin trace inside its envelope."""
    low, high = envelope(values, window)
    ax.fill_between(x, low, high, color=colour, alpha=0.3, linewidth=0)
    ax.plot(x, values, color=colour, linewidth=0.25, alpha=0.7)
    ax.plot([], [], color=colour, linewidth=2, label=name)


def legend(ax: Axes, **kwargs) -> None:
    ax.legend(frameon=False, fontsize=9, **kwargs)


def close(figures: Sequence[Figure]) -> None:
    for fig in figures:
        plt.close(fig)
