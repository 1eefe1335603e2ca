"""Spin, displacements, tilts over time."""

import numpy as np

from ..simulation.response import Response
from . import select
from .style import COLOURS, GREY, Given, band, figure, label, legend


def spin(response: Response, station: str | None = None, ax: Given | None = None) -> np.ndarray:
    """Angle and speed of a rotor (by default the heaviest) over the run, and its speed beside the drive's in
    the passage through resonance, where it can sway at all: three panels, else two."""
    (station,) = select.named(station, select.rotors(response.machine)[:1], "station")
    t, part = np.asarray(response.t), response[station]
    passes = response.machine.sways(station)
    _, axes = figure(1, 3 if passes else 2, (13, 4), ax)
    a, b = axes[0, :2]
    a.plot(t, np.asarray(part.phi) / (2 * np.pi), color=COLOURS[0])
    label(a, "time, s", "angle phi, turns", f"Angle of {station}")
    speed = np.asarray(part.speed)
    b.plot(t, speed, color=COLOURS[0])
    if not passes:
        label(b, "time, s", "speed, rad/s", "Speed")
        return axes[0]
    c, driver = axes[0, 2], select.drive(response.machine)
    k = select.passage(response, station)
    zoom = select.around(response, k, 0.02 * (t[-1] - t[0]) / 2)
    b.axvspan(t[zoom][0], t[zoom][-1], color=GREY, alpha=0.25, linewidth=0)
    label(b, "time, s", "speed, rad/s", "Speed (grey: the zoom)")
    if driver is not None and driver != station:
        own = np.asarray(response[driver].speed)
        c.plot(t[zoom], own[zoom], color=GREY, linestyle="--", linewidth=1, label=f"drive {driver}")
    c.plot(t[zoom], speed[zoom], color=COLOURS[0], linewidth=1, label=station)
    c.axvline(t[k], color=GREY, linewidth=0.6)
    label(c, "time, s", "speed, rad/s", f"Zoom on the passage, t = {t[k]:.3f} s")
    legend(c, loc="upper left")
    return axes[0]


def vibration(
    response: Response, station: str | None = None, ax: Given | None = None
) -> np.ndarray:
    """Flexural (x, y) and longitudinal (z) vibration of a rotor, by default the heaviest: three panels."""
    (station,) = select.named(station, select.swaying(response.machine)[:1], "station")
    t, part = np.asarray(response.t), response[station]
    _, axes = figure(3, 1, (9, 7.5), ax, sharex=True)
    for i, name in enumerate("xy"):
        values = 1e3 * np.asarray(getattr(part, name))
        band(axes[i, 0], t, values, COLOURS[i], name)
        label(axes[i, 0], "", f"{name}, mm", f"Flexural vibration of {station}, {name}")
    z = np.asarray(part.z)
    scale, unit = (1e3, "mm") if np.abs(z).max() > 1e-5 else (1e9, "nm")
    band(axes[2, 0], t, scale * z, COLOURS[2], "z")
    label(axes[2, 0], "time, s", f"z, {unit}", f"Longitudinal vibration of {station}")
    return axes[:, 0]


def inclinations(
    response: Response, station: str | None = None, ax: Given | None = None
) -> np.ndarray:
    """Tilts psi and theta of a rotor (by default the heaviest), and their accelerations: 2 by 2 panels."""
    (station,) = select.named(station, select.swaying(response.machine)[:1], "station")
    t, part = np.asarray(response.t), response[station]
    position, acceleration = np.asarray(part.position), np.asarray(part.acceleration)
    _, axes = figure(2, 2, (12, 6.5), ax, sharex=True)
    for i, name in enumerate(("psi", "theta")):
        band(axes[0, i], t, 1e3 * position[:, 3 + i], COLOURS[i], name)
        label(axes[0, i], "", f"{name}, mrad", f"Inclination {name} of {station}")
        band(axes[1, i], t, acceleration[:, 3 + i], COLOURS[i], name)
        label(axes[1, i], "time, s", f"{name}'', rad/s²", "Its acceleration")
    return axes
