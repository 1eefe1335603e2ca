"""Pictures of branches of periodic motions."""

import numpy as np
from matplotlib.axes import Axes

from ..core.errors import InputError
from ..core.kinematics import COORDINATES
from ..periodic.branch import Branch
from .labels import readable
from .style import COLOURS, Given, figure, label

_RPM = 30 / np.pi
_MARKS = {
    "fold": ("o", "it jumps"),
    "Neimark-Sacker": ("s", "a second frequency sets in"),
    "period doubling": ("D", "it takes twice the turns"),
    "branch point": ("^", "another branch begins"),
    "grazing": ("x", "a contact begins or ends"),
}


def branch_amplitudes(
    branch: Branch,
    place: str | None = None,
    title: str = "Steady vibration",
    ax: Given | None = None,
) -> Axes:
    """Half the distance between the extremes over speed: stable motions drawn through, unstable ones
    dashed, folds and changes of stability marked. `place`: a coordinate such as `"disc.x"`, by default that
    which moves most. Raises `InputError` for a coordinate that the machine does not have."""
    place = _widest(branch) if place is None else place
    if not isinstance(place, str):
        raise InputError(f"`place`: must be a coordinate such as 'disc.x', but is {place!r}")
    unit = "m" if place.rpartition(".")[2] in ("x", "y", "z") else "rad"
    values = branch.amplitude(place)
    size, words = readable(unit, values)
    _, axes = figure(1, 1, (8.6, 5.2), ax)
    panel = axes[0, 0]
    speed, stable = branch.speeds * _RPM, branch.stable
    through = np.where(stable, size * values, np.nan)
    # a dashed stretch begins and ends on its stable neighbours
    beside = ~stable | ~np.append(stable[1:], True) | ~np.append(True, stable[:-1])
    dashed = np.where(beside, size * values, np.nan)
    if not stable.all():
        panel.plot(speed, dashed, "--", color=COLOURS[1], linewidth=1.3, label="unstable")
    if stable.any():
        panel.plot(speed, through, color=COLOURS[0], linewidth=1.6, label="stable")
    told = set()
    for point in branch.special:
        mark, words_of = _MARKS[point.kind]
        name = "" if point.kind in told else f"{point.kind}: {words_of}"
        told.add(point.kind)
        panel.plot(
            point.speed * _RPM,
            size * float(point.motion.amplitude(place)),
            mark,
            color="black",
            markersize=6,
            fillstyle="none",
            linestyle="none",
            label=name or "_",
            zorder=4,
        )
    label(panel, "speed, rpm", f"amplitude of {place}, {words}", title)
    panel.legend(fontsize=8)
    return panel


def _widest(branch: Branch) -> str:
    """Of the distances, else of the angles."""
    waves = np.abs(np.asarray(branch.motions.coefficients)[:, 1:]).sum(axis=1).max(axis=0)
    part = waves[:, :3] if waves[:, :3].any() else waves
    station, coordinate = np.unravel_index(np.argmax(part), part.shape)
    return f"{branch.motions.stations[station]}.{COORDINATES[coordinate]}"
