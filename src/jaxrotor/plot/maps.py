"""Maps for design: critical speeds over support stiffness, torsional frequencies against excitation."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import StrMethodFormatter

from ..linear.supports import CriticalSpeedMap
from ..linear.torsion import Interference, TorsionalMode
from .linear import HERTZ, RPM, _radians
from .style import COLOURS, GREY, Given, figure, label, legend

_STYLES = ("-", "--", "-.", (0, (5, 1, 1, 1, 1, 1)))


def support_map(
    found: CriticalSpeedMap,
    speeds: tuple[float, float] | None = None,
    ax: Given | None = None,
) -> Axes:
    """Undamped forward critical speeds over the stiffness of the supports, with the stiffness that the
    supports have: a critical speed lies where the two meet. `speeds`: rad/s, shades a range of operation."""
    _, axes = figure(1, 1, (9.5, 6.0), ax)
    panel = axes[0, 0]
    for k in range(found.speeds.shape[1]):
        style = _STYLES[k % len(_STYLES)]
        colour = COLOURS[k % len(COLOURS)]
        name = f"{k + 1}. forward"
        panel.loglog(
            found.stiffness, RPM * found.speeds[:, k], linestyle=style, color=colour, label=name
        )
    low, high = panel.get_ylim()
    stiff = found.stiffness.min(), found.stiffness.max()
    drawn: set[tuple[float, ...]] = set()
    for own, kx, ky in found.actual.values():
        key = (*kx, *ky, *own)
        if key in drawn:  # supports alike share a line
            continue
        drawn.add(key)
        alike = [n for n, v in found.actual.items() if (*v[1], *v[2], *v[0]) == key]
        for values, direction, style in ((kx, "x", ":"), (ky, "y", (0, (1, 2)))):
            if direction == "y" and np.array_equal(kx, ky):
                continue
            both = "x and y" if np.array_equal(kx, ky) else direction
            words = f"{', '.join(alike)}: {both}"
            if own.size == 1:
                if stiff[0] <= values[0] <= stiff[1]:
                    panel.axvline(
                        values[0], color="black", linestyle=style, linewidth=1.2, label=words
                    )
            else:
                panel.plot(
                    values, RPM * own, color="black", linestyle=style, linewidth=1.2, label=words
                )
    panel.set_xlim(stiff)
    panel.set_ylim(low, high)
    if speeds is not None:
        panel.axhspan(
            RPM * speeds[0], RPM * speeds[1], color=GREY, alpha=0.2, label="speeds of operation"
        )
    panel.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    label(panel, "stiffness of each support, N/m", "undamped critical speed, rpm")
    legend(panel, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return panel


def interference_diagram(
    modes: Sequence[TorsionalMode],
    met: Sequence[Interference],
    speeds: tuple[float, float],
    margin: float = 0.1,
    ax: Given | None = None,
) -> Axes:
    """Torsional frequencies, the lines of the orders, and where they meet; the range of `speeds` (rad/s) is
    shaded, with `margin` (a part of its ends) to either side. What meets there is marked."""
    low, high = speeds
    _, axes = figure(1, 1, (9.5, 6.0), ax)
    panel = axes[0, 0]
    orders = sorted({m.order for m in met})
    right = 1.35 * high
    top = 1.15 * HERTZ * max([m.frequency for m in modes] or [right])
    top = min(top, 1.1 * HERTZ * max(orders, default=1.0) * right)
    panel.axvspan(RPM * low, RPM * high, color=GREY, alpha=0.2, label="speeds of operation")
    for edge, other in ((low, low * (1 - margin)), (high, high * (1 + margin))):
        panel.axvspan(*sorted((RPM * edge, RPM * other)), color=GREY, alpha=0.1)
    for k, mode in enumerate(modes):
        y = HERTZ * mode.frequency
        if y > top:
            continue
        panel.axhline(y, color=COLOURS[k % len(COLOURS)], linewidth=1.4)
        panel.annotate(
            f"{mode.name}, {y:.4g} Hz",
            (1.01, y),
            xycoords=panel.get_yaxis_transform(),
            va="center",
            fontsize=9,
            color=COLOURS[k % len(COLOURS)],
        )
    for order in orders:
        panel.plot([0, RPM * right], [0, order * HERTZ * right], color="black", linewidth=0.8)
        at = min(0.97 * right, 0.96 * top / (order * HERTZ))
        panel.annotate(
            f"{order:g}×",
            (RPM * at, order * HERTZ * at),
            xytext=(-3, 3),
            textcoords="offset points",
            ha="right",
            fontsize=9,
            fontweight="bold",
        )
    for near, marker, words in (
        (True, "X", f"within {100 * margin:g} % of operation"),
        (False, "o", "clear"),
    ):
        chosen = [m for m in met if (m.separation <= margin) == near and m.speed <= right]
        chosen = [m for m in chosen if m.order * HERTZ * m.speed <= top]
        if chosen:
            panel.plot(
                [RPM * m.speed for m in chosen],
                [m.order * HERTZ * m.speed for m in chosen],
                marker,
                color="#C0392B" if near else "white",
                markeredgecolor="black",
                markersize=9 if near else 6,
                linestyle="none",
                label=words,
                zorder=5,
            )
    panel.set_xlim(0, RPM * right)
    panel.set_ylim(0, top)
    label(panel, "speed, rpm", "frequency, Hz")
    _radians(panel)
    legend(panel, loc="upper left")
    return panel
