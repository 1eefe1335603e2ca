"""What a reviewer looks at: margins of a response, stability against cross coupling, where unbalance goes."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from ..core.errors import InputError
from ..standards.amplification import Resonances
from ..standards.separation import SeparationCheck, required_margins
from ..standards.stability import StabilityChart
from ..standards.unbalance_cases import UnbalanceCase
from .linear import RPM
from .style import COLOURS, GREY, Given, figure, label, legend

_POINTS = 401
_BAD, _GOOD = "#C0392B", "#2E7D32"


def response_margins(check: SeparationCheck, ax: Given | None = None) -> np.ndarray:
    """The response of each probe over speed, the running speeds shaded, and at each resonance its
    amplification factor and the margin that it has to keep (hatched, to the side of the running speeds): red
    where it does not. A panel for each probe."""
    rows = len(check.resonances)
    _, axes = figure(rows, 1, (9.5, 1.2 + 3.4 * rows), ax)
    low, high = float(check.least) * RPM, float(check.greatest) * RPM
    for panel, one in zip(axes[:, 0], check.resonances):
        amplitudes = _response(panel, one)
        panel.axvspan(low, high, color=COLOURS[5], alpha=0.25, zorder=0, linewidth=0)
        top = 1.32 * amplitudes.max()
        panel.set_ylim(0, top)
        for k, factor in enumerate(np.asarray(one.factors)):
            speed = float(one.speeds[k]) * RPM
            if np.isnan(speed):
                continue
            height = 2e6 * float(one.amplitudes[k])
            _resonance(panel, speed, height, float(factor), (low, high), top)
        label(panel, "speed, rpm", f"{one.probe}, µm pp")
        handles = [
            Patch(color=COLOURS[5], alpha=0.25, label="running speeds"),
            Patch(facecolor="none", edgecolor=GREY, hatch="////", label="margin to keep"),
        ]
        panel.legend(handles=handles, frameon=False, fontsize=9, loc="upper right")
    return axes[:, 0]


def _resonance(
    panel: Axes, speed: float, height: float, factor: float, running, top: float
) -> None:
    low, high = running
    below, above = np.asarray(required_margins(1e9 if np.isnan(factor) else factor))
    away = max((low - speed) / low, (speed - high) / high)
    is_below = (low - speed) / low > (speed - high) / high
    need = below if is_below else above
    damped = factor < 2.5
    bad = not damped and 100 * away < need
    colour = GREY if damped else _BAD if bad else _GOOD
    panel.plot([speed], [height], "o", color=colour, markersize=6, zorder=5)
    if need > 0:
        # the band that has to be free of running speeds, in their own measure
        edge = speed + need / 100 * low if is_below else speed - need / 100 * high
        a, b = sorted((speed, edge))
        panel.axvspan(
            a, b, facecolor="none", edgecolor=colour, hatch="////", alpha=0.35, linewidth=0.8
        )
    words = "AF unknown" if np.isnan(factor) else f"AF {factor:.3g}"
    words += "\ncritically damped" if damped else f"\nhas {100 * away:.3g} %, needs {need:.3g} %"
    left = speed > 0.75 * panel.get_xlim()[1]
    panel.annotate(
        f"{speed:.5g} rpm, {words}",
        (speed, height),
        xytext=(-8 if left else 8, 8),
        textcoords="offset points",
        ha="right" if left else "left",
        fontsize=8,
        color=colour,
        zorder=6,
        bbox=dict(boxstyle="square,pad=0.1", facecolor="white", edgecolor="none", alpha=0.75),
    )


def _response(panel: Axes, one: Resonances) -> np.ndarray:
    """Draws it; µm peak to peak."""
    peaks = np.asarray(one.speeds)
    near = np.concatenate([np.linspace(*one.span, _POINTS), peaks[np.isfinite(peaks)]])
    speeds = np.unique(near)
    amplitudes = 2e6 * one.response(speeds)
    panel.plot(RPM * speeds, amplitudes, color=COLOURS[0], linewidth=1.4)
    panel.set_xlim(RPM * speeds[0], RPM * speeds[-1])
    return amplitudes


def amplification_widths(found: Resonances, ax: Given | None = None) -> Axes:
    """The response over speed, with each peak's width where it has fallen to the part of it at which the
    amplification factor is taken."""
    _, axes = figure(1, 1, (9.0, 4.8), ax)
    panel = axes[0, 0]
    panel.set_ylim(0, 1.3 * _response(panel, found).max())
    drop = float(found.drop)
    for k, factor in enumerate(np.asarray(found.factors)):
        speed, height = float(found.speeds[k]) * RPM, 2e6 * float(found.amplitudes[k])
        if np.isnan(speed):
            continue
        ends = [RPM * float(x[k]) for x in (found.low, found.high)]
        ends = [speed if np.isnan(x) else x for x in ends]
        panel.plot(ends, [drop * height] * 2, color=COLOURS[1], marker="|", markersize=8)
        panel.plot([speed], [height], "o", color=COLOURS[1], markersize=5)
        text = "no flank" if np.isnan(factor) else f"AF {factor:.3g}"
        panel.annotate(
            f"{speed:.5g} rpm\n{text}",
            (speed, height),
            xytext=(6, 4),
            textcoords="offset points",
            fontsize=9,
        )
    label(panel, "speed, rpm", f"{found.probe}, µm pp")
    return panel


def stability_curve(chart: StabilityChart, ax: Given | None = None) -> Axes:
    """Log decrement over the cross coupling applied, with the anticipated one Q_A and Q_0, which the machine
    bears."""
    _, axes = figure(1, 1, (8.5, 4.8), ax)
    panel = axes[0, 0]
    scale, unit = _stiffness(float(np.max(chart.cross_couplings)))
    x, y = scale * np.asarray(chart.cross_couplings), np.asarray(chart.log_decrements)
    panel.plot(x, y, color=COLOURS[0], linewidth=1.6, label="lowest forward mode")
    panel.axhline(0.0, color="black", linewidth=0.8)
    bounds = [f for f in chart.level_one.findings if "decrement" in f.check]
    if bounds:
        least = float(bounds[0].limit)
        panel.axhline(
            least, color=GREY, linestyle="--", linewidth=1.0, label=f"{least:g} asked at Q$_A$"
        )
    wanted, limit = float(chart.anticipated), float(chart.limit)
    if np.isfinite(wanted):
        there = float(chart.at_anticipated)
        panel.plot([scale * wanted], [there], "o", color=COLOURS[1], markersize=8, zorder=5)
        _note(
            panel,
            scale * wanted,
            there,
            f"Q$_A$ = {scale * wanted:.4g} {unit}\nlog decrement {there:.3g}",
        )
    if np.isfinite(limit) and limit <= float(np.max(chart.cross_couplings)):
        panel.plot([scale * limit], [0.0], "s", color=COLOURS[3], markersize=8, zorder=5)
        ratio = f"\nQ$_0$/Q$_A$ = {limit / wanted:.3g}" if np.isfinite(wanted) and wanted else ""
        _note(panel, scale * limit, 0.0, f"Q$_0$ = {scale * limit:.4g} {unit}{ratio}")
    label(
        panel,
        f"cross coupling applied, {unit}",
        "log decrement",
        f"{RPM * float(chart.speed):.5g} rpm",
    )
    panel.margins(y=0.18)
    panel.set_xlim(0, 1.3 * x.max())
    legend(panel, loc="lower left")
    return panel


def _note(panel: Axes, x: float, y: float, words: str) -> None:
    """Above to the right, where a falling curve leaves room."""
    panel.annotate(
        words, (x, y), xytext=(10, 8), textcoords="offset points", va="bottom", fontsize=9
    )


def _stiffness(largest: float) -> tuple[float, str]:
    for factor, unit in ((1e-6, "MN/m"), (1e-3, "kN/m")):
        if largest * factor >= 1.0:
            return factor, unit
    return 1.0, "N/m"


def screening_chart(chart: StabilityChart, ax: Given | None = None) -> Axes:
    """The critical speed ratio over the mean gas density, with regions A and B. Raises `InputError` for a
    chart made without them."""
    density, ratio = float(chart.density), float(chart.ratio)
    if not (np.isfinite(density) and np.isfinite(ratio)):
        raise InputError(
            "density and ratio were not given to stability_chart: there is nothing to screen"
        )
    _, axes = figure(1, 1, (7.5, 4.8), ax)
    panel = axes[0, 0]
    edges = np.asarray(chart.boundary)
    right = 1.25 * max(density, edges[:, 0].max())
    top = 1.25 * max(ratio, edges[:, 1].max())
    panel.fill(*np.vstack([[0.0, 0.0], edges]).T, color=COLOURS[2], alpha=0.15, linewidth=0)
    panel.plot(*edges.T, color="black", linewidth=1.2)
    # inside the corner of A, and above it
    panel.text(
        0.5 * edges[:, 0].max(), 0.35 * edges[:, 1].max(), "region A", ha="center", color=GREY
    )
    panel.text(0.5 * edges[:, 0].max(), 0.97 * top, "region B", ha="center", va="top", color=GREY)
    panel.plot([density], [ratio], "o", color=COLOURS[1], markersize=8, zorder=5)
    panel.annotate(
        f"{ratio:.3g} at {density:.3g} kg/m³",
        (density, ratio),
        xytext=(8, 6) if density < 0.7 * right else (-8, 6),
        ha="left" if density < 0.7 * right else "right",
        textcoords="offset points",
        fontsize=9,
    )
    panel.set_xlim(0, right)
    panel.set_ylim(0, top)
    label(panel, "mean gas density, kg/m³", "critical speed ratio")
    return panel


def placed_shape(case: UnbalanceCase, ax: Given | None = None) -> Axes:
    """The shape of the mode in the plane in which it is largest, with the bearings and the unbalance placed:
    arrows to the side to which each points."""
    _, axes = figure(1, 1, (8.5, 4.0), ax)
    panel = axes[0, 0]
    order = np.argsort(case.z, kind="stable")
    z, shape = case.z[order], case.shape[order]
    panel.axhline(0.0, color=GREY, linewidth=0.9)
    panel.plot(
        z, shape, color=COLOURS[0], marker=".", markersize=4, linewidth=1.5, label="mode shape"
    )
    look = dict(marker="^", color="black", markerfacecolor="#D8EFE6", markersize=10, linestyle="")
    panel.plot(case.bearings, [-0.05] * 2, label="bearing", **look)  # pyright: ignore[reportArgumentType]
    where = dict(zip(case.stations, case.z))
    for station, amount, angle in zip(
        case.unbalance.stations,
        np.asarray(case.unbalance.amounts),
        np.asarray(case.unbalance.angles),
    ):
        k = case.stations.index(station)
        side = np.sign(np.cos(angle)) or 1.0
        begin = case.shape[k]
        look = dict(arrowstyle="-|>", color=COLOURS[1], linewidth=1.8)
        panel.annotate(
            "", (where[station], begin + 0.45 * side), (where[station], begin), arrowprops=look
        )
        panel.annotate(
            f"{station}: {1e6 * amount:.4g} g·mm",
            (where[station], begin + 0.47 * side),
            ha="center",
            va="bottom" if side > 0 else "top",
            fontsize=9,
            color=COLOURS[1],
        )
    panel.set_ylim(min(-0.35, shape.min() - 0.75), max(0.35, shape.max()) + 0.75)
    panel.margins(x=0.08)
    words = f"{case.name}, critical speed {RPM * case.critical:.5g} rpm"
    label(panel, "z, m", "deflection,\nlargest = 1", words)
    legend(panel, loc="lower right", ncols=2)
    return panel
