"""What a frequency response holds, as lines for its figures."""

from typing import Any, NamedTuple

import numpy as np

from ..linear.response import FrequencyResponse
from .linear import _PREFIXES, HERTZ, RPM
from .style import COLOURS

_STYLES = ("-", "--", "-.", ":", (0, (6, 1, 1, 1, 1, 1)))
_MARKERS = "osD^vXP"
# Of the outputs: how their unit ends, the words for the amplitude of motions and of all else under
# unbalance, and which phase is a resonance's own (rad).
KINDS = {
    "receptance": ("", "amplitude", "amplitude", -np.pi / 2),
    "mobility": ("/s", "amplitude of the velocity", "amplitude of the rate", 0.0),
    "accelerance": (
        "/s²",
        "amplitude of the acceleration",
        "amplitude of the second derivative",
        np.pi / 2,
    ),
}
_MOTIONS = ("m", "rad")
_PREFIXED = ((1e7, 1e-6, "M"), (1e4, 1e-3, "k"), *_PREFIXES)
# Values smaller than this part of the largest in their unit are not shown, nor their phase.
NOTHING = 1e-7
# Magnitudes that span more than this factor have a logarithmic axis.
_WIDE = 100.0
# A jump of the phase as near to half a turn as this (rad) tells nothing of its sense.
_HALF_TURN = 0.02


class Line(NamedTuple):
    """One output (for one input): `values` (f,) complex by rising frequency, SI, in the unit
    named. `motion`: m or rad, or their rates."""

    name: str
    unit: str
    values: np.ndarray
    motion: bool


def speeds_of(response: FrequencyResponse) -> np.ndarray:
    """Rising: rpm of the response to unbalance, Hz of all other."""
    return (HERTZ if response.inputs else RPM) * np.sort(np.asarray(response.frequencies))


def lines_of(response: FrequencyResponse) -> list[Line]:
    values = np.asarray(response.values)[np.argsort(np.asarray(response.frequencies))]
    rate = KINDS[response.kind][0]
    out = []
    for i, (output, unit) in enumerate(zip(response.outputs, response.units)):
        out_unit = unit.replace("*", "·") + rate
        if not response.inputs:
            out.append(Line(output, out_unit, values[:, i], unit in _MOTIONS))
        for k, source in enumerate(response.inputs):
            per = f"({out_unit})" if rate or "*" in unit else out_unit
            per = f"{per}/{'(N·m)' if _turns(source) else 'N'}"
            out.append(Line(f"{output} per {source}", per, values[:, i, k], unit in _MOTIONS))
    return out


def _turns(place: str) -> bool:
    return place.rpartition(".")[2] in ("psi", "theta", "phi")


def phase(values: np.ndarray, centre: float = -np.pi / 2, least: float = 0.0) -> np.ndarray:
    """rad, without jumps of a turn. A jump of half a turn (an undamped resonance) goes where the phase
    stays nearest to `centre`; nan where the magnitude is not above `least`."""
    out = np.full(values.shape, np.nan)
    now = before = 0.0
    for i in np.flatnonzero(np.abs(values) > least):
        angle = np.angle(values[i])
        step = (angle - before + np.pi) % (2 * np.pi) - np.pi
        if abs(abs(step) - np.pi) < _HALF_TURN:
            step = min(abs(step), abs(step) - 2 * np.pi, key=lambda s: abs(now + s - centre))
        now, before = now + step, angle
        out[i] = now
    return out


def look(k: int, count: int) -> dict[str, Any]:
    """Line and marker tell lines apart where the colour does not."""
    every = max(1, count // 9)
    return dict(
        color=COLOURS[k % len(COLOURS)],
        linestyle=_STYLES[k % len(_STYLES)],
        marker=_MARKERS[k % len(_MARKERS)],
        markersize=4,
        markevery=((2 * k + 1) * every // 4 % every, every),
        linewidth=1.4,
    )


def heading(response: FrequencyResponse) -> str:
    return "Frequency response" if response.inputs else "Response to unbalance"


def words(response: FrequencyResponse, line: Line) -> str:
    """What the magnitude of a line is called."""
    if response.inputs and line.motion:
        return response.kind
    _, motion, other, _ = KINDS[response.kind]
    return motion if line.motion else other


def largest(lines: list[Line]) -> float:
    return max(float(np.abs(line.values).max(initial=0.0)) for line in lines)


def prefixed(lines: list[Line]) -> tuple[float, str]:
    """By what to multiply SI values, and the unit that they are in then."""
    peak, unit = largest(lines), lines[0].unit
    inside = unit.startswith("(")
    if peak == 0 or not unit[inside:][:1].isalpha():
        return 1.0, unit
    _, size, prefix = next((p for p in _PREFIXED if 0 < p[0] <= peak), _PREFIXES[-1])
    return size, f"{'(' * inside}{prefix}{unit[inside:]}"


def magnitude(lines: list[Line], unbalance: bool) -> tuple[float, str, tuple[float, float]]:
    """Factor and unit of an axis, and its limits: the lower is 0 on a linear one."""
    sizes = np.abs(np.concatenate([line.values for line in lines]))
    top = float(sizes.max(initial=0.0))
    sizes = sizes[sizes > NOTHING * top]
    # a peak over the speed is told by its height, unless it dwarfs all else
    usual = np.median(sizes) if unbalance and sizes.size else sizes.min(initial=top)
    size, shown = prefixed(lines)
    if top > _WIDE * usual:
        if not unbalance:
            size, shown = 1.0, lines[0].unit
        return size, shown, (size * float(sizes.min()) / 1.5, 1.5 * size * top)
    return size, shown, (0.0, 1.05 * size * top or 1.0)
