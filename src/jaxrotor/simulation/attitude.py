"""Where 1-2-3 angles end: at theta = ±90 degrees psi and phi turn about one axis."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..core.parameter import numbers
from ..machine.layout import layout_of
from ..machine.lineup import structure_of
from ..machine.machine import Machine

# Nearer than this to a right angle the equations lose digits; rad.
_NEAR = 0.05
# A station that passes between two samples turns its psi over: by more than this, that steep; rad.
_TURNED, _STEEP = 1.0, 1.0


def poles_passed(machine: Machine, t: Any, y: Any) -> Iterator[tuple[str, float]]:
    """Stations whose theta comes close to a right angle in the states y (nt, d) at t (nt,), and the first
    time, s."""
    layout, names = layout_of(machine), structure_of(machine).wiring.stations
    t, y = numbers(t), numbers(y)
    for name, k in zip(names, layout.internal):
        psi, theta = (_free(y, layout, c * layout.n_mass + k) for c in (3, 4))
        if k >= layout.n_mass or theta is None:
            continue
        turns = theta / np.pi
        from_pole = np.abs(np.abs(turns) % 1.0 - 0.5) * np.pi
        near = from_pole < _NEAR
        near[1:] |= np.diff(np.floor(turns + 0.5)) != 0
        if psi is not None:
            steep = np.minimum(from_pole[1:], from_pole[:-1]) < _STEEP
            near[1:] |= (np.abs(np.diff(psi)) > _TURNED) & steep
        if near.any():
            yield name, float(t[np.argmax(near)])


def _free(y: np.ndarray, layout, place: int) -> np.ndarray | None:
    """A free coordinate over time."""
    return y[:, layout.free.index(place)] if place in layout.free else None
