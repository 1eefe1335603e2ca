"""Quantities over time or over each other: what a study asks for by name."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from ..core.units import factor
from .style import (
    COLOURS,
    DENSE,
    GREY,
    Given,
    dashes,
    envelope,
    figure,
    label,
    legend,
    turning_points,
)

# What a unit measures, and from which size on a prefix suits it: (least peak, factor, unit shown).
_KINDS = {
    "m": ("displacement", ((1.0, 1.0, "m"), (1e-5, 1e3, "mm"), (1e-8, 1e6, "µm"), (0, 1e9, "nm"))),
    "rad": ("angle", ((0.1, 1.0, "rad"), (1e-5, 1e3, "mrad"), (0, 1e6, "µrad"))),
    "rad/s": ("speed", ((0, 1.0, "rad/s"),)),
    "s": ("time", ((0, 1.0, "s"),)),
    "N": ("force", ((1e7, 1e-6, "MN"), (1e4, 1e-3, "kN"), (0, 1.0, "N"))),
    "N*m": ("torque", ((1e7, 1e-6, "MN·m"), (1e4, 1e-3, "kN·m"), (0, 1.0, "N·m"))),
    "W": ("power", ((1e7, 1e-6, "MW"), (1e4, 1e-3, "kW"), (0, 1.0, "W"))),
    "A": ("current", ((1e4, 1e-3, "kA"), (0, 1.0, "A"))),
}


class Curve(NamedTuple):
    """`values` in SI, in the unit that is named; `name` for the legend."""

    name: str
    values: np.ndarray
    unit: str


def chart(
    x: Curve,
    curves: Sequence[Curve],
    title: str,
    units: Sequence[str] = (),
    ax: Given | None = None,
) -> np.ndarray:
    """Panels above each other, one for each unit, over the same `x`.

    `units` are those to draw in, where they fit. A curve that oscillates too densely for a line is
    drawn as its thin trace inside its envelope.
    """
    panels: dict[str, list[Curve]] = {}
    for curve in curves:
        panels.setdefault(curve.unit, []).append(curve)
    rows = len(panels)
    _, axes = figure(rows, 1, (9.0, 1.4 + 2.9 * rows), ax, sharex=True)
    scale, shown = _scale([x], units)
    along = scale * x.values
    over_time = bool(np.all(np.diff(along) > 0))
    order = slice(None) if over_time else np.argsort(along, kind="stable")
    for panel, (unit, members) in zip(axes[:, 0], panels.items()):
        size, words = _scale(members, units)
        for i, curve in enumerate(members):
            colour = COLOURS[i % len(COLOURS)]
            _draw(panel, along, size * curve.values, order, colour, curve.name, dashes(i))
        low, high = panel.get_ylim()
        if low < 0 < high:
            panel.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
        what = _KINDS.get(unit, ("", ()))[0]
        label(panel, "", ", ".join(w for w in (what, words) if w))
        # beside the panel: nowhere inside is sure to be free
        legend(panel, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes[0, 0].set_title(title, fontsize=11, loc="left")
    axes[-1, 0].set_xlabel(f"{x.name}, {shown}")
    axes[-1, 0].set_xlim(float(along.min()), float(along.max()) or None)
    return axes[:, 0]


def _scale(curves: Sequence[Curve], units: Sequence[str]) -> tuple[float, str]:
    """By what to multiply SI values, and the unit that they are in then."""
    unit = curves[0].unit
    for wanted in units:
        size = factor(unit, wanted)
        if size is not None:
            return size, wanted.replace("*", "·")
    peak = max(float(np.max(np.abs(c.values), initial=0.0)) for c in curves)
    for least, size, words in _KINDS.get(unit, ("", ()))[1]:
        if peak >= least:
            return size, words
    return 1.0, unit.replace("*", "·")


def _draw(
    ax: Axes, x: np.ndarray, values: np.ndarray, order, colour: str, name: str, dash: str = "-"
) -> None:
    turns = turning_points(values)
    if len(turns) < DENSE:
        ax.plot(x, values, dash, color=colour, linewidth=1.1, label=name)
        return
    from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

    # wide enough that the envelope has no ripple of its own, narrow against the figure
    count = len(values)
    window = max(5, int(4 * count / len(turns)), count // 80)
    # averaged over the same window it stays outside of the curve, and loses its stairs
    bounds = [uniform_filter1d(b, window) for b in envelope(values[order], window)]
    # a full line where the eye can follow it
    often = np.zeros(count)
    often[turns] = 1.0
    dense = uniform_filter1d(often, 2 * window) * count > 0.5 * DENSE
    for first, then in ((maximum_filter1d, minimum_filter1d), (minimum_filter1d, maximum_filter1d)):
        # no flicker between the two: gaps are closed, then islands taken out
        dense = then(first(dense, count // 20 + 1), count // 20 + 1)
    ax.fill_between(x[order], *bounds, where=dense[order], color=colour, alpha=0.22, linewidth=0)
    for edge in bounds:  # where it is narrow nothing else is seen
        shown = np.where(dense[order], edge, np.nan)
        ax.plot(x[order], shown, color=colour, linewidth=0.6)
    ax.plot(x, values, color=colour, linewidth=0.2, alpha=0.35)
    ax.plot(x, np.where(dense, np.nan, values), color=colour, linewidth=1.1)
    ax.plot([], [], dash, color=colour, linewidth=2, label=name)
