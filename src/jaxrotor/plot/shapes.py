"""Mode shapes: how the machine's axes look in each mode, flat or in space."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..core.errors import InputError
from ..linear.linearise import LinearModel, linearize
from ..linear.modes import Mode, modes
from ..machine.machine import Machine
from ..machine.wiring import unknown
from . import deflection
from .deflection import PHI, PITCH, Axis, Places, X, Y, Z
from .linear import HERTZ, RPM
from .machine import _STEEL as STEEL
from .space import draw_space, space_panels
from .style import COLOURS, GREY, Given, figure, figure_of, legend_below

# Modes drawn where none is named.
_LOWEST = 6


def mode_shapes(
    machine: Machine,
    model: LinearModel | float,
    which: Sequence[str | int] | str | int | None = None,
    view: Literal["2d", "3d"] = "2d",
    ax: Given | None = None,
) -> np.ndarray:
    """Shapes of modes of `model`, each to its own scale: largest is 1. A panel for each.

    `model`: `linearize(machine, speed)`, or the speed (rad/s) at which it is linearised.

    `which`: names such as "1 forward", or numbers from 1, the lowest; by default the six lowest.
    "2d": lateral modes by x and y, each at the instant at which it is largest, inside the band of their
    orbits' long half axes; torsional ones by phi, axial ones by z. "3d": the stations' orbits, coloured
    by which way they run against the station's own spin, with the centre line at the instant of the dots;
    torsional modes by turned spokes, axial ones by shifted stations.

    `ax`: of the projection "3d" for that view. Raises `InputError` for another view, for a mode that is
    none, and where no mode oscillates.
    """
    if view not in ("2d", "3d"):
        raise InputError(f'view must be "2d" or "3d", but is {view!r}')
    model = model if isinstance(model, LinearModel) else linearize(machine, model)
    chosen = _chosen(modes(model, _LOWEST if which is None else None), which)
    where = deflection.places(machine)
    lanes = int(where.lanes.max()) + 1
    if view == "2d":
        columns = min(2, len(chosen)) if ax is None else len(chosen)
        rows = -(-len(chosen) // columns)
        size = (6.8 * columns, 0.6 + rows * (1.2 + 1.5 * lanes))
        grid, high = figure(rows, columns, size, ax)[1].ravel(), None
        for panel in grid[len(chosen) :]:
            panel.remove()
        panels = list(grid[: len(chosen)])
    else:
        panels, high = space_panels(len(chosen), lanes, ax)
    shown: dict[str, Any] = {}
    links = deflection.links(machine, where)
    for panel, mode in zip(panels, chosen):
        at_stations = deflection.station_amplitudes(machine, model, mode.shape)
        lines = deflection.axes_of(machine, where, at_stations)
        dots = at_stations[:, deflection.SAME]
        left = 0.02 if high else 0.0
        title = _title(mode, float(model.speed))
        # nobody knows how wide a panel is that is given
        title = title if ax is None else title.replace(" rpm, ", " rpm,\n")
        panel.set_title(title, fontsize=10, loc="left", x=left, y=high)
        if view == "2d":
            _draw_flat(panel, mode.kind, where, lines, links, dots, shown)
        else:
            draw_space(panel, mode.kind, where, lines, links, dots, _senses(model), shown)
            for line in panel.lines if ax is not None else ():
                # a layout measures lines in space as if they were flat, and finds no room
                line.set_in_layout(False)
    drawn = np.empty(len(panels), object)
    drawn[:] = panels
    handles, names = list(shown.values()), list(shown)
    if view == "2d" or ax is not None:
        legend_below(drawn, ax, 4, handles, names)
    else:  # without a layout, which would pull the overlapping squares apart
        look: dict[str, Any] = dict(ncols=4, frameon=False, fontsize=9)
        figure_of(drawn).legend(handles, names, loc="lower center", **look)
    return drawn


def model_shapes(
    model: LinearModel,
    machine: Machine,
    which: Sequence[str | int] | str | int | None = None,
    view: Literal["2d", "3d"] = "2d",
    ax: Given | None = None,
) -> np.ndarray:
    """Shapes of modes of a model, on the `machine` that it was made of. The rest as in `mode_shapes`:
    `which` by names such as "1 forward" or numbers from 1, by default the six lowest; `view` flat or in
    space."""
    return mode_shapes(machine, model, which, view, ax)


def _chosen(found: list[Mode], which) -> list[Mode]:
    if not found:
        raise InputError("the machine has no oscillating mode at this speed")
    if which is None:
        return found
    named = {mode.name: mode for mode in found}
    out = []
    for one in [which] if isinstance(which, (str, int)) else which:
        if isinstance(one, str):
            if one not in named:
                raise InputError(unknown("mode", one, named))
            out.append(named[one])
        elif 1 <= one <= len(found):
            out.append(found[one - 1])
        else:
            raise InputError(f"{unknown('mode', str(one), named)}, or 1 to {len(found)}")
    if not out:
        raise InputError("which: names no mode: leave it out for the lowest ones")
    return out


def _senses(model: LinearModel) -> np.ndarray:
    """Which way each station spins, 1 or -1: a gear's two sides differ."""
    spins = np.asarray(model.state.velocity)[:, 5]
    return np.where((spins if spins.any() else float(model.speed) + 0 * spins) < 0, -1.0, 1.0)


