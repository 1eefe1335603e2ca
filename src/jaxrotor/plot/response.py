"""Bode and polar plots of frequency responses and of the response to unbalance."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from ..linear.response import FrequencyResponse
from .labels import Room, dense, nice_multiples, number, rows, together
from .linear import HERTZ, RPM, _radians
from .lines import (
    KINDS,
    NOTHING,
    Line,
    heading,
    largest,
    lines_of,
    look,
    magnitude,
    phase,
    prefixed,
    speeds_of,
    words,
)
from .style import GREY, Given, figure, label, legend

# Frequencies that span more than this factor have a logarithmic axis.
_WIDE = 20.0
# Speeds nearer than this part of the width share a label; a character and a row of labels, as parts of
# the width and the height of a panel.
_CLOSE, _LETTER, _ROW = 0.03, 0.0115, 0.085
# The same in a polar panel, as parts of its radius; how far the data reach in it, and how
# far dots are apart.
_LETTER_POLAR, _ROW_POLAR, _REACH, _APART = 0.03, 0.065, 0.82, 0.07


def bode(
    response: FrequencyResponse,
    critical: Sequence[float] | None = None,
    title: str | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Magnitude (a panel for each unit) and phase of every output for every input: over the frequency in
    Hz, or, of the response to unbalance, over the speed in rpm and rad/s.

    `critical`: rad/s, marked by dotted lines with their rpm. The last panel is that of the phases.
    """
    lines, unbalance = lines_of(response), not response.inputs
    along = speeds_of(response)
    units = list(dict.fromkeys(line.unit for line in lines))
    panels = len(units) + 1
    _, axes = figure(panels, 1, (9.5, 1.6 + 2.6 * panels), ax, sharex=True)
    for unit, panel in zip(units, axes[:-1, 0]):
        mine = [line for line in lines if line.unit == unit]
        size, shown, limits = magnitude(mine, unbalance)
        if limits[0] > 0:
            panel.set_yscale("log")
        for line in mine:
            style = look(lines.index(line), len(along))
            panel.plot(along, size * np.abs(line.values), label=line.name, **style)
        panel.set_ylim(*limits)
        label(panel, "", f"{words(response, mine[0])}, {shown}")
        legend(panel, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    _phases(axes[-1, 0], along, lines, response)
    if not unbalance and along.min() > 0 and along.max() > _WIDE * along.min():
        axes[-1, 0].set_xscale("log")
        axes[-1, 0].xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    if np.ptp(along) > 0:
        axes[-1, 0].set_xlim(along.min(), along.max())
    if unbalance:
        _radians(axes[0, 0])
    if critical is not None:
        _mark(list(axes[:, 0]), np.asarray(critical, float), 1.0 if unbalance else 1 / 60)
    axes[0, 0].set_title(heading(response) if title is None else title, fontsize=11, loc="left")
    return axes[:, 0]


def _phases(ax: Axes, along: np.ndarray, lines: list[Line], response: FrequencyResponse) -> None:
    for k, line in enumerate(lines):
        least = NOTHING * largest([one for one in lines if one.unit == line.unit])
        angles = phase(line.values, KINDS[response.kind][3], least)
        ax.plot(along, np.rad2deg(angles), **look(k, len(along)))
    low, high = ax.get_ylim()
    step = next((s for s in (15, 45, 90, 180, 360, 720) if high - low < 8 * s), 3600)
    ax.yaxis.set_major_locator(MultipleLocator(step))
    if response.inputs:
        label(ax, "frequency, Hz", "phase to the input, deg")
    else:
        label(ax, "speed, rpm", "phase to the rotor's x axis, deg")


def _mark(panels: Sequence[Axes], critical: np.ndarray, per_rpm: float) -> None:
    """Dotted lines; their labels stand in rows above the data of the first panel."""
    ax = panels[0]
    first, last = ax.get_xlim()
    rpm = np.sort(RPM * critical[np.isfinite(critical)])
    rpm = rpm[(rpm * per_rpm >= first) & (rpm * per_rpm <= last)]
    if not rpm.size:
        return
    for panel in panels:
        for x in rpm * per_rpm:
            panel.axvline(x, color="black", linestyle=":", linewidth=0.9, zorder=1)
    high = ax.get_ylim()[1]
    into = ax.transScale + ax.transLimits  # parts of the panel
    each = [float(into.transform((x * per_rpm, high))[0]) for x in rpm]
    groups = together(each, _CLOSE)
    texts = [", ".join(dict.fromkeys(number(rpm[k]) for k in g)) + " rpm" for g in groups]
    widths = [_LETTER * (len(text) + 1) for text in texts]
    # a label near an end stays inside
    middles = [(each[g[0]] + each[g[-1]]) / 2 for g in groups]
    at = [min(max(x, w / 2), 1 - w / 2) for x, w in zip(middles, widths)]
    where = rows(at, widths)
    low, high = ax.get_ylim()
    room = _ROW * (max(where) + 1)
    up = (high / low) ** (1 / (1 - room)) * low if low > 0 else high / (1 - room)
    ax.set_ylim(low, up)
    for x, row, text in zip(at, where, texts):
        ax.annotate(
            text,
            (x, 1 - _ROW * row - 0.01),
            xycoords="axes fraction",
            ha="center",
            va="top",
            fontsize=8,
            bbox=dict(boxstyle="square,pad=0.1", facecolor="white", edgecolor="none", alpha=0.85),
            zorder=6,
        )


def polar(
    response: FrequencyResponse,
    mark: Sequence[float] | None = None,
    title: str | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Amplitude over the phase's lag, clockwise, so that the plane is that of the complex amplitudes: a
    line for every output and input, a panel for each unit. A star marks the peak of each.

    `mark`: speeds (of a frequency response frequencies) in rad/s to mark on the lines; by default round
    ones, as many as have room for their labels. `ax`: of the projection "polar".
    """
    lines = lines_of(response)
    units = list(dict.fromkeys(line.unit for line in lines))
    size = (6.6 * len(units), 7.2 + 0.25 * len(lines))
    _, axes = figure(1, len(units), size, ax, subplot_kw={"projection": "polar"})
    for unit, panel in zip(units, axes[0]):
        mine = [(k, line) for k, line in enumerate(lines) if line.unit == unit]
        _draw_polar(panel, mine, response, mark)
        panel.set_title(
            f"{heading(response) if title is None else title}\n{panel.get_title()}", fontsize=10
        )
    return axes[0]


def _draw_polar(ax: Any, lines: list[tuple[int, Line]], response: FrequencyResponse, mark) -> None:
    along, turns = speeds_of(response), "Hz" if response.inputs else "rpm"
    size, shown = prefixed([line for _, line in lines])
    radius = (size * largest([line for _, line in lines]) or 1.0) / _REACH
    ax.set_theta_direction(-1)
    # in parts of the radius; the lag runs clockwise, so this is the complex plane
    paths = [size * line.values / radius for _, line in lines]
    room = Room(np.concatenate([dense(path) for path in paths]), 0.99)
    _radial(ax, room, paths, shown, radius)
    spots = []  # which line, speed, where, whether it is the peak
    for k, (path, (_, line)) in enumerate(zip(paths, lines)):
        peak = int(np.argmax(np.abs(line.values)))
        spots.append((k, along[peak], path[peak], True))
    marked = nice_multiples(along.min(), along.max())
    if mark is not None:
        marked = (HERTZ if response.inputs else RPM) * np.asarray(mark, float)
    for speed in marked[(marked >= along.min()) & (marked <= along.max())]:
        for k, path in enumerate(paths):
            spots.append((k, speed, np.interp(speed, along, path), False))
    for (k, line), path in zip(lines, paths):
        style = {**look(k, len(along)), "marker": ""}
        value, speed = size * np.abs(line.values).max(), along[np.argmax(np.abs(line.values))]
        name = f"{line.name}, peak {number(value)} {shown} at {number(speed)} {turns}"
        ax.plot(-np.angle(path), radius * np.abs(path), label=name, **style)
    placed: list[tuple[int, complex]] = []
    for k, speed, at, peak in spots:
        # at the centre, and where the line is marked already, a label tells nothing
        near = [abs(at), *(abs(at - other) for line, other in placed if line == k)]
        if not peak and mark is None and min(near) < _APART:
            continue
        text = number(speed) + f" {turns}" * peak
        centre = room.take(at, (_LETTER_POLAR * len(text), _ROW_POLAR), 0.02)
        if centre is None and not peak and mark is None:
            continue
        placed.append((k, at))
        colour = look(lines[k][0], 1)["color"]
        ax.plot(
            -np.angle(at),
            radius * abs(at),
            marker="*" if peak else "o",
            markersize=12 if peak else 4,
            markeredgecolor="black" if peak else colour,
            color=colour,
            zorder=6 if peak else 5,
        )
        if centre is not None:
            ax.text(
                -np.angle(centre),
                radius * abs(centre),
                text,
                ha="center",
                va="center",
                fontsize=8,
                color=colour,
                fontweight="bold" if peak else "normal",
            )
    what = words(response, lines[0][1])
    ax.set_title(f"{what}, {shown}, over the phase's lag; dots: {turns}", fontsize=10)
    legend(ax, loc="upper center", bbox_to_anchor=(0.5, -0.06))


def _radial(ax: Any, room: Room, paths: list[np.ndarray], shown: str, radius: float) -> None:
    """Rings, with their labels where the lines leave most room; the unit stands at the outermost."""
    ax.set_rlim(0, radius)
    ways = np.deg2rad([67.5, 112.5, 247.5, 292.5])  # steep, so that none touches the next
    points = np.concatenate([dense(path) for path in paths])

    def far(way: float) -> float:
        near = np.abs(np.angle(points * np.exp(-1j * way))) < np.deg2rad(20)
        return float(np.abs(points[near]).max(initial=0.0))

    way = min(ways, key=far)
    rings = np.asarray(MaxNLocator(4).tick_values(0, radius))
    rings = rings[(rings > 0) & (rings < 0.93 * radius)]
    texts = [f"{ring:g}" for ring in rings]
    texts[-1:] = [f"{text} {shown}" for text in texts[-1:]]
    ax.set_yticks(rings, texts, fontsize=8, color=GREY)
    ax.set_rlabel_position(-np.rad2deg(way))
    for ring, text in zip(rings, texts):
        centre = ring / radius * np.exp(1j * way)
        room.block(centre, (_LETTER_POLAR * len(text), _ROW_POLAR))
