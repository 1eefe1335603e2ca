"""A mode in space: orbits and the deflected centre line, twist, or stretch."""

from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from ..linear.modes import word_of
from . import deflection
from .deflection import PHI, PITCH, Axis, Places, X, Y, Z
from .linear import _LOOK
from .style import GREY, Given, figure, new_figure

# Below this share of circularity an orbit has no direction worth a colour; orbits smaller than this
# part of the largest cannot be seen.
_POINT = 5e-3
# How far the largest twist turns its spoke (rad), and how far the largest axial displacement moves its
# station (part of the machine's length).
_TURN, _SHIFT = 1.0, 0.08
# inches: of a panel, and of its title and the legend
_WIDE, _TITLE, _LEGEND = 6.8, 0.25, 0.7
_ANGLES = np.linspace(0.0, 2 * np.pi, 73)


def space_panels(count: int, lanes: int, ax: Given | None) -> tuple[list[Any], float | None]:
    """Panels in two columns of a new figure, and how high in a panel its title stands. What is drawn in
    space fills but the middle of a square: the squares overlap, so that the drawings need not be small."""
    if ax is not None:
        axes = figure(1, count, ax=ax, subplot_kw={"projection": "3d"})[1]
        return list(axes[0]), None
    rows, columns, high = -(-count // 2), min(2, count), 1.75 + 1.35 * lanes
    size = columns * _WIDE, rows * high + _LEGEND
    fig = new_figure(size)
    axes = []
    for k in range(count):
        left, middle = (k % 2) * _WIDE, size[1] - (k // 2 + 0.5) * high - _TITLE / 2
        place = left, middle - _WIDE / 2, _WIDE, _WIDE
        scaled = [x / size[i % 2] for i, x in enumerate(place)]
        axes.append(fig.add_axes(scaled, projection="3d"))  # pyright: ignore
        axes[-1].patch.set_visible(False)
    return axes, 0.5 + (high - _TITLE) / 2 / _WIDE


def draw_space(
    ax: Any,
    kind: str,
    where: Places,
    lines: list[Axis],
    links: list,
    dots: np.ndarray,
    senses: np.ndarray,
    shown: dict[str, Any],
) -> None:
    """The machine's z along, its x to the back, its y up. `dots`: (n, 4) amplitudes of the stations;
    `senses` of their spins; `shown` collects what the legend shall explain."""
    low = -PITCH * where.lanes
    for line in lines:
        rest = np.where(np.isnan(line.z), np.nan, -PITCH * line.lane)
        ax.plot(line.z, 0 * rest, rest, color=GREY, linewidth=0.9)
    for z, lanes in links:
        ax.plot(z, [0, 0], [-PITCH * k for k in lanes], color=GREY, linewidth=0.9, linestyle=":")
    shown.setdefault("at rest", Line2D([], [], color=GREY, linewidth=0.9))
    if kind == "lateral":
        _whirl(ax, where, lines, dots, senses, shown)
    elif kind == "torsional":
        _twist(ax, where, lines, dots, shown)
    else:
        _stretch(ax, where, lines, dots, shown)
    for artist in ax.lines:
        artist.set_clip_on(False)
    for i in where.named:
        ax.text(where.z[i], 0, low[i] - 1.15, where.names[i], fontsize=8, ha="center", va="top")
    lanes = int(where.lanes.max()) + 1
    length = np.ptp(where.z) or 1.0
    ax.set_xlim(where.z.min() - 0.09 * length, where.z.max() + 0.09 * length)
    ax.set_ylim(-1.1, 1.1)
    ax.set_zlim(low.min() - 1.4, 1.1)
    ax.set_yticks([-1, 0, 1])
    ax.set_zticks(
        [-PITCH * k + y for k in range(lanes) for y in (-1, 0, 1)], ["-1", "0", "1"] * lanes
    )
    ax.tick_params(labelsize=8, pad=0)
    ax.set_xlabel("z, m", labelpad=14)
    ax.set_ylabel("x", labelpad=0)
    ax.set_zlabel("y", labelpad=-4)
    ax.set_box_aspect((4.2, 1.1, 1.1 * lanes), zoom=0.84)
    ax.view_init(elev=18, azim=-62)


def _whirl(ax, where: Places, lines, dots, senses, shown) -> None:
    every = np.concatenate([dots, *(line.amplitudes for line in lines)])
    every = every[np.isfinite(every[:, X])]
    size = deflection.scale(deflection.major(every[:, X], every[:, Y]))
    now = deflection.instant(every[:, X], every[:, Y]) / size
    look: dict[str, Any] = dict(color="black", linewidth=1.6)
    for line in lines:
        x, y = (np.real(line.amplitudes[:, k] * now) for k in (X, Y))
        ax.plot(line.z, x, y - PITCH * line.lane, label="centre line", **look)
    shown.setdefault(
        "centre line at the instant of the dots", Line2D([], [], marker="o", markersize=4, **look)
    )
    turning = senses * deflection.turning(dots[:, X], dots[:, Y])
    reach = deflection.major(dots[:, X], dots[:, Y]) / size
    for z, lane, turn, radius, amplitude in zip(where.z, where.lanes, turning, reach, dots):
        name = word_of(float(turn))
        colour, style, _ = _LOOK[name]
        x, y = (np.real(amplitude[k] * now * np.exp(1j * _ANGLES)) for k in (X, Y))
        base = -PITCH * lane
        if radius > _POINT:
            path = 0 * x + z, x, y + base
            ax.plot(*path, color=colour, linestyle=style, linewidth=1.2, label=f"orbit, {name}")
            shown.setdefault(f"orbit, {name}", Line2D([], [], color=colour, linestyle=style))
        else:
            colour = GREY
        ax.plot([z], x[:1], y[:1] + base, "o", color=colour, markersize=4)


def _twist(ax, where: Places, lines, dots, shown) -> None:
    every = np.concatenate([dots, *(line.amplitudes for line in lines)])[:, PHI]
    every = every[np.isfinite(every)]
    now = _TURN * deflection.largest(every) / deflection.scale(np.abs(every))
    colour, _, marker = _LOOK["torsional"]
    for line in lines:
        angle, base = np.real(line.amplitudes[:, PHI] * now), -PITCH * line.lane
        ax.plot(line.z, 0 * angle, 0 * angle + base + 1, color=GREY, linestyle=":", linewidth=1)
        ax.plot(line.z, -np.sin(angle), np.cos(angle) + base, color=colour, linewidth=1.6)
    for z, lane, angle in zip(where.z, where.lanes, np.real(dots[:, PHI] * now)):
        base = -PITCH * lane
        circle = np.cos(_ANGLES), np.sin(_ANGLES) + base
        ax.plot(0 * _ANGLES + z, *circle, color=GREY, linewidth=0.5, alpha=0.7)
        tip = [0, -np.sin(angle)], [base, np.cos(angle) + base]
        ax.plot([z, z], *tip, color=colour, marker=marker, markersize=4, markevery=[1])
    look: dict[str, Any] = dict(color=colour, marker=marker, markersize=4)
    shown.setdefault(f"twist, the largest drawn as {_TURN:g} rad", Line2D([], [], **look))


def _stretch(ax, where: Places, lines, dots, shown) -> None:
    every = dots[:, Z]
    now = deflection.largest(every) / deflection.scale(np.abs(every))
    colour, _, marker = _LOOK["axial"]
    moved = _SHIFT * (np.ptp(where.z) or 1.0) * np.real(every * now)
    for z, lane, by in zip(where.z, where.lanes, moved):
        base = -PITCH * lane
        circle = 0.5 * np.cos(_ANGLES), 0.5 * np.sin(_ANGLES) + base
        ax.plot(0 * _ANGLES + z, *circle, color=GREY, linewidth=0.5, alpha=0.7)
        ax.plot(0 * _ANGLES + z + by, *circle, color=colour, linewidth=1.2)
        ax.plot([z, z + by], [0, 0], [base, base], color=colour, linewidth=2)
        ax.plot([z + by], [0], [base], color=colour, marker=marker, markersize=4)
    look: dict[str, Any] = dict(color=colour, marker=marker, markersize=4)
    words = f"axial displacement, the largest drawn as {_SHIFT:.0%} of the length"
    shown.setdefault(words, Line2D([], [], **look))