def _title(mode: Mode, speed: float) -> str:
    def small(value: float) -> str:
        return f"{value if abs(value) > 1e-9 else 0.0:.3g}"

    return (
        f"{mode.name}: {HERTZ * mode.frequency:.4g} Hz at {RPM * speed:.4g} rpm, damping ratio "
        f"{small(100 * mode.damping_ratio)} %, log decrement {small(mode.log_decrement)}"
    )


def _draw_flat(
    ax: Axes, kind: str, where: Places, lines: list[Axis], links, dots: np.ndarray, shown
) -> None:
    if kind == "lateral":
        drawn = (("x at its largest", X, 0, "-"), ("y at its largest", Y, 1, (0, (4, 3))))
        words = "displacement"
    elif kind == "torsional":
        drawn, words = (("phi", PHI, 2, "-"),), "angle phi"
    else:
        drawn, words = (("z", Z, 3, "-"),), "displacement z"
    columns = [column for _, column, _, _ in drawn]
    every = np.concatenate([dots, *(line.amplitudes for line in lines)])
    every = every[np.isfinite(every[:, 0])][:, columns]
    size = deflection.scale(_reach(every))
    factors = _together([deflection.largest(every[:, k]) for k in range(len(columns))])
    for line in lines:
        base = -PITCH * line.lane
        values = line.amplitudes[:, columns] / size
        reach = _reach(values)
        ax.plot(line.z, np.where(np.isnan(reach), np.nan, base), color=GREY, linewidth=0.9)
        band = ax.fill_between(line.z, base - reach, base + reach, color=GREY, alpha=0.18, lw=0)
        shown.setdefault("amplitude (of an orbit its long half axis), either way", band)
        for k, (name, _, colour, style) in enumerate(drawn):
            look: dict[str, Any] = dict(color=COLOURS[colour], linestyle=style, linewidth=1.5)
            ax.plot(line.z, base + np.real(values[:, k] * factors[k]), zorder=3, label=name, **look)
            shown.setdefault(name, Line2D([], [], **look))
    for z, lanes in links:
        ax.plot(z, [-PITCH * k for k in lanes], color=GREY, linewidth=0.9, linestyle=":")
    bases = -PITCH * where.lanes
    for k, (name, column, colour, _) in enumerate(drawn):
        y = bases + np.real(dots[:, column] / size * factors[k])
        dot: dict[str, Any] = dict(color=COLOURS[colour], markersize=3.5, zorder=4)
        ax.plot(where.z, y, "o", label=f"{name}, stations", **dot)
    _mark_stations(ax, where, bases, shown)
    lanes = range(int(where.lanes.max()) + 1)
    ax.set_yticks(
        [-PITCH * lane + y for lane in lanes for y in (-1, 0, 1)], ["-1", "0", "1"] * len(lanes)
    )
    ax.set_ylim(-PITCH * lanes[-1] - 1.25, 1.7)
    room = 0.06 * (np.ptp(where.z) or 1.0)
    ax.set_xlim(where.z.min() - room, where.z.max() + room)
    ax.set_xlabel("z, m")
    ax.set_ylabel(f"{words},\nlargest = 1")


def _reach(values: np.ndarray) -> np.ndarray:
    """Largest displacement over a turn: of one column, or of an orbit in two."""
    if values.shape[1] == 1:
        return np.abs(values[:, 0])
    return deflection.major(values[:, 0], values[:, 1])


def _together(factors: list[complex]) -> list[complex]:
    """Turns y's instant by half a turn where y moves against x, and not just a quarter apart from it."""
    if len(factors) > 1 and np.real(np.conj(factors[0]) * factors[1]) < -0.5:
        factors[1] = -factors[1]
    return factors


def _mark_stations(ax: Axes, where: Places, bases: np.ndarray, shown) -> None:
    for i in where.rotors:
        ends = [bases[i] - 0.6, bases[i] + 0.6]
        ax.plot([where.z[i]] * 2, ends, color=STEEL, linewidth=7, solid_capstyle="butt", zorder=0)
        shown.setdefault("rotor", Patch(color=STEEL))
    look: dict[str, Any] = dict(
        marker="^", color="black", markerfacecolor="#D8EFE6", markersize=9, linestyle=""
    )
    for i in where.supported:
        ax.plot(where.z[i], bases[i] - 0.2, zorder=1, **look)
        shown.setdefault("supported or driven", Line2D([], [], **look))
    last: dict[int, float] = {}
    width = (np.ptp(where.z) or 1.0) / 85
    for i in sorted(where.named, key=lambda i: where.z[i]):
        half = width * len(where.names[i]) / 2
        # names that would touch stand in two rows
        low = where.z[i] - half < last.get(int(where.lanes[i]), -np.inf)
        last[int(where.lanes[i])] = -np.inf if low else where.z[i] + half + width
        ax.annotate(
            where.names[i],
            (where.z[i], bases[i] + (1.1 if low else 1.35)),
            ha="center",
            va="bottom",
            fontsize=8,
            color="#404040",
        )
