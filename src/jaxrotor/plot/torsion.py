"""Torsional vibration: what the rotors do that the drive does not."""

from collections.abc import Sequence

import numpy as np

from ..core.errors import InputError
from ..core.protocol import AbstractConnector
from ..diagnostics.spectrum import power_spectral_density
from ..machine.wiring import unknown
from ..simulation.response import Response
from . import select
from .curves import _draw
from .style import COLOURS, GREY, Given, asked_panels, band, dashes, figure, label, legend

# Drawn in place of nothing: a balanced line has no vibration, and a logarithm wants a number.
_FLOOR = 1e-30
# Shafts of which the torques are drawn, where none is named.
_MOST = 6


def speed_differences(
    response: Response,
    stations: str | Sequence[str] | None = None,
    driver: str | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Speed and acceleration of rotors less the drive's (so many times it as the gears make them turn), over
    the run and in the passage: 2 by 2 panels. By default the three heaviest rotors and the driven end.
    Raises `InputError` where `driver` is no station, or is left out and no end is driven."""
    stations, driver, ratios = _beside_drive(response, stations, driver)
    t = np.asarray(response.t)
    zoom = select.around(response, select.passage(response, stations[0]), 0.2)
    own = response[driver]
    w, a = np.asarray(own.speed), np.asarray(own.acceleration[:, 5])
    _, axes = figure(2, 2, (13, 7), ax)
    for i, name in enumerate(stations):
        part = response[name]
        speed = np.asarray(part.speed) - ratios[name] * w
        acceleration = np.asarray(part.acceleration[:, 5]) - ratios[name] * a
        for row, values in enumerate((speed, acceleration)):
            band(axes[row, 0], t, values, COLOURS[i], name)
            axes[row, 1].plot(t[zoom], values[zoom], color=COLOURS[i], linewidth=0.8, label=name)
    units = ("speed difference, rad/s", "acceleration difference, rad/s²")
    for row, words in enumerate(units):
        for column, title in enumerate(("whole run", "passage")):
            label(axes[row, column], "time, s", words, f"Rotor less drive {driver}, {title}")
            axes[row, column].axhline(0, color=GREY, linewidth=0.6)
    legend(axes[0, 0], loc="upper right")
    return axes


def speed_spectrum(
    response: Response,
    stations: str | Sequence[str] | None = None,
    driver: str | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Power spectral density of the speed less the drive's (as in `speed_differences`), whole run and last
    third, with the lines at once and twice per turn of the final speed: two panels. Raises `InputError`
    where `driver` is no station, or is left out and no end is driven."""
    stations, driver, ratios = _beside_drive(response, stations, driver)
    t = np.asarray(response.t)
    rate = 1.0 / (t[1] - t[0])
    w = np.asarray(response[driver].speed)
    last = slice(2 * len(t) // 3, None)
    _, axes = figure(1, 2, (13, 4.8), ax, sharey=True)
    for panel, part, title in (
        (axes[0, 0], slice(None), "whole run"),
        (axes[0, 1], last, "last third"),
    ):
        for i, name in enumerate(stations):
            difference = np.asarray(response[name].speed) - ratios[name] * w
            f, density = power_spectral_density(difference[part], rate)
            panel.semilogy(
                f[1:],
                np.maximum(density[1:], _FLOOR),
                color=COLOURS[i],
                linewidth=0.9,
                label=name,
            )
        for order in (1, 2):
            at = order * abs(w[-1]) / (2 * np.pi)
            if at < rate / 2:
                panel.axvline(at, color=GREY, linestyle=":", linewidth=1)
                panel.annotate(
                    f"{order}x",
                    (at, 0.97),
                    xycoords=("data", "axes fraction"),
                    fontsize=9,
                    color=GREY,
                    ha="left",
                    va="top",
                    xytext=(3, 0),
                    textcoords="offset points",
                )
        label(panel, "frequency, Hz", "(rad/s)²/Hz", f"PSD of the speed difference, {title}")
    low, high = axes[0, 0].get_ylim()
    axes[0, 0].set_ylim(max(low, high * 1e-14), high)
    legend(axes[0, 0], loc="upper right")
    return axes[0]


def torques(
    response: Response,
    connectors: str | Sequence[str] | None = None,
    driver: str | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Torques in the shafts (by default all that have one, the six that carry most where there are more), and
    torque and power of the drive, where there is one: three panels, else one. `ax`: one axes for the shafts
    alone, or three."""
    every = select.with_signal(response.machine, "torque", AbstractConnector)
    usual = _largest(response, every) if connectors is None else every
    connectors = select.named(connectors, usual, "connectors")
    driver = select.drive(response.machine) if driver is None else driver
    if asked_panels(ax, 3) == 1:
        driver = None
    t = np.asarray(response.t)
    _, axes = figure(3 if driver else 1, 1, (9, 8 if driver else 4), ax, sharex=True)
    for i, name in enumerate(connectors):
        values = np.asarray(response[name].torque)
        colour = COLOURS[i % len(COLOURS)]
        _draw(axes[0, 0], t, values, slice(None), colour, name, dashes(i))
    more = f", the {len(usual)} largest of {len(every)}" if len(connectors) < len(every) else ""
    label(axes[0, 0], "", "torque, N·m", f"Twisting moment in the shafts{more}")
    legend(axes[0, 0], loc="upper left", bbox_to_anchor=(1.0, 1.0))
    if driver:
        part = response[driver]
        torque = np.asarray(part.reaction[:, 5])
        _draw(axes[1, 0], t, torque, slice(None), COLOURS[0], "")
        label(axes[1, 0], "", "torque, N·m", f"Torque of the drive {driver}")
        _draw(axes[2, 0], t, np.asarray(part.power), slice(None), COLOURS[1], "")
        label(axes[2, 0], "time, s", "power, W", "Its power")
    else:
        axes[0, 0].set_xlabel("time, s")
    return axes[:, 0]


def _largest(response: Response, names: list[str]) -> list[str]:
    """As many as can be told apart, of those that carry most, in the machine's order."""
    if len(names) <= _MOST:
        return names
    peak = {n: float(np.nanmax(np.abs(np.asarray(response[n].torque)))) for n in names}
    kept = sorted(names, key=lambda n: -peak[n])[:_MOST]
    return [n for n in names if n in kept]


def _beside_drive(
    response: Response, stations: str | Sequence[str] | None, driver: str | None
) -> tuple[list[str], str, dict[str, float]]:
    """Which stations, beside which drive, and how many times as fast as it each turns."""
    machine = response.machine
    driver = select.drive(machine) if driver is None else driver
    if driver is None:
        raise InputError(
            "driver: no end of this machine is driven: name the station to compare with"
        )
    known = response.lineup.wiring.stations
    if driver not in known:
        raise InputError(f"driver: {unknown('station', driver, known)}")
    return (
        select.named(stations, select.rotors(machine)[:3], "stations"),
        driver,
        select.turns(machine, driver),
    )
