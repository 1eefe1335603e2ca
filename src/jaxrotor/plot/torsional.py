"""Torsional analysis as it is reviewed: what may excite which mode where, shapes, torques over speed."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import blended_transform_factory

from ..linear.torsion import TorsionalMode, torsional_modes
from ..machine.machine import Machine
from ..standards.torsional import (
    TorsionalExcitation,
    excitation_bands,
    speed_range,
    torsional_excitations,
)
from .linear import HERTZ, RPM, _spread
from .style import COLOURS, GREY, Given, figure, label, legend

_BAND, _MET = "#F3C9BE", "#C0392B"
_STYLES = ("-", "--", "-.", (0, (1, 1)), (0, (5, 1, 1, 1, 1, 1)))
_MOST_LINES = 6
# Of the highest speed of operation, up to where speeds are drawn.
_BEYOND = 1.35
# Of the next lower one: excitations from there on are left out, as teeth are.
_FAR = 5.0
# Of the height, between labels.
_ROW = 0.035


def torsional_interference(
    machine: Machine,
    speeds: tuple[float, float],
    excitations: Sequence[TorsionalExcitation] | None = None,
    line_frequency: float | None = None,
    margin: float = 0.1,
    count: int | None = None,
    at: Any = "undeformed",
    ax: Given | None = None,
) -> Axes:
    """Torsional natural frequencies across the lines of what excites them, over the speed of the driven
    shaft: each shaft's orders at its own speed, the line's frequency, the teeth. Between the speeds of
    operation the bands of `margin` to either side of each line are forbidden: a mode that crosses one there
    does not keep its separation. Meetings are marked, those in a band by crosses. Arguments as for
    `jr.standards.torsional_separation`, whose `InputError`s it raises."""
    low, high = speed_range(speeds)
    if excitations is None:
        excitations = torsional_excitations(machine, line_frequency)
    bands = np.asarray(excitation_bands(machine, excitations, (low, high)))
    modes = torsional_modes(machine, 0.5 * (low + high), count, at)
    right = _BEYOND * high
    top = _height([HERTZ * m.frequency for m in modes], HERTZ * bands[:, 1])
    _, axes = figure(1, 1, (11.0, 7.0), ax)
    panel = axes[0, 0]
    across = np.array([0.0, right])
    _operation(panel, (low, high))
    names: list[tuple[float, str, str]] = []
    hidden, drawn = [], []
    for k, (one, (least, most)) in enumerate(zip(excitations, HERTZ * bands)):
        fixed = one.frequency > 0
        line = np.full(2, most) if fixed else most * across / high
        inside = np.array([low, high]) if high > low else high * np.array([0.985, 1.015])
        own = np.array([least, most]) if high > low else np.array([most, most])
        panel.fill_between(
            RPM * inside,
            (1 - margin) * own,
            (1 + margin) * own,
            color=_BAND,
            alpha=0.75,
            linewidth=0,
            zorder=1,
            label=f"forbidden, ±{100 * margin:g} %" if k == 0 else None,
        )
        if min(line[0] if fixed else least, most) > top:
            hidden.append(f"{one.name} ({most:.4g} Hz)")
            continue
        drawn.append((one, HERTZ**-1 * np.array([least, most])))
        panel.plot(
            RPM * across, line, color="black", linewidth=0.9, linestyle=_STYLES[k % len(_STYLES)]
        )
        if line[1] <= top:
            names.append((float(line[1]), one.name, "black"))
        else:
            x = right * top / line[1]
            panel.annotate(
                one.name,
                (RPM * x, top),
                xytext=(0, 3),
                textcoords="offset points",
                rotation=40,
                ha="left",
                va="bottom",
                fontsize=8,
                annotation_clip=False,
            )
    shown = [m for m in modes if HERTZ * m.frequency <= top]
    for k, mode in enumerate(shown):
        panel.axhline(HERTZ * mode.frequency, color=COLOURS[k % 6], linewidth=1.5, zorder=3)
        y = HERTZ * mode.frequency
        names.append((y, f"{mode.name}, {y:.4g} Hz", COLOURS[k % 6]))
    _meetings(panel, shown, drawn, (low, high), margin, right)
    _right_labels(panel, names, top)
    notes = [f"not shown: {', '.join(hidden)}"] if hidden else []
    for mode in modes[len(shown) :]:
        y = HERTZ * mode.frequency
        close = [
            one.name
            for one, (a, b) in zip(excitations, HERTZ * bands)
            if (1 - margin) * a < y < (1 + margin) * b
        ]
        words = f"{mode.name} ({y:.4g} Hz)" + f" NOT clear of {', '.join(close)}" * bool(close)
        notes.append(words if notes else f"not shown: {words}")
    if notes:
        panel.annotate(", ".join(notes), (0.0, 1.01), xycoords="axes fraction", fontsize=8)
    panel.set_xlim(0, RPM * right)
    panel.set_ylim(0, top)
    label(panel, "speed of the driven shaft, rpm", "frequency, Hz")
    legend(panel, loc="upper left", bbox_to_anchor=(0.0, -0.1), ncols=4)
    return panel


def _operation(panel: Axes, speeds: tuple[float, float]) -> None:
    low, high = speeds
    look: dict[str, Any] = dict(color=GREY, label="speeds of operation", zorder=0)
    if high > low:
        panel.axvspan(RPM * low, RPM * high, alpha=0.15, **look)
    else:
        panel.axvline(RPM * high, linewidth=5, alpha=0.3, **look)


def _height(modes: list[float], tops: np.ndarray) -> float:
    """So high that what excites is in it but for what stands far above the rest, as teeth do."""
    lines = np.sort(tops)
    far = np.flatnonzero(lines[1:] > _FAR * lines[:-1])
    reach = float(lines[far[0] if far.size else -1]) if lines.size else 0.0
    within = [f for f in modes if f <= 1.5 * reach]
    return 1.15 * max([*within, *modes[:1], reach, 1e-9])


def _meetings(panel: Axes, modes, drawn, speeds, margin: float, right: float) -> None:
    low, high = speeds
    met: dict[bool, list[tuple[float, float]]] = {True: [], False: []}
    for mode in modes:
        w = mode.frequency
        for one, (least, most) in drawn:
            fails = (1 - margin) * least < w < (1 + margin) * most
            if one.frequency > 0:
                at = [0.5 * (low + high)] if fails else []
            else:
                at = [high * w / most]
            met[bool(fails)] += [(x, w) for x in at if x <= right]
    for fails, words in ((True, f"separation below {100 * margin:g} %"), (False, "clear")):
        if met[fails]:
            x, y = np.array(met[fails]).T
            panel.plot(
                RPM * x,
                HERTZ * y,
                "X" if fails else "o",
                color=_MET if fails else "white",
                markeredgecolor="black",
                markersize=10 if fails else 6,
                linestyle="none",
                label=words,
                zorder=5,
            )


def _right_labels(panel: Axes, names: list[tuple[float, str, str]], top: float) -> None:
    """Names of lines at the right edge, in their colours, apart from each other."""
    if not names:
        return
    heights = np.array([y for y, _, _ in names])
    places = _spread(heights, _ROW * top)
    over = blended_transform_factory(panel.transAxes, panel.transData)
    for (y, name, colour), place in zip(names, places):
        panel.annotate(
            name,
            (1.0, y),
            xycoords=over,
            xytext=(1.025, place),
            textcoords=over,
            va="center",
            fontsize=8.5,
            color=colour,
            arrowprops=dict(arrowstyle="-", color=GREY, linewidth=0.5),
            annotation_clip=False,
        )


def torsional_shapes(modes: Sequence[TorsionalMode], ax: Given | None = None) -> np.ndarray:
    """Each mode: the angles of the stations (the largest 1 rad, lines between stations in their order), and
    beside it the torque in every part. One row of two panels a mode."""
    _, axes = figure(len(modes), 2, (11.0, 1.0 + 2.1 * len(modes)), ax)
    for k, mode in enumerate(modes):
        left, right = axes[k]
        stations, parts = list(mode.angles), list(mode.torques)
        left.axhline(0.0, color="black", linewidth=0.6)
        angles = [mode.angles[s].real for s in stations]
        left.plot(range(len(stations)), angles, "o-", color=COLOURS[k % 6], markersize=5)
        left.set_xticks(range(len(stations)), stations, rotation=30, ha="right", fontsize=8)
        label(left, "", "angle, rad", f"{mode.name}, {HERTZ * mode.frequency:.4g} Hz")
        right.axhline(0.0, color="black", linewidth=0.6)
        torques = np.array([mode.torques[p].real for p in parts])
        scale, unit = _scale(torques)
        torques = scale * torques
        right.bar(range(len(parts)), torques, color=COLOURS[k % 6], width=0.6)
        right.set_xticks(range(len(parts)), parts, rotation=30, ha="right", fontsize=8)
        label(right, "", f"torque, {unit}", "torque in each part, at an angle of 1 rad")
    return axes


def _scale(torques: np.ndarray) -> tuple[float, str]:
    """What to draw them by, and the unit then."""
    largest = float(np.abs(torques[np.isfinite(torques)]).max(initial=0.0))
    for least, factor, unit in ((1e6, 1e-6, "MN·m"), (1e3, 1e-3, "kN·m")):
        if largest >= least:
            return factor, unit
    return 1.0, "N·m"


def torque_over_speed(
    speeds: np.ndarray,
    torques: Mapping[str, Mapping[str, np.ndarray]],
    operation: tuple[float, float],
    limits: Mapping[str, float] | None = None,
    units: Mapping[str, str] | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Forced torsional response: amplitudes in each part (a panel) by each excitation (a line), over the
    speed of the driven shaft.

    `speeds`: (n,), rad/s. `torques`: part -> excitation -> (n,); the six that count most are drawn.
    `limits`: part -> an amplitude that is drawn across. `units`: part -> "N*m" (the default) or "Pa", which
    is drawn in MPa. `operation`: rad/s, shaded.
    """
    _, axes = figure(len(torques), 1, (10.0, 1.2 + 2.6 * len(torques)), ax, sharex=True)
    largest = _largest(torques)
    for panel, (part, lines) in zip(axes[:, 0], torques.items()):
        stress = (units or {}).get(part) == "Pa"
        factor = 1e-6 if stress else 1.0
        _operation(panel, operation)
        kept = {name: values for name, values in lines.items() if name in largest}
        for name, values in kept.items():
            panel.semilogy(
                RPM * speeds,
                factor * values,
                color=COLOURS[largest.index(name)],
                linewidth=1.1,
                label=name,
            )
        if limits and part in limits:
            panel.axhline(
                factor * limits[part], color=_MET, linestyle="--", linewidth=1, label="allowed"
            )
        if len(kept) < len(lines):
            panel.plot([], [], " ", label=f"({len(lines) - len(kept)} smaller ones)")
        words = "shear stress, MPa" if stress else "torque, N·m"
        label(panel, "", words, f"{part}, amplitudes")
        legend(panel, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes[-1, 0].set_xlabel("speed of the driven shaft, rpm")
    return axes[:, 0]


def _largest(torques: Mapping[str, Mapping[str, np.ndarray]]) -> list[str]:
    """The excitations that count most, by their share of the highest peak of any part."""
    shares: dict[str, float] = {}
    for lines in torques.values():
        peaks = {name: float(np.max(values)) for name, values in lines.items()}
        highest = max(peaks.values(), default=0.0) or 1.0
        for name, peak in peaks.items():
            share = peak / highest if np.isfinite(highest) else float(np.isinf(peak))
            shares[name] = max(shares.get(name, 0.0), share)
    return sorted(shares, key=lambda name: -shares[name])[:_MOST_LINES]


def start_transient(
    t: np.ndarray,
    torques: Mapping[str, np.ndarray],
    speed: np.ndarray,
    passages: Mapping[str, float] | None = None,
    station: str = "",
    ax: Given | None = None,
) -> np.ndarray:
    """Torque in each part over a run, and below it the speed of `station` with the speeds (`passages`: name
    -> rad/s) at which an excitation meets a mode; the instants at which each is passed are marked in all
    panels. `t`: s; torques: N·m; `speed`: rad/s."""
    rows = len(torques) + 1
    _, axes = figure(rows, 1, (10.0, 1.2 + 2.2 * rows), ax, sharex=True)
    for k, (panel, (name, values)) in enumerate(zip(axes[:, 0], torques.items())):
        scale, unit = _scale(values)
        panel.plot(t, scale * values, color=COLOURS[k % 6], linewidth=0.6)
        peak = int(np.argmax(np.abs(values)))
        panel.plot(t[peak], scale * values[peak], "o", color=COLOURS[k % 6], markersize=5)
        words = f"{name}, {scale * values[peak]:.4g} {unit} at {t[peak]:.4g} s"
        label(panel, "", f"torque, {unit}", words)
    last = axes[-1, 0]
    last.plot(t, RPM * speed, color="black", linewidth=1.0)
    label(last, "time, s", "speed, rpm", f"speed of {station}" if station else "speed")
    low, high = last.get_ylim()
    for name, at in (passages or {}).items():
        above = np.abs(speed) >= at
        times = t[1:][above[1:] != above[:-1]]
        if not times.size:
            continue
        for panel in axes[:, 0]:
            panel.axvline(times[0], color=_MET, linewidth=0.9, linestyle="--")
        last.annotate(
            f"{name}, {RPM * at:.4g} rpm",
            (times[0], RPM * at * np.sign(speed[np.searchsorted(t, times[0])] or 1.0)),
            xytext=(6, -12),
            textcoords="offset points",
            fontsize=8,
            color=_MET,
        )
    last.set_ylim(low, high)
    return axes[:, 0]
