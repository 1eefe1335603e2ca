"""What no bearing of pads can be."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...core.arguments import whole
from ...core.errors import InputError
from .gap_faults import wide_gap

# Intervals that a grid may have.
_MOST = 1024
# Overlap of pads, rad, that is rounding.
_TOUCH = 1e-9


def even(value: Any, place: str) -> int:
    """Intervals of a grid."""
    found = whole(4, _MOST)(value, place)
    if found % 2:
        raise InputError(f"{place} must be even, but is {found}")
    return found


def pad_faults(bearing: Any) -> Iterator[str]:
    """Of `FixedPadBearing` and the like, whose parameters are known."""
    yield from wide_gap(bearing.clearance, bearing.diameter, 0.1)
    if not np.any(bearing.load):
        yield "load must not be zero: about it the bearing is linear"
    if len(bearing.speeds) < 2 or not np.all(np.diff(bearing.speeds) > 0):
        yield "speeds must be two at least and increase"
    waves = getattr(bearing, "frequencies", None)
    if waves is not None and (len(waves) < 2 or not np.all(np.diff(waves) > 0)):
        yield "frequencies must be two at least and increase"
    count = len(bearing.pads)
    if not count:
        yield "pads must have an angle for each pad, but is empty"
        return
    for name in ("arc", "preload", "offset"):
        given = np.asarray(getattr(bearing, name))
        if given.ndim and len(given) != count:
            yield (
                f"{name} must be one number or one for each of {count} pads, but has {len(given)}"
            )
            return
    if np.any(np.asarray(bearing.preload) >= 1):
        yield f"preload must be below 1, but is {float(np.max(bearing.preload)):g}"
    if np.any(np.asarray(bearing.offset) > 1):
        yield f"offset must be 0 to 1, but is {float(np.max(bearing.offset)):g}"
    arc = np.broadcast_to(bearing.arc, count)
    middles = np.mod(np.asarray(bearing.middles()), 2 * np.pi)
    order = np.argsort(middles)
    middles, arcs = middles[order], arc[order]
    ends, begins = middles + arcs / 2, middles - arcs / 2
    after = np.append(begins[1:], begins[0] + 2 * np.pi)
    if np.any(ends > after + _TOUCH):
        k = int(np.argmax(ends - after))
        yield (
            f"pads must not overlap, but the one at {np.degrees(middles[k]):.4g} degrees reaches "
            f"{np.degrees(ends[k] - after[k]):.4g} degrees into the next: a smaller arc, or fewer pads"
        )
