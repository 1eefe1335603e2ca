"""Named quantities of a run, `"main.x"` or `"shaft.torque"`: over time or each other, and their spectra."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.doors import through
from ..core.errors import InputError
from ..diagnostics.spectrum import power_spectral_density
from ..simulation.response import Response
from . import select
from .curves import Curve, chart
from .labels import number
from .style import COLOURS, Given, figure, label, legend

# Below this part of the highest line nothing is told from rounding.
_FLOOR = 1e-14
# What is looked at in a spectrum, where nothing is said: the last part of the run.
_SETTLED = 2 / 3


def over_time(
    response: Response,
    names: str | Sequence[str] | None = None,
    over: str = "t",
    units: Sequence[str] = (),
    title: str = "",
    ax: Given | None = None,
) -> np.ndarray:
    """Quantities over time, a panel for each unit.

    `names`: `"main.x"`, `"main.speed"`, `"shaft.torque"` and what else a study's figures may show; by
    default x and y of the rotors that can sway, else the rotors' speeds. `over`: `"t"`, or another quantity
    such as `"main.speed"`. `units`: those to draw in, where they fit, such as `("mm", "rpm")`.
    """
    wanted = _wanted(response, names)
    if over != "t":
        _wanted(response, over)
    return chart(_curve(response, over), [_curve(response, n) for n in wanted], title, units, ax)


def spectrum(
    response: Response,
    names: str | Sequence[str] | None = None,
    start: float | None = None,
    highest: float | None = None,
    segment: int | None = None,
    title: str = "Power spectral density",
    ax: Given | None = None,
) -> np.ndarray:
    """One-sided power spectral density of quantities (unit²/Hz, by Welch's method), a panel for each unit.

    `names`: as in `over_time`. `start`: s, from when on the run is looked at; by default its last third.
    `highest`: Hz, where the axis ends; by default half the sampling rate. `segment`: samples in each of the
    overlapping pieces that are averaged; by default one piece, the finest lines, as a run has no noise.
    Raises `InputError` where `start` lies beyond the end of the run.
    """
    t = np.asarray(response.t)
    begin = t[0] + _SETTLED * (t[-1] - t[0]) if start is None else start
    if not begin < t[-1]:
        raise InputError(
            f"`start`: must lie within the run, which ends at {t[-1]:g} s, but is {begin:g} s: begin earlier"
        )
    inside, rate = t >= begin - 1e-9, 1.0 / (t[1] - t[0])
    panels: dict[str, list[Curve]] = {}
    for curve in (_curve(response, name) for name in _wanted(response, names)):
        panels.setdefault(curve.unit, []).append(curve)
    _, axes = figure(len(panels), 1, (9.0, 1.4 + 2.9 * len(panels)), ax, sharex=True)
    for panel, (unit, curves) in zip(axes[:, 0], panels.items()):
        top = 0.0
        for k, curve in enumerate(curves):
            f, density = power_spectral_density(
                curve.values[inside], rate, segment or int(inside.sum())
            )
            top = max(top, float(density[1:].max()))
            # zero has no logarithm: it is left out
            shown = np.where(density[1:] > 0, density[1:], np.nan)
            colour = COLOURS[k % len(COLOURS)]
            panel.semilogy(f[1:], shown, color=colour, linewidth=0.9, label=curve.name)
        low, high = panel.get_ylim()
        if top > 0:
            panel.set_ylim(max(low, _FLOOR * top), high)
        words = unit.replace("*", "·")
        label(panel, "", f"{words}²/Hz" if words.isalpha() else f"({words})²/Hz")
        legend(panel, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        panel.set_xlim(0.0, rate / 2 if highest is None else highest)
    axes[0, 0].set_title(f"{title}, from {number(float(begin))} s on", fontsize=11, loc="left")
    axes[-1, 0].set_xlabel("frequency, Hz")
    return axes[:, 0]


def _wanted(response: Response, names: Any) -> list[str]:
    """All of them known, each once."""
    if names is None:
        moving = select.swaying(response.machine)
        if moving:
            return [f"{name}.{c}" for name in moving for c in "xy"]
        return [f"{name}.speed" for name in select.rotors(response.machine)[:3]]
    return through("study.table", "wanted_quantities")(response, names)


def _curve(response: Response, path: str) -> Curve:
    values, unit = through("study.quantities", "read_quantity")(response, path)
    part, _, quantity = path.rpartition(".")
    return Curve(f"{part} {quantity.replace('_', ' ')}" if part else "time", values, unit)
