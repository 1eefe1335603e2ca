"""Where centres go: trajectories, and distances from the axis over speed."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from ..simulation.response import Response
from . import select
from .style import COLOURS, GREY, Given, figure, label, legend, legend_below


def trajectories(
    response: Response,
    stations: str | Sequence[str] | None = None,
    centre: Literal["geometric", "mass"] = "geometric",
    ax: Given | None = None,
) -> np.ndarray:
    """Paths of the geometric (or mass) centres in the plane across the axis, start and end marked: a panel
    for each of the `stations`, by default the rotors that can sway."""
    stations = select.named(stations, select.swaying(response.machine), "stations")
    _, axes = figure(1, len(stations), (5.2 * len(stations), 5.4), ax)
    for panel, name in zip(axes[0], stations):
        part = response[name]
        xyz = np.asarray(part.position[:, :3] if centre == "geometric" else part.mass_centre) * 1e3
        k = select.passage(response, name)
        first = select.around(response, k, 0.05 * float(response.t[-1]))
        last = slice(-max(20, len(xyz) // 200), None)
        t = np.asarray(response.t)
        whole = select.smooth(t, xyz[:, :2], slice(None))
        panel.plot(*whole.T, color=GREY, linewidth=0.15, alpha=0.6, label="whole run")
        panel.plot(
            *select.smooth(t, xyz[:, :2], first).T, color=COLOURS[0], lw=0.5, label="passage"
        )
        panel.plot(
            *select.smooth(t, xyz[:, :2], last).T, color=COLOURS[1], lw=0.8, label="last turns"
        )
        panel.plot(*xyz[0, :2], "o", color="black", markersize=6, label="start")
        panel.plot(
            *xyz[-1, :2], "X", color="black", markersize=8, markerfacecolor="white", label="end"
        )
        panel.set_aspect("equal", adjustable="datalim")
        label(panel, "x, mm", "y, mm", f"{centre.capitalize()} centre of {name}")
    handles, names = axes[0, 0].get_legend_handles_labels()
    told = legend_below(axes, ax, 5, handles, names)
    for line in told.get_lines():
        line.set_linewidth(max(1.0, line.get_linewidth()))
    return axes[0]


def distances(
    response: Response, stations: str | Sequence[str] | None = None, ax: Given | None = None
) -> np.ndarray:
    """Distance of the geometric and the mass centre from the axis of rest over speed, in whichever sense: a
    rotor that centres itself has its mass centre come closer than its eccentricity. A panel for each of the
    `stations`, by default the rotors that can sway; each over its own speeds where gears make them differ."""
    stations = select.named(stations, select.swaying(response.machine), "stations")
    speeds = {name: np.abs(np.asarray(response[name].speed)) for name in stations}
    tops = [float(np.nanmax(speed)) for speed in speeds.values()]
    alike = max(tops) <= 1.05 * min(tops)
    _, axes = figure(len(stations), 1, (9, 3.6 * len(stations)), ax, sharex=alike)
    for panel, name in zip(axes[:, 0], stations):
        part, speed = response[name], speeds[name]
        rest = _resting(response, name)
        for colour, words, xy in (
            (COLOURS[0], "geometric centre", np.asarray(part.position[:, :2])),
            (COLOURS[1], "mass centre", np.asarray(part.mass_centre[:, :2])),
        ):
            r = 1e3 * np.hypot(*(xy - rest).T)
            # a line in time, no band over bins of speed: where r is steep those would show ripple
            panel.plot(speed, r, color=colour, linewidth=0.6, alpha=0.8, label=words)
        unbalance = getattr(response.machine[name], "unbalance", None)
        if unbalance is not None:
            e = 1e3 * float(np.asarray(unbalance.eccentricity))
            panel.axhline(
                e, color=GREY, linestyle="--", linewidth=0.9, label=f"eccentricity {e:g} mm"
            )
        panel.set_ylim(bottom=0)
        label(panel, "", "distance, mm", f"{name}: distance from its position at rest")
        legend(panel, loc="upper left")
        if not alike:
            panel.set_xlabel(f"speed of {name}, rad/s")
    axes[-1, 0].set_xlabel("speed, rad/s" if alike else f"speed of {stations[-1]}, rad/s")
    return axes[:, 0]


def _resting(response: Response, name: str) -> np.ndarray:
    """x and y under weight alone; the run's mean where there is no such rest."""
    from ..core.errors import JaxrotorError
    from ..simulation.equilibrium import static_equilibrium

    try:
        state = static_equilibrium(response.machine)
        return np.asarray(state.position)[response.machine.wiring.stations.index(name), :2]
    except JaxrotorError:
        return np.asarray(response[name].position[:, :2]).mean(0)
