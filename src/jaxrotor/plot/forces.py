"""Forces on the bearings."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..sensors.quantities import force_on_base
from ..simulation.response import Response
from . import select
from .style import COLOURS, Given, band, figure, label, legend


def _on_base(response: Response, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Force (nt, 3), N, and the speed of what it bears (nt,), rad/s."""
    force, wiring = force_on_base(response, name), response.lineup.wiring
    if force is None:
        kind = "station" if name in wiring.stations else "part"
        raise InputError(f"`{name}`: is a {kind} that bears nothing: name a bearing or a support")
    station = name
    if name in wiring.connectors:
        station = wiring.stations[wiring.ends[wiring.connectors.index(name)][0][0]]
    borne: Any = response[station]
    return np.asarray(force), np.asarray(borne.speed)


def bearing_forces(
    response: Response, bearings: str | Sequence[str] | None = None, ax: Given | None = None
) -> np.ndarray:
    """Force of each bearing on its base over time, its size over speed, its path in the passage: a row for
    each of the `bearings` (stations that bear, or supports), by default all. Raises `InputError` where there
    are none, or one is none."""
    bearings = select.named(bearings, select.bearings(response.machine), "bearings")
    t = np.asarray(response.t)
    _, axes = figure(len(bearings), 3, (14, 3.9 * len(bearings)), ax)
    for row, name in zip(axes, bearings):
        force, speed = _on_base(response, name)
        size = np.hypot(force[:, 0], force[:, 1])
        for i, axis in enumerate("xy"):
            band(row[0], t, force[:, i], COLOURS[i], f"F{axis}")
        label(row[0], "time, s", "force, N", f"{name}: force on the base")
        legend(row[0], loc="upper right")
        row[1].plot(np.abs(speed), size, color=COLOURS[2], linewidth=0.5, alpha=0.8)
        row[1].set_ylim(bottom=0)
        label(row[1], "speed, rad/s", "|F|, N", "Its size over speed")
        k = int(np.argmax(size))
        # three turns to either side: more of them make a disc
        turn = 2 * np.pi / max(abs(float(speed[k])), 1e-9)
        near = select.around(response, k, min(0.04 * float(t[-1]), 3 * turn))
        row[2].plot(*select.smooth(t, force[:, :2], near).T, color=COLOURS[3], linewidth=0.4)
        row[2].set_aspect("equal", adjustable="datalim")
        label(row[2], "Fx, N", "Fy, N", f"Its path around its peak, t = {t[k]:.2f} s")
    return axes
