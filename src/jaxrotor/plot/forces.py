"""Forces on the bearings."""

import numpy as np
from matplotlib.figure import Figure

from ..solve.response import Response
from . import select
from .style import COLOURS, band, envelope, figure, label, legend


def bearing_forces(response: Response, bearings: list[str]) -> Figure:
    """Force of each bearing on its base over time, its size over speed, its path in the passage."""
    t = np.asarray(response.t)
    fig, axes = figure(len(bearings), 3, (14, 3.9 * len(bearings)))
    for row, name in zip(axes, bearings):
        force = np.asarray(response[name].bearing_force)
        size = np.hypot(force[:, 0], force[:, 1])
        for i, axis in enumerate("xy"):
            band(row[0], t, force[:, i], COLOURS[i], f"F{axis}")
        label(row[0], "time, s", "force, N", f"`{name}`: force on the base")
        legend(row[0], loc="upper right")
        speed = np.asarray(response[name].speed)
        order = np.argsort(speed, kind="stable")
        low, high = envelope(size[order], 25)
        row[1].fill_between(speed[order], low, high, color=COLOURS[2], alpha=0.5, linewidth=0)
        row[1].set_ylim(bottom=0)
        label(row[1], "speed, rad/s", "|F|, N", "Its size over speed")
        k = int(np.argmax(size))
        near = select.around(response, k, 0.04 * float(t[-1]))
        row[2].plot(*select.smooth(t, force[:, :2], near).T, color=COLOURS[3], linewidth=0.4)
        row[2].set_aspect("equal", adjustable="datalim")
        label(row[2], "Fx, N", "Fy, N", f"Its path around its peak, t = {t[k]:.2f} s")
    return fig
