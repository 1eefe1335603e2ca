"""The linear machine over speed: Campbell diagram and stability."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation

from ..linear.campbell import Campbell
from ..linear.modes import Mode, word_of
from .style import COLOURS, GREY, Given, asked_panels, figure, label, legend

RPM = 30 / np.pi
HERTZ = 1 / (2 * np.pi)

# Colour, line and marker of each kind of mode: any one of the three tells them apart.
_LOOK = {
    "forward": (COLOURS[0], "-", "^"),
    "backward": (COLOURS[1], "--", "v"),
    "mixed": (GREY, "-", "o"),
    "torsional": (COLOURS[2], "-.", "s"),
    "axial": (COLOURS[3], (0, (1, 1)), "D"),
}
_UNSTABLE = "#FBE3DC"
# Crossings closer than this part of the width share one label.
_CLOSE = 0.04
# No mode's frequency goes further between two speeds, as part of what is shown: another has taken its place.
_JUMP = 0.5
_PREFIXES = ((1.0, 1.0, ""), (1e-3, 1e3, "m"), (1e-6, 1e6, "µ"), (1e-9, 1e9, "n"), (0, 1e12, "p"))


def campbell_diagram(
    campbell: Campbell,
    orders: Sequence[float] = (1.0,),
    critical: Sequence[float | Mode] | Mapping[float, Sequence[float | Mode]] | None = None,
    damping: Literal["ratio", "decrement"] = "ratio",
    ax: Given | None = None,
) -> np.ndarray:
    """Frequencies over speed with the lines of `orders` and their crossings; below, where anything is
    damped, the damping ratio or the log decrement, with what is unstable shaded.

    `critical`: speeds (rad/s), or `critical_modes`, to mark instead of the interpolated crossings: those
    of the first order, or for each order its own. Torsional and axial ones, which unbalance does not
    excite, are small squares. Modes far above all order lines are left out, and a note counts them.
    `ax`: one axes for the frequencies alone, or two.
    """
    rpm = RPM * np.asarray(campbell.speeds)
    hertz = HERTZ * np.asarray(campbell.frequencies)
    classes = _classes(campbell)
    orders = tuple(orders)
    reach = max(orders, default=0.0) * np.abs(rpm).max() / 60
    top = max(2.5 * reach, 1.3 * np.sort(hertz.min(axis=0))[: min(4, hertz.shape[1])].max())
    top = min(top, 1.06 * max(hertz.max(), reach))
    shown = [k for k in range(hertz.shape[1]) if hertz[:, k].min() < top]
    ratio = np.asarray(campbell.damping_ratios)[:, shown]
    rows = min(asked_panels(ax, 1 + bool(np.abs(ratio).max(initial=0.0) > 1e-9)), 2)
    damped = rows == 2
    size = (9.5, 8.5) if damped else (9.5, 6.0)
    grid = {"gridspec_kw": {"height_ratios": (2, 1)}} if damped else {}
    _, axes = figure(rows, 1, size, ax, sharex=True, **grid)
    panel = axes[0, 0]
    for k in shown:
        jumps = np.flatnonzero(np.abs(np.diff(hertz[:, k])) > _JUMP * top) + 1
        for part in np.split(np.arange(rpm.size), jumps):
            _line(panel, rpm[part], hertz[part, k], classes[part, k])
    ends = {k: hertz[-1, k] for k in shown if hertz[-1, k] < 1.05 * top}
    places = _spread(np.array(list(ends.values())), 0.032 * top)
    for (k, y), place in zip(ends.items(), places):
        panel.annotate(
            campbell.names[k],
            (rpm[-1], y),
            xytext=(1.02, place / top),
            textcoords=panel.get_yaxis_transform(),
            va="center",
            fontsize=8,
            color=_LOOK[classes[-1, k]][0],
            arrowprops=dict(arrowstyle="-", color=GREY, linewidth=0.4),
            annotation_clip=False,
        ).set_position((1.02, place))
    for order in orders:
        _order_line(panel, order, rpm, top)
    for order in orders:
        given = critical if isinstance(critical, Mapping) else {orders[0]: critical}
        _mark(panel, order, _meetings(campbell, order, given.get(order)), rpm, top)
    panel.set_ylim(0, top)
    panel.set_xlim(rpm[0], rpm[-1])
    label(panel, "" if damped else "speed, rpm", "frequency, Hz")
    _radians(panel)
    _legend_of(panel, classes[:, shown])
    if len(shown) < hertz.shape[1]:
        left = hertz.shape[1] - len(shown)
        words = f"{left} mode{'s' * (left > 1)} above {top:.4g} Hz {'are' if left > 1 else 'is'} not shown"
        panel.annotate(
            words, (0.99, 0.985), xycoords="axes fraction", ha="right", va="top", fontsize=8
        )
    if damped:
        _damping(axes[1, 0], rpm, campbell, shown, classes, damping)
    return axes[:, 0]


def stability_map(
    campbell: Campbell,
    measure: Literal["growth", "decrement"] = "growth",
    ax: Given | None = None,
) -> Axes:
    """The least stable of the oscillating modes over speed: its largest real part (1/s), or the log
    decrement of the least damped one. What is unstable is shaded, its onset marked."""
    rpm, values = RPM * np.asarray(campbell.speeds), np.asarray(campbell.eigenvalues)
    if measure == "growth":
        amounts, words, worst = np.real(values), "largest real part, 1/s", np.argmax
        unstable = 1.0
    else:
        amounts, words, worst = (
            -2 * np.pi * np.real(values) / np.imag(values),
            "log decrement",
            np.argmin,
        )
        unstable = -1.0
    which = worst(amounts, axis=1)
    least = amounts[np.arange(len(rpm)), which]
    classes = _classes(campbell)
    _, axes = figure(1, 1, (9.0, 5.0), ax)
    panel = axes[0, 0]
    panel.plot(rpm, least, color=GREY, linewidth=1.0, zorder=1)
    for k in dict.fromkeys(which.tolist()):
        colour, _, marker = _LOOK[classes[-1, k]]
        mine = np.where(which == k, least, np.nan)
        panel.plot(rpm, mine, color=colour, marker=marker, markersize=4, label=campbell.names[k])
    low, high = least.min(), least.max()
    room = 0.12 * (max(high, 0.0) - min(low, 0.0)) or 1.0
    panel.set_ylim(min(low, 0.0) - room, max(high, 0.0) + room)
    panel.set_xlim(rpm[0], rpm[-1])
    _shade(panel, unstable)
    size = 1e-9 * np.abs(values).max()
    ill = unstable * least > (size if measure == "growth" else 1e-9)
    for i in np.flatnonzero(ill[1:] != ill[:-1]):
        s = least[i] / (least[i] - least[i + 1])
        at = (1 - s) * rpm[i] + s * rpm[i + 1] if 0 <= s <= 1 else rpm[i + 1]
        panel.axvline(at, color="black", linewidth=0.8, linestyle=":")
        verb = "unstable" if ill[i + 1] else "stable"
        panel.annotate(
            f"{verb} from {at:.4g} rpm",
            (at, 0.03),
            xycoords=panel.get_xaxis_transform(),
            xytext=(4, 0),
            textcoords="offset points",
            fontsize=9,
        )
    label(panel, "speed, rpm", words)
    _radians(panel)
    legend(panel, loc="upper left", bbox_to_anchor=(1.0, 1.0), title="least stable mode")
    return panel


def _classes(campbell: Campbell) -> np.ndarray:
    """(n, m) of the names in _LOOK: what `modes` calls each mode there. At rest, where no whirl has a sense,
    what it is at the nearest speed."""
    speeds = np.asarray(campbell.speeds)
    out = np.empty(campbell.whirl.shape, dtype="<U10")
    turning = np.flatnonzero(np.abs(speeds) > 1e-9 * np.abs(speeds).max())
    nearest = turning[np.argmin(np.abs(speeds[:, None] - speeds[turning][None]), axis=1)]
    for k, kind in enumerate(campbell.kinds):
        if kind != "lateral":
            out[:, k] = kind
            continue
        out[:, k] = [word_of(campbell.whirl[i, k]) for i in nearest]
    return out


def _line(ax: Axes, x: np.ndarray, y: np.ndarray, classes: np.ndarray) -> None:
    """One mode, in the look of what it is at each speed."""
    cuts = np.flatnonzero(classes[1:] != classes[:-1]) + 1
    for first, last in zip([0, *cuts], [*cuts, len(x)]):
        part = slice(first, min(last + 1, len(x)))
        colour, style, marker = _LOOK[classes[first]]
        every = max(1, len(x) // 8)
        ax.plot(
            x[part],
            y[part],
            color=colour,
            linestyle=style,
            linewidth=1.4,
            marker=marker,
            markersize=4,
            markevery=(every // 2, every),
        )


def _legend_of(ax: Axes, classes: np.ndarray) -> None:
    for name, (colour, style, marker) in _LOOK.items():
        if np.any(classes == name):
            ax.plot([], [], color=colour, linestyle=style, marker=marker, markersize=4, label=name)
    ax.legend(
        fontsize=9,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        # above the axis of rad/s, whatever the height of the panel
        bbox_transform=ax.transAxes + ScaledTranslation(0, 0.47, ax.figure.dpi_scale_trans),
        ncols=5,
        frameon=False,
        borderpad=0,
    )


def _order_line(ax: Axes, order: float, rpm: np.ndarray, top: float) -> None:
    ends = np.unique([rpm[0], *([0.0] if rpm[0] < 0 < rpm[-1] else []), rpm[-1]])
    ax.plot(ends, order * np.abs(ends) / 60, color="black", linewidth=0.9)
    # the label stands on the line where it leaves the frame, or at four fifths of it
    far = rpm[np.argmax(np.abs(rpm))]
    at = np.sign(far) * min(0.86 * abs(far), 0.93 * top * 60 / order)
    ax.annotate(
        f"{order:g}×",
        (at, order * abs(at) / 60),
        xytext=(-3, 3),
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=9,
        fontweight="bold",
    )


def _meetings(
    campbell: Campbell, order: float, given: Sequence[float | Mode] | None
) -> list[tuple[float, bool]]:
    """Speeds, rad/s, at which an order meets modes, and whether they are lateral ones."""
    if given is None:
        kinds = dict(zip(campbell.names, campbell.kinds))
        found = campbell.crossings(order)
        return [(w, kinds[name] == "lateral") for name, each in found.items() for w in each]
    return [
        (x.frequency / order, x.kind == "lateral") if isinstance(x, Mode) else (float(x), True)
        for x in given
    ]


def _mark(
    ax: Axes, order: float, meetings: list[tuple[float, bool]], rpm: np.ndarray, top: float
) -> None:
    """Crossings, as circles or squares with their speeds; those too close for two labels share one."""
    met = sorted((RPM * w, lateral) for w, lateral in meetings)
    met = [m for m in met if rpm[0] <= m[0] <= rpm[-1] and order * abs(m[0]) / 60 < top]
    at = np.array([x for x, _ in met])
    for marker, size, chosen in (("o", 6, True), ("s", 4, False)):
        mine = np.array([x for x, lateral in met if lateral == chosen])
        look: dict[str, Any] = dict(markerfacecolor="white", markeredgecolor="black", zorder=5)
        if mine.size or chosen:
            ax.plot(mine, order * abs(mine) / 60, marker, markersize=size, **look)
    groups: list[list[float]] = []
    for x in at:
        if groups and x - groups[-1][-1] < _CLOSE * (rpm[-1] - rpm[0]):
            groups[-1].append(float(x))
        else:
            groups.append([float(x)])
    for group in groups:
        x, y = group[-1], order * abs(group[-1]) / 60
        right = x > 0.85 * rpm[-1]
        ax.annotate(
            ", ".join(dict.fromkeys(f"{v:.4g}" for v in group)) + " rpm",
            (group[0] if right else x, y),
            xytext=(-8, 6) if right else (8, -3),
            textcoords="offset points",
            ha="right" if right else "left",
            va="bottom" if right else "top",
            fontsize=8,
            zorder=6,
            bbox=dict(boxstyle="square,pad=0.1", facecolor="white", edgecolor="none", alpha=0.75),
        )


def _damping(ax: Axes, rpm, campbell: Campbell, shown, classes, measure: str) -> None:
    values = np.asarray(campbell.eigenvalues)
    if measure == "ratio":
        amounts, words = 100 * np.asarray(campbell.damping_ratios), "damping ratio, %"
        knee = 1.0
    else:
        amounts, words = -2 * np.pi * np.real(values) / np.imag(values), "log decrement"
        knee = 0.1
    for k in shown:
        _line(ax, rpm, amounts[:, k], classes[:, k])
    mine = amounts[:, shown]
    if mine.max() > 20 * knee:  # what is near zero counts most, and must not vanish beside the rest
        ax.set_yscale("symlog", linthresh=knee)
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, 0.0), high)
    _shade(ax, -1.0)
    label(ax, "speed, rpm", words)


def _shade(ax: Axes, unstable: float) -> None:
    """Shades what lies on the unstable side of zero."""
    low, high = ax.get_ylim()
    ax.axhline(0.0, color="black", linewidth=0.8)
    if (high if unstable > 0 else -low) > 0:
        ax.axhspan(*((0, high) if unstable > 0 else (low, 0)), color=_UNSTABLE, zorder=0)
        y = 0.97 if unstable > 0 else 0.03
        va = "top" if unstable > 0 else "bottom"
        ax.annotate(
            "unstable", (0.01, y), xycoords="axes fraction", va=va, fontsize=9, color=COLOURS[1]
        )
    ax.set_ylim(low, high)


def _radians(ax: Axes) -> None:
    """The speed in rad/s along the top."""
    second = ax.secondary_xaxis("top", functions=(_per_second, _per_minute))
    second.set_xlabel("speed, rad/s", fontsize=9)
    second.tick_params(labelsize=8)


def _per_second(rpm: Any) -> Any:
    return rpm / RPM


def _per_minute(speed: Any) -> Any:
    return speed * RPM


def _spread(values: np.ndarray, gap: float) -> np.ndarray:
    """Places for labels near `values`, `gap` apart at least."""
    order = np.argsort(values)
    out = values[order].astype(float)
    for _ in range(200):
        short = gap - np.diff(out)
        if not np.any(short > 1e-9 * gap):
            break
        push = np.where(short > 0, short / 2, 0.0)
        out[:-1] -= push
        out[1:] += push
    placed = np.empty_like(out)
    placed[order] = out
    return placed
