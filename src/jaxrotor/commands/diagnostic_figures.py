"""Draws the diagnostic figures of a study."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .. import plot
from ..core.errors import InputError, JaxrotorError
from ..diagnostics.centreline import shaft_centreline
from ..diagnostics.orbit import filtered_orbit, orbit
from ..diagnostics.orders import order_tracking
from ..diagnostics.poincare import poincare
from ..diagnostics.spectra import full_spectrum
from ..diagnostics.waterfall import waterfall
from ..plot.style import figure
from ..simulation.response import Response, StationResponse

# Orders that are marked, and those that are tracked and filtered, where the study names none: the latter
# if there are so many samples in a turn.
_MARKED, _FILTERED, _SAMPLES = (0.5, 1.0, 2.0), (1.0, 2.0), 8
# Turns of an orbit, of a block that is tracked, and that are filtered, at most.
_TURNS, _LONG = 4, 16
# Points of a centreline, where the run has turns enough.
_POINTS = 24
# Frequencies are shown up to so many times the highest order's.
_BEYOND = 1.3
_OVER_SPEED = ("waterfall", "cascade", "order_tracking", "centreline")


class _Part:
    """The stretch of a run that a figure is about: x, y, vx (SI), angle and speed of its station."""

    def __init__(self, response: Response, wanted: Any):
        t = np.asarray(response.t)
        start = wanted.start
        if start is None:
            start = 0.0 if wanted.kind in _OVER_SPEED else t[0] + 2 / 3 * (t[-1] - t[0])
        if not start < t[-1]:
            raise InputError(
                f"`start`: must lie within the run, which ends at {t[-1]:g} s, but is {start:g} s: begin "
                "earlier"
            )
        inside = slice(int(np.searchsorted(t, start - 1e-9)), None)
        at = response[wanted.station]
        assert isinstance(at, StationResponse)
        self.rate = 1.0 / (t[1] - t[0])
        q, v = np.asarray(at.position)[inside], np.asarray(at.velocity)[inside]
        self.x, self.y, self.angle, self.vx = q[:, 0], q[:, 1], q[:, 5], v[:, 0]
        self.speed = np.asarray(at.speed)[inside]
        self.orders = wanted.orders
        self.clearance = wanted.clearance
        self.title = f"{wanted.title}: `{wanted.station}`"

    def filtered(self) -> tuple[float, ...]:
        """The orders that are tracked or filtered."""
        if self.orders is not None:
            return self.orders
        enough = self.rate * 2 * np.pi >= _SAMPLES * float(np.abs(self.speed).max())
        return _FILTERED if enough else _FILTERED[:1]

    def highest(self) -> float:
        """Hz, of the axis."""
        orders = self.orders or _MARKED
        return _BEYOND * max(orders) * float(np.abs(self.speed).max()) / (2 * np.pi) or self.rate


def diagnosis(response: Response, wanted: Any) -> Figure:
    """The figure; where the run does not allow it (a shaft that turns back, too few turns), a page that says
    why, so that the rest of the report is not lost."""
    try:
        return _DRAW[wanted.kind](_Part(response, wanted))
    except JaxrotorError as error:
        fig, axes = figure(1, 1, (9.0, 2.5))
        axes[0, 0].set_axis_off()
        axes[0, 0].set_title(wanted.title, fontsize=11, loc="left")
        words = f"Not drawn. {error}"
        axes[0, 0].text(0, 0.9, words, va="top", wrap=True, transform=axes[0, 0].transAxes)
        return fig


def _full_spectrum(part: _Part) -> Figure:
    found = full_spectrum(part.x, part.y, part.rate)
    speed = float(np.mean(np.abs(part.speed)))
    return plot.full_spectrum(found, speed, part.orders or _MARKED, title=part.title)


def _waterfall(part: _Part, draw: Callable[..., Figure]) -> Figure:
    found = waterfall(part.x, part.speed, part.rate, y=part.y)
    return draw(found, part.orders or _MARKED, highest=part.highest(), title=part.title)


def _order_tracking(part: _Part) -> Figure:
    orders = part.filtered()
    found = order_tracking(part.x, part.angle, part.rate, orders, _TURNS, 1, "hann")
    return plot.order_tracks(found, title=f"{part.title}, x")


def _orbit(part: _Part) -> Figure:
    at = part.x, part.y, part.angle, part.rate
    found = {"all": orbit(*at, turns=_TURNS)}
    orders = part.filtered()
    whole = int(abs(part.angle[-1] - part.angle[0]) / (2 * np.pi)) - 1
    turns = min(max(whole, 1), _LONG)
    for chosen in dict.fromkeys((orders[:1], orders)):
        words = " + ".join(f"{k:g}×" for k in chosen)
        found[words] = filtered_orbit(*at, chosen, turns, "hann")
    return plot.orbits(found, title=part.title)


def _centreline(part: _Part) -> Figure:
    # over several turns: a whirl at half the speed leaves no trace then
    turned = abs(part.angle[-1] - part.angle[0]) / (2 * np.pi)
    turns = int(np.clip(turned / _POINTS, 1, _LONG))
    found = shaft_centreline(part.x, part.y, part.angle, part.rate, turns)
    return plot.centreline(found, part.clearance, title=part.title)


def _poincare(part: _Part) -> Figure:
    found = poincare(part.x, part.vx, part.angle, part.rate)
    return plot.poincare(found, title=part.title)


_DRAW: dict[str, Callable[[_Part], Figure]] = {
    "full_spectrum": _full_spectrum,
    "waterfall": lambda part: _waterfall(part, plot.waterfall_map),
    "cascade": lambda part: _waterfall(part, plot.cascade),
    "order_tracking": _order_tracking,
    "orbit": _orbit,
    "centreline": _centreline,
    "poincare": _poincare,
}
