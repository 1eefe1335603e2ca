"""Control loops of magnetic bearings: sensitivity with its zones, the open loop by Nyquist and by Bode."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ..linear.loops import ControlLoops
from .linear import HERTZ
from .style import COLOURS, GREY, Given, figure, label, legend_below

# Ends of the zones of ISO 14839-3, of |1/(1 + L)|.
_ZONES = (3.0, 4.0, 5.0)
_TINTS = ("#2E7D32", "#E69F00", "#D55E00", "#C0392B")


def _looks(loops: ControlLoops) -> Iterator[tuple[str, dict]]:
    """A colour for each bearing; the second axis broken, for it often lies on the first."""
    for k, axis in enumerate(loops.axes):
        colour = COLOURS[k // 2 % len(COLOURS)]
        yield axis, dict(color=colour, linestyle=("-", (0, (4, 3)))[k % 2], linewidth=1.6)


def _grid(panel: Axes, loops: ControlLoops) -> np.ndarray:
    hertz = HERTZ * np.asarray(loops.frequencies)
    panel.set_xscale("log")
    panel.set_xlim(hertz.min(), hertz.max())
    return hertz


def sensitivity_curves(loops: ControlLoops, ax: Given | None = None) -> Axes:
    """The sensitivity of each axis over frequency, dB, with its peak, the zones of ISO 14839-3, and of
    several axes the largest singular value of all together."""
    _, axes = figure(1, 1, (9.0, 5.0), ax)
    panel = axes[0, 0]
    hertz = _grid(panel, loops)
    decibels = np.asarray(loops.decibels)
    largest = 20 * np.log10(np.asarray(loops.largest))
    top = max(20.0, 1.08 * largest.max())
    low = max(-60.0, 5 * np.floor(decibels.min() / 5))
    edges = [low, *(20 * np.log10(end) for end in _ZONES), top]
    for k, name in enumerate("ABCD"):
        panel.axhspan(edges[k], edges[k + 1], color=_TINTS[k], alpha=0.09, linewidth=0, zorder=0)
        middle = max(edges[k], 0.0) / 2 + edges[k + 1] / 2
        panel.text(
            0.992, middle, name, transform=panel.get_yaxis_transform(), ha="right", va="center",
            fontsize=9, color=_TINTS[k], fontweight="bold",
        )  # fmt: skip
    for k, (axis, look) in enumerate(_looks(loops)):
        peak = int(np.argmax(decibels[:, k]))
        words = f"{axis}, {decibels[peak, k]:.1f} dB at {hertz[peak]:.4g} Hz"
        panel.plot(hertz, decibels[:, k], label=words, **look)
        panel.plot(hertz[peak], decibels[peak, k], "o", color=look["color"], markersize=4)
    if len(loops.axes) > 1:
        panel.plot(
            hertz, largest, color=GREY, linestyle=":", linewidth=1.6, zorder=1,
            label=f"all together, at most {largest.max():.1f} dB",
        )  # fmt: skip
    panel.axhline(0.0, color="black", linewidth=0.8)
    panel.set_ylim(low, top)
    label(panel, "frequency, Hz", "sensitivity |1/(1 + L)|, dB")
    legend_below(axes, ax, 2, *panel.get_legend_handles_labels())
    return panel


def nyquist(loops: ControlLoops, ax: Given | None = None) -> Axes:
    """The open loop of each axis, all others closed, in the complex plane near -1, the limit of stability.
    Within the circles the sensitivity is beyond zones A, B and C."""
    _, axes = figure(1, 1, (6.4, 6.6), ax)
    panel = axes[0, 0]
    angle = np.linspace(0, 2 * np.pi, 181)
    for end, name, colour in zip(_ZONES, "ABC", _TINTS):
        panel.plot(
            -1 + np.cos(angle) / end, np.sin(angle) / end, color=colour, linewidth=1.0,
            label=f"end of zone {name}, |S| = {end:g}",
        )  # fmt: skip
    for k, (axis, look) in enumerate(_looks(loops)):
        L: Any = np.asarray(loops.open_loop)[:, k]
        panel.plot(L.real, L.imag, label=axis, **look)
    panel.plot([-1], [0], "+", color="black", markersize=10, markeredgewidth=1.6)
    panel.set_aspect("equal")
    panel.set_xlim(-4.0, 1.5)
    panel.set_ylim(-2.75, 2.75)
    label(panel, "Re L", "Im L")
    legend_below(axes, ax, 2, *panel.get_legend_handles_labels())
    return panel


def loop_bode(loops: ControlLoops, ax: Given | None = None) -> np.ndarray:
    """Magnitude, dB, and phase, degrees, of the open loop of each axis, all others closed."""
    _, axes = figure(2, 1, (9.0, 6.0), ax, sharex=True)
    upper, lower = axes[:, 0]
    hertz = _grid(upper, loops)
    _grid(lower, loops)
    for k, (axis, look) in enumerate(_looks(loops)):
        L = np.asarray(loops.open_loop)[:, k]
        upper.plot(hertz, 20 * np.log10(np.abs(L)), label=axis, **look)
        phase = np.rad2deg(np.angle(L))
        # no stroke from one end of the axis to the other
        phase[1:][np.abs(np.diff(phase)) > 180] = np.nan
        lower.plot(hertz, phase, **look)
    upper.axhline(0.0, color="black", linewidth=0.8)
    lower.set_ylim(-180, 180)
    lower.set_yticks([-180, -90, 0, 90, 180])
    label(upper, "", "|L|, dB")
    label(lower, "frequency, Hz", "phase of L, degrees")
    legend_below(axes, ax, 4, *upper.get_legend_handles_labels())
    return axes[:, 0]
