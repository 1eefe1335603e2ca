"""One look for all figures."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..core.errors import InputError

# Where a picture is to be drawn: one axes, or as many as it has panels, in reading order.
Given = Axes | Sequence[Axes] | np.ndarray
# Okabe and Ito's colours: told apart with any colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
GREY = "#808080"
# Beyond so many turning points across the width a line is a smear.
DENSE = 250


def figure(
    rows: int = 1,
    columns: int = 1,
    size: tuple[float, float] = (9.0, 5.5),
    ax: Given | None = None,
    **kwargs: Any,
):
    """A figure and its axes, (rows, columns): a new one by `matplotlib.pyplot`, or those that are given. Then
    nothing but they is drawn on, and the figure stays as large as it is. Raises `InputError` for axes that
    are not so many, or of another projection."""
    if ax is None:
        fig, axes = plt.subplots(
            rows, columns, figsize=size, squeeze=False, layout="constrained", **kwargs
        )
    else:
        projection = (kwargs.get("subplot_kw") or {}).get("projection", "rectilinear")
        axes = _given(ax, rows, columns, projection)
        fig = axes[0, 0].figure
    for one in axes.ravel():
        if one.name == "rectilinear":
            one.grid(True, linewidth=0.4, alpha=0.5)
            one.spines[["top", "right"]].set_visible(False)
    return fig, axes


def new_figure(size: tuple[float, float]) -> Figure:
    """One without axes."""
    return plt.figure(figsize=size)


def _given(ax: Given, rows: int, columns: int, projection: str) -> np.ndarray:
    found = np.empty(np.size(np.asarray(ax, object)), object)
    found[:] = np.asarray(ax, object).ravel()
    count = rows * columns
    if not all(isinstance(one, Axes) for one in found):
        kinds = ", ".join(dict.fromkeys(type(one).__name__ for one in found)) or "nothing"
        raise InputError(
            f"ax must be axes of matplotlib, as plt.subplots({rows}, {columns}) makes them, but is {kinds}"
        )
    if found.size != count:
        raise InputError(
            f"ax must be {count} axes, one for each panel of this picture, but is {found.size}: make them "
            f"with plt.subplots({rows}, {columns})"
        )
    for one in found:
        if one.name != projection:
            how = f'subplot_kw={{"projection": "{projection}"}}'
            raise InputError(
                f'ax must be of the projection "{projection}", but is "{one.name}": make it with {how}'
            )
    return found.reshape(rows, columns)


def asked_panels(ax: Given | None, usual: int) -> int:
    """How many panels a picture draws that can leave the last ones out: the usual number on new axes, else as
    many as there are axes."""
    return usual if ax is None else np.size(np.asarray(ax, object))


def figure_of(drawn: Any) -> Figure:
    """The figure of the axes that a picture returned."""
    first = np.asarray(drawn, object).ravel()[0]
    return first if isinstance(first, Figure) else first.figure


def legend_below(axes: np.ndarray, ax: Given | None, ncols: int, handles, names) -> Any:
    """One legend for all panels: below a new figure, which has room there; on given axes inside the first."""
    look: dict[str, Any] = dict(frameon=False, fontsize=9, ncols=ncols)
    if ax is not None:
        return axes.ravel()[0].legend(handles, names, **look | dict(ncols=1, fontsize=8))
    return figure_of(axes).legend(handles, names, loc="outside lower center", **look)


def heading_above(axes: np.ndarray, ax: Given | None, words: str, fontsize: float) -> None:
    """Words for all panels: above a new figure; on given axes above the first one's own title."""
    if ax is None:
        figure_of(axes).suptitle(words, fontsize=fontsize)
    else:
        first = axes.ravel()[0]
        own = first.get_title(loc="left")
        first.set_title(f"{words}\n{own}" if own else words, fontsize=10, loc="left")


@contextmanager
def closed_on_failure() -> Iterator[None]:
    """A picture that cannot be finished leaves no figure behind, which nobody could close."""
    before = set(plt.get_fignums())
    try:
        yield
    except BaseException:
        for number in set(plt.get_fignums()) - before:
            plt.close(number)
        raise


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
    """An oscillation too dense for a line: its faint trace inside its envelope, through which the grid and
    what else is drawn there can be seen. What a line can show is drawn as one."""
    if len(turning_points(values)) < DENSE:
        ax.plot(x, values, color=colour, linewidth=1.1, label=name)
        return
    low, high = envelope(values, window)
    ax.fill_between(x, low, high, color=colour, alpha=0.22, linewidth=0)
    for edge in (low, high):
        ax.plot(x, edge, color=colour, linewidth=0.7)
    ax.plot(x, values, color=colour, linewidth=0.2, alpha=0.18)
    ax.plot([], [], color=colour, linewidth=2, label=name)


def turning_points(values: np.ndarray) -> np.ndarray:
    """The samples at which the values turn, ripples below a hundredth of their range left out."""
    step = 0.01 * float(np.ptp(values))
    if step == 0.0:
        return np.zeros(0, int)
    steps = np.diff(np.round(values / step))
    moved = np.flatnonzero(steps)
    return moved[1:][np.diff(np.sign(steps[moved])) != 0]


def dashes(k: int) -> str:
    """Of curve k: what tells the eighth from the first, which has its colour."""
    return ("-", "--", ":", "-.")[k // len(COLOURS) % 4]


def legend(ax: Axes, **kwargs) -> None:
    ax.legend(frameon=False, fontsize=9, **kwargs)


def close(figures: Sequence[Figure]) -> None:
    for fig in figures:
        plt.close(fig)
