"""Where a shaft's centre is: orbits, centreline, Poincaré sections, bifurcation diagrams."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ..diagnostics.bifurcation import Bifurcation
from ..diagnostics.centreline import Centreline
from ..diagnostics.orbit import Orbit
from ..diagnostics.poincare import PoincareSection
from .labels import number, readable
from .style import COLOURS, GREY, Given, figure, heading_above, label, legend_below

_RPM = 30 / np.pi
# The part of a turn that is left blank before each mark: blank, then bright, tells the direction.
_BLANK = 0.03
# An ellipse whose minor axis is more than this part of its major one lies in no direction.
_ROUND = 0.97


def orbits(
    found: Mapping[str, Orbit] | Orbit,
    unit: str = "m",
    title: str = "",
    ax: Given | None = None,
) -> np.ndarray:
    """One orbit; or several side by side, to one scale, by name, such as `{"all": orbit(...), "1x":
    filtered_orbit(...)}`.

    Each turn begins with a dot, where the keyphasor's mark passes, after a short blank (blank-bright); the
    arrow has the direction of motion. Of an orbit of one order the ellipse is told."""
    found = {"": found} if isinstance(found, Orbit) else found
    _, axes = figure(1, len(found), (0.8 + 4.4 * len(found), 5.3), ax)
    reach = 1.15 * max(float(np.abs([o.x, o.y]).max()) for o in found.values()) or 1.0
    size, words = readable(unit, [reach])
    for k, (panel, (name, one)) in enumerate(zip(axes[0], found.items())):
        _orbit(panel, one, size, COLOURS[k % len(COLOURS)])
        panel.set_xlim(-size * reach, size * reach)
        panel.set_ylim(-size * reach, size * reach)
        panel.set_aspect("equal", adjustable="box")
        told = _ellipse_words(one, size, words).removeprefix("" if name else ": ")
        label(panel, f"x, {words}", f"y, {words}" if k == 0 else "", f"{name}{told}")
    speed = next(iter(found.values())).speed
    heading = f"{title or 'Orbit'} at {number(abs(speed) * _RPM)} rpm, about its mean"
    heading_above(axes, ax, heading, 11)
    return axes[0]


def _orbit(ax: Axes, one: Orbit, size: float, colour: str) -> None:
    marks = one.keyphasor.shape[0]
    points = (one.x.size - 1) // marks
    x, y = size * one.x.copy(), size * one.y.copy()
    # an arrow where the last turn is run through fastest, clear of its blank
    first, ahead = (marks - 1) * points, max(1, points // 90)
    clear = slice(first + points // 12, first + int((1 - _BLANK) * points) - 2 * ahead)
    at = clear.start + int(np.argmax(np.hypot(np.diff(x), np.diff(y))[clear]))
    start, end = (x[at], y[at]), (x[at + ahead], y[at + ahead])
    for k in range(1, marks + 1):
        x[k * points - int(_BLANK * points) : k * points] = np.nan
    ax.plot(x, y, color=colour, linewidth=1.3)
    ax.annotate(
        "", end, start, arrowprops=dict(arrowstyle="-|>", color=colour, lw=1.3, mutation_scale=16)
    )
    ax.plot(*(size * one.keyphasor.T), "o", color="black", markersize=6, zorder=5)


def _ellipse_words(one: Orbit, size: float, words: str) -> str:
    if one.orders.size != 1:
        return ""
    e = one.ellipse(one.orders[0])
    way = {1: "forward", -1: "backward", 0: "straight"}[e.precession]
    axes = f"{number(size * e.major)} × {number(size * e.minor)} {words}"
    round_ = e.minor > _ROUND * e.major
    lying = "" if round_ else f", {np.rad2deg(e.inclination):.0f}°"
    return f": {way}, semi-axes {axes}{lying}"


def centreline(
    found: Centreline,
    clearance: float | None = None,
    unit: str = "m",
    title: str = "Shaft centreline",
    ax: Given | None = None,
) -> Axes:
    """Mean positions, the speed by colour; with a radial `clearance` (in the unit of x and y) inside the
    circle that the bearing leaves, its centre at 0."""
    fig, axes = figure(1, 1, (7.4, 6.2), ax)
    panel = axes[0, 0]
    reach = [clearance] if clearance else [found.x, found.y]
    size, words = readable(unit, np.concatenate([np.ravel(r) for r in reach]))
    x, y, speed = size * found.x, size * found.y, np.abs(found.speed) * _RPM
    panel.plot(x, y, color=GREY, linewidth=0.7, zorder=1)
    dots = panel.scatter(x, y, c=speed, s=16, zorder=2)
    panel.plot(x[0], y[0], "o", color="black", markersize=7, fillstyle="none", label="first")
    panel.plot(x[-1], y[-1], "s", color="black", markersize=8, fillstyle="none", label="last")
    if clearance:
        around = np.linspace(0, 2 * np.pi, 361)
        r = size * clearance
        panel.plot(r * np.cos(around), r * np.sin(around), color="black", linewidth=1.2,
                label=f"clearance {number(r)} {words}")  # fmt: skip
        panel.plot(0, 0, "+", color="black", markersize=9)
    panel.set_aspect("equal", adjustable="datalim")
    fig.colorbar(dots, ax=panel, label="speed, rpm")
    label(panel, f"x, {words}", f"y, {words}", title)
    legend_below(axes, ax, 3, *panel.get_legend_handles_labels())
    return panel


def poincare(
    found: PoincareSection,
    units: tuple[str, str] = ("m", "m/s"),
    names: tuple[str, str] = ("x", "dx/dt"),
    title: str = "Poincaré section",
    ax: Given | None = None,
) -> Axes:
    """Points of the phase plane, once a turn: a point is a motion that repeats each turn, p points one that
    repeats after p turns, a closed curve a quasi-periodic one. What was first is pale."""
    _, axes = figure(1, 1, (6.6, 5.4), ax)
    panel = axes[0, 0]
    (x_size, x_words), (v_size, v_words) = (
        readable(u, [*s, largest]) for u, s, largest in zip(units, found[:2], found.size)
    )
    x, v = x_size * found.x, v_size * found.v
    # a motion that has settled is a point, not its rounding seen large
    sizes = x_size * found.size[0], v_size * found.size[1]
    for values, size, spread in zip((x, v), sizes, (panel.set_xlim, panel.set_ylim)):
        middle, half = 0.5 * (values.max() + values.min()), 0.5 * np.ptp(values)
        half = max(1.15 * half, 0.1 * size, 1e-300)
        spread(middle - half, middle + half)
    shade = np.linspace(0.25, 1.0, x.size)
    panel.scatter(x, v, s=14, color=COLOURS[0], alpha=shade, linewidths=0)
    told = found.period()
    words = {0: "no short period", 1: "repeats each turn"}.get(told, f"repeats after {told} turns")
    label(panel, f"{names[0]}, {x_words}", f"{names[1]}, {v_words}")
    panel.set_title(f"{title}: {x.size} turns, {words}", fontsize=10, loc="left")
    return panel


def bifurcation(
    found: Bifurcation,
    name: str = "",
    title: str = "Bifurcation diagram",
    ax: Given | None = None,
) -> Axes:
    """The quantity (`name` for its axis) once a turn over the parameter: one point above a value where the
    motion repeats each turn, p where it repeats after p, a smear where it does not."""
    _, axes = figure(1, 1, (9.5, 5.6), ax)
    panel = axes[0, 0]
    turning = found.path_unit == "rad/s" and np.array_equal(found.values, found.speed)
    x_size, x_words = readable(found.path_unit, found.values)
    size, words = readable(found.unit, found.points)
    along = np.repeat(x_size * found.values, found.points.shape[1])
    many = 2.5e5 / max(along.size, 1)  # points that share the picture
    panel.plot(along, size * found.points.ravel(), "o", color=COLOURS[0], linestyle="none",
            markersize=float(np.clip(np.sqrt(many) / 2, 0.8, 4.0)), markeredgewidth=0,
            alpha=float(np.clip(many / 20, 0.3, 0.9)), rasterized=True)  # fmt: skip
    where = "speed" if turning else found.path
    name = name or "quantity"
    label(panel, f"{where}, {x_words}" if x_words else where, f"{name} once a turn, {words}")
    failed = int(np.count_nonzero(found.failure != ""))
    told = f" ({failed} runs failed)" if failed else ""
    panel.set_title(f"{title}: {found.points.shape[1]} turns a run{told}", fontsize=10, loc="left")
    return panel
