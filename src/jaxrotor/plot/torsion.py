"""Torsional vibration: what the rotors do that the drive does not."""

import numpy as np
from matplotlib.figure import Figure

from ..diagnostics.spectrum import power_spectral_density
from ..simulation.response import Response
from . import select
from .style import COLOURS, GREY, band, figure, label, legend

# Drawn in place of nothing: a balanced line has no vibration, and a logarithm wants a number.
_FLOOR = 1e-30


def differences(response: Response, stations: list[str], driver: str) -> Figure:
    """Speed and acceleration of rotors less the drive's, over the run and in the passage."""
    t = np.asarray(response.t)
    zoom = select.around(response, select.passage(response, stations[0]), 0.2)
    own = response[driver]
    w, a = np.asarray(own.speed), np.asarray(own.acceleration[:, 5])
    fig, axes = figure(2, 2, (13, 7))
    for i, name in enumerate(stations):
        part = response[name]
        speed = np.asarray(part.speed) - w
        acceleration = np.asarray(part.acceleration[:, 5]) - a
        for row, values in enumerate((speed, acceleration)):
            band(axes[row, 0], t, values, COLOURS[i], f"`{name}`")
            axes[row, 1].plot(
                t[zoom], values[zoom], color=COLOURS[i], linewidth=0.8, label=f"`{name}`"
            )
    units = ("speed difference, rad/s", "acceleration difference, rad/s²")
    for row, words in enumerate(units):
        for column, title in enumerate(("whole run", "passage")):
            label(axes[row, column], "time, s", words, f"Rotor less drive `{driver}`, {title}")
            axes[row, column].axhline(0, color=GREY, linewidth=0.6)
    legend(axes[0, 0], loc="upper right")
    return fig


def spectrum(response: Response, stations: list[str], driver: str) -> Figure:
    """Power spectral density of the speed difference, whole run and last third, with the lines at once
    and twice per turn of the final speed."""
    t = np.asarray(response.t)
    rate = 1.0 / (t[1] - t[0])
    w = np.asarray(response[driver].speed)
    last = slice(2 * len(t) // 3, None)
    fig, axes = figure(1, 2, (13, 4.8), sharey=True)
    for ax, part, title in (
        (axes[0, 0], slice(None), "whole run"),
        (axes[0, 1], last, "last third"),
    ):
        for i, name in enumerate(stations):
            difference = np.asarray(response[name].speed) - w
            f, density = power_spectral_density(difference[part], rate)
            ax.semilogy(
                f[1:],
                np.maximum(density[1:], _FLOOR),
                color=COLOURS[i],
                linewidth=0.9,
                label=f"`{name}`",
            )
        for order in (1, 2):
            at = order * abs(w[-1]) / (2 * np.pi)
            if at < rate / 2:
                ax.axvline(at, color=GREY, linestyle=":", linewidth=1)
                ax.annotate(
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
        label(ax, "frequency, Hz", "(rad/s)²/Hz", f"PSD of the speed difference, {title}")
    low, high = axes[0, 0].get_ylim()
    axes[0, 0].set_ylim(max(low, high * 1e-14), high)
    legend(axes[0, 0], loc="upper right")
    return fig


def torques(response: Response, connectors: list[str], driver: str | None) -> Figure:
    """Torques in the shafts, and torque and power of the drive."""
    t = np.asarray(response.t)
    fig, axes = figure(3 if driver else 1, 1, (9, 8 if driver else 4), sharex=True)
    for i, name in enumerate(connectors):
        values = np.asarray(response[name].torque)
        axes[0, 0].plot(t, values, color=COLOURS[i % 7], linewidth=0.5, label=f"`{name}`")
    label(axes[0, 0], "", "torque, N·m", "Twisting moment in the shafts")
    legend(axes[0, 0], loc="upper right", ncols=2)
    if driver:
        part = response[driver]
        axes[1, 0].plot(t, np.asarray(part.reaction[:, 5]), color=COLOURS[0], linewidth=0.5)
        label(axes[1, 0], "", "torque, N·m", f"Torque of the drive `{driver}`")
        axes[2, 0].plot(t, np.asarray(part.power), color=COLOURS[1], linewidth=0.5)
        label(axes[2, 0], "time, s", "power, W", "Its power")
    else:
        axes[0, 0].set_xlabel("time, s")
    return fig
