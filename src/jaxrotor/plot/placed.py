"""How a rotor hangs in its bearings, and how it whirls under unbalance: figures of a report."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .style import COLOURS, GREY, Given, figure, label


def static_deflection(
    z: Sequence[float], deflections: Any, bearings: Sequence[float] = (), ax: Given | None = None
) -> Axes:
    """Of stations at `z`, m, their `deflections` (n, 2), x and y, m; `bearings`: places of these."""
    _, axes = figure(1, 1, (8.5, 3.6), ax)
    panel = axes[0, 0]
    order = np.argsort(z, kind="stable")
    places, values = np.asarray(z)[order], 1e6 * np.asarray(deflections)[order]
    panel.axhline(0.0, color=GREY, linewidth=0.9)
    for k, name in enumerate("xy"):
        panel.plot(places, values[:, k], color=COLOURS[k], marker=".", linewidth=1.5, label=name)
    for k, place in enumerate(bearings):
        panel.axvline(
            place, color=GREY, linestyle=":", linewidth=1.0, label="bearing" if k == 0 else None
        )
    panel.margins(x=0.05, y=0.15)
    label(panel, "z, m", "deflection, µm")
    panel.legend(frameon=False, fontsize=9, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return panel


def whirl_orbits(orbits: Mapping[str, Any], ax: Given | None = None) -> np.ndarray:
    """Orbits of steady whirl: station -> complex amplitudes of x and y, m. A dot marks where each is when the
    unbalance angle 0 points along x; a panel each, alike in scale."""
    names = list(orbits)
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    _, axes = figure(rows, columns, (3.3 * columns, 0.4 + 3.3 * rows), ax)
    angle = np.linspace(0, 2 * np.pi, 181)
    largest = max(1e6 * np.abs(np.asarray(a)).max() for a in orbits.values()) or 1.0
    for panel, name in zip(axes.ravel(), names):
        x, y = (1e6 * np.real(a * np.exp(1j * angle)) for a in orbits[name])
        panel.plot(x, y, color=COLOURS[0], linewidth=1.4)
        panel.plot(x[:1], y[:1], "o", color=COLOURS[1], markersize=5)
        panel.annotate(
            "", (x[8], y[8]), (x[4], y[4]), arrowprops=dict(arrowstyle="-|>", color=COLOURS[0])
        )
        panel.set_aspect("equal")
        panel.set_xlim(-1.15 * largest, 1.15 * largest)
        panel.set_ylim(-1.15 * largest, 1.15 * largest)
        label(panel, "x, µm", "y, µm", name)
    for panel in axes.ravel()[len(names) :]:
        panel.set_visible(False)
    return axes.ravel()[: len(names)]
