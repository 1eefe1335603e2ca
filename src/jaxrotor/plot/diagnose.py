"""Spectra and orders of a run: full spectrum, waterfall, cascade, tracked orders."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ..diagnostics.orders import OrderTrack
from ..diagnostics.spectra import FullSpectrum
from ..diagnostics.waterfall import Waterfall
from .labels import number, readable
from .style import COLOURS, GREY, Given, figure, label, legend

_HERTZ, _RPM = 1 / (2 * np.pi), 30 / np.pi
_ORDERS = (0.5, 1.0, 2.0)
# Below the highest line so much (dB) is not told from nothing.
_RANGE = 60.0
# A speed that ripples by this part of the highest is still taken for rising.
_RIPPLE = 1e-3
# Phases are drawn from a turn below to so many degrees.
_AHEAD = 45
# Spectra in a cascade, at most.
_ROWS = 40


def full_spectrum(
    found: FullSpectrum,
    speed: float | None = None,
    orders: Sequence[float] = _ORDERS,
    unit: str = "m",
    highest: float | None = None,
    title: str = "Full spectrum",
    ax: Given | None = None,
) -> Axes:
    """Amplitudes of backward (left) and forward whirl (right), the other way round where the `speed`
    (rad/s) is negative; with it, dotted lines at so many times it, those of forward whirl positive.
    `highest`: Hz, where the axis ends; by default a little beyond the orders."""
    _, axes = figure(1, 1, (9.5, 4.6), ax)
    panel = axes[0, 0]
    size, words = readable(unit, found.amplitude)
    panel.plot(found.frequency, size * found.amplitude, color=COLOURS[0], linewidth=1.1)
    end = float(np.abs(found.frequency).max())
    turns = 0.0 if speed is None else abs(float(speed)) * _HERTZ
    if highest is None and turns and orders:
        highest = 1.6 * max(orders) * turns
    end = end if highest is None else min(end, float(highest))
    panel.set_xlim(-end, end)
    shown = np.abs(found.frequency) <= end
    panel.set_ylim(0, 1.12 * size * float(found.amplitude[shown].max()) or 1.0)
    panel.axvline(0.0, color=GREY, linewidth=0.8)
    for order in orders if turns else ():
        for sign in (-1, 1):
            at = sign * order * turns
            if abs(at) < end:
                against = sign * (1.0 if speed is None else float(speed)) < 0
                _marker(panel, at, f"{'−' if against else ''}{order:g}×")
    label(panel, _sides(speed), f"amplitude, {words}")
    told = "" if speed is None else f", at {number(abs(speed) * _RPM)} rpm"
    panel.set_title(title + told, fontsize=10, loc="left", pad=16)
    return panel


def _marker(ax: Axes, x: float, words: str) -> None:
    ax.axvline(x, color=GREY, linestyle=":", linewidth=0.9, zorder=0)
    ax.annotate(
        words, (x, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2),
        textcoords="offset points", ha="center", va="bottom", fontsize=8, color="#404040",
    )  # fmt: skip


def waterfall_map(
    found: Waterfall,
    orders: Sequence[float] = _ORDERS,
    unit: str = "m",
    highest: float | None = None,
    decibel: bool = True,
    title: str = "Waterfall",
    ax: Given | None = None,
) -> Axes:
    """Amplitude by colour over frequency and speed; over time where the speed does not rise or fall
    throughout. In dB the 60 below the highest are told apart. `highest`: Hz, where the axis ends."""
    keep, low, high = _frequencies(found, highest)
    along, axis = _along(found)
    values = found.amplitude[:, keep]
    fig, axes = figure(1, 1, (9.5, 6.0), ax)
    panel = axes[0, 0]
    size, words = readable(unit, values)
    what = f"amplitude, {words}"
    if decibel:
        top = max(float(values.max()), np.finfo(float).tiny)
        values = 20 * np.log10(np.maximum(values / top, 10 ** (-_RANGE / 20)))
        what, size = f"amplitude, dB of {number(size * top)} {words}", 1.0
    image = panel.pcolormesh(
        found.frequency[keep], along, size * values, shading="nearest", rasterized=True
    )
    fig.colorbar(image, ax=panel, label=what)
    panel.grid(False)
    panel.set_xlim(low, high)
    if np.ptp(along) > 0:
        panel.set_ylim(float(along.min()), float(along.max()))
    _order_lines(panel, found, along, orders, "white", (low, high))
    label(panel, _frequency_words(found), axis)
    panel.set_title(title, fontsize=10, loc="left", pad=16)
    return panel


def cascade(
    found: Waterfall,
    orders: Sequence[float] = _ORDERS,
    unit: str = "m",
    highest: float | None = None,
    title: str = "Cascade",
    ax: Given | None = None,
) -> Axes:
    """Spectra as lines above each other, each from its speed (or time) on; the bar tells their amplitude.
    What lies behind a nearer one is hidden."""
    keep, low, high = _frequencies(found, highest)
    along, axis = _along(found)
    # even steps along the axis: a plateau would heap up
    places = np.linspace(along.min(), along.max(), _ROWS)
    chosen = np.unique(np.abs(along[:, None] - places).argmin(axis=0))
    chosen = chosen[np.argsort(along[chosen], kind="stable")]
    frequency, values = found.frequency[keep], found.amplitude[chosen][:, keep]
    top = float(values.max()) or 1.0
    span = float(np.ptp(along)) or 1.0
    tall = 0.22 * span / top
    _, axes = figure(1, 1, (9.5, 6.4), ax)
    panel = axes[0, 0]
    # far ones first: the nearer ones stand before them
    for k, row in reversed(list(enumerate(chosen))):
        line = along[row] + tall * values[k]
        order = 3 - 0.001 * k
        panel.fill_between(frequency, along[row], line, color="white", linewidth=0, zorder=order)
        panel.plot(frequency, line, color=COLOURS[0], linewidth=0.8, zorder=order + 5e-4)
    lowest, upper = (
        float(along.min()) - 0.02 * span,
        float((along[chosen] + tall * values.max(axis=1)).max()),
    )
    panel.grid(False)
    panel.set_xlim(low, high)
    panel.set_ylim(lowest, upper + 0.03 * span)
    _order_lines(panel, found, along, orders, COLOURS[1], (low, high))
    size, words = readable(unit, values)
    bar = _round_below(size * top) / size
    panel.plot([1.02, 1.02], [along.min(), along.min() + tall * bar], color="black", linewidth=2.5,
            transform=panel.get_yaxis_transform(), clip_on=False)  # fmt: skip
    panel.annotate(
        f"{size * bar:g} {words}", (1.03, along.min() + tall * bar / 2),
        xycoords=panel.get_yaxis_transform(), va="center", fontsize=9, annotation_clip=False,
    )  # fmt: skip
    label(panel, _frequency_words(found), axis)
    panel.set_title(title, fontsize=10, loc="left", pad=16)
    return panel


def _round_below(x: float) -> float:
    power = 10.0 ** np.floor(np.log10(x))
    return next(k * power for k in (5, 2, 1) if k * power <= x * (1 + 1e-9))


def _frequencies(found: Waterfall, highest: float | None) -> tuple[np.ndarray, float, float]:
    top = float(found.frequency.max())
    top = top if highest is None else min(top, float(highest))
    low = -top if found.full else 0.0
    return np.flatnonzero((found.frequency >= low) & (found.frequency <= top)), low, top


def _frequency_words(found: Waterfall) -> str:
    return _sides(found.speed) if found.full else "frequency, Hz"


def _sides(speed: Any) -> str:
    """What stands at negative and at positive frequencies, by the sense in which the shaft turns."""
    least, most = (0.0, 0.0) if speed is None else (np.min(speed), np.max(speed))
    if least < 0 < most:
        return "frequency, Hz:  ← from y to x | from x to y →"
    return f"frequency, Hz:  ← {'forward | backward' if least < 0 else 'backward | forward'} →"


def _along(found: Waterfall) -> tuple[np.ndarray, str]:
    """Speeds in rpm where they rise or fall throughout, but for ripples; else times."""
    speed = np.abs(found.speed)
    steps, slack = np.diff(speed), _RIPPLE * float(speed.max())
    if np.ptp(speed) > 10 * slack:
        if np.all(steps >= -slack):
            return _RPM * np.maximum.accumulate(speed), "speed, rpm"
        if np.all(steps <= slack):
            return _RPM * np.minimum.accumulate(speed), "speed, rpm"
    return found.time, "time, s"


def _order_lines(
    ax: Axes, found: Waterfall, along: np.ndarray, orders: Sequence[float], colour: str, limits
) -> None:
    """Lines at so many times the speed, named where they leave the picture."""
    for order in orders:
        for sign in (-1, 1) if found.full else (1,):
            at = sign * order * np.abs(found.speed) * _HERTZ
            against = sign * float(np.mean(found.speed)) < 0
            ax.plot(at, along, color=colour, linewidth=0.8, linestyle="--", alpha=0.8, zorder=2)
            inside = np.flatnonzero((at >= limits[0]) & (at <= limits[1]))
            if not inside.size:
                continue
            last = inside[np.argmax(along[inside])]
            words = f"{'−' if against and found.full else ''}{order:g}×"
            if inside.size == at.size:  # through the top
                place, shift, across = (at[last], 1.0), (0, 3), "center"
                where: Any = ("data", "axes fraction")
            else:  # through a side
                place = (limits[(sign + 1) // 2], along[last])
                shift, where, across = (-4 * sign, -2), "data", "right" if sign > 0 else "left"
            ax.annotate(
                words, place, xycoords=where, xytext=shift, textcoords="offset points",
                ha=across, va="bottom" if across == "center" else "top", fontsize=9,
                color="#404040" if across == "center" else colour, zorder=6,
            )  # fmt: skip


def order_tracks(
    found: OrderTrack,
    unit: str = "m",
    title: str = "Order tracking",
    ax: Given | None = None,
) -> np.ndarray:
    """Amplitude and phase of each order over the speed. A phase is drawn where its order has a hundredth of
    its own peak at least, and half a hundredth of the highest; it lies between -315° and 45°, so that
    resonances in x (from 0) and y (from -90°) pass unbroken."""
    _, axes = figure(2, 1, (9.0, 6.4), ax, sharex=True)
    speed = np.abs(found.speed) * _RPM
    order = np.argsort(speed, kind="stable")
    size, words = readable(unit, found.magnitude)
    for k, one in enumerate(found.orders):
        values = found.amplitude[order, k]
        magnitude = np.abs(values)
        colour = COLOURS[k % len(COLOURS)]
        axes[0, 0].plot(speed[order], size * magnitude, color=colour, label=f"{one:g}×")
        least = max(0.01 * magnitude.max(), 0.005 * found.magnitude.max())
        clear = magnitude >= least
        phase = (np.rad2deg(np.angle(values)) - _AHEAD) % -360 + _AHEAD
        # no stroke across the whole panel where a phase goes round
        breaks = np.flatnonzero(np.abs(np.diff(phase)) > 180) + 1
        shown = np.insert(np.where(clear, phase, np.nan), breaks, np.nan)
        along = np.insert(speed[order], breaks, np.nan)
        axes[1, 0].plot(along, shown, ".-", color=colour, markersize=2.5)
    axes[0, 0].set_ylim(0, None)
    axes[1, 0].set_ylim(_AHEAD - 360, _AHEAD)
    axes[1, 0].set_yticks(range(-270, 1, 90))
    axes[0, 0].set_xlim(float(speed.min()), float(speed.max()))
    label(axes[0, 0], "", f"amplitude, {words}", title)
    label(axes[1, 0], "speed, rpm", "phase, °")
    legend(axes[0, 0], loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return axes[:, 0]
