"""What the diagnostics say of a station of a run: each picture works out what it draws."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from ..core.errors import InputError
from ..diagnostics.centreline import shaft_centreline
from ..diagnostics.orbit import filtered_orbit, orbit
from ..diagnostics.orders import order_tracking
from ..diagnostics.poincare import poincare
from ..diagnostics.spectra import full_spectrum
from ..diagnostics.waterfall import waterfall
from ..simulation.response import Response, StationResponse
from . import diagnose, select
from .orbits import centreline, orbits, poincare as draw_section
from .style import Given

# Orders that are marked, and those that are tracked and filtered, where none is named: the latter if there
# are so many samples in a turn.
_MARKED, _FILTERED, _SAMPLES = (0.5, 1.0, 2.0), (1.0, 2.0), 8
# Turns of an orbit, of a block that is tracked, and that are filtered, at most.
_TURNS, _LONG = 4, 16
# Points of a centreline, where the run has turns enough.
_POINTS = 24
# Frequencies are shown up to so many times the highest order's.
_BEYOND = 1.3
# Where a motion has settled, if it does: from this part of the run on.
_SETTLED = 2 / 3


class _Stretch(NamedTuple):
    """Of a run and a station, from `start` on: x, y (m), vx (m/s), angle (rad) and speed (rad/s) at `rate`,
    Hz."""

    x: np.ndarray
    y: np.ndarray
    vx: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    rate: float
    title: str

    def filtered(self, orders: Sequence[float] | None) -> tuple[float, ...]:
        """The orders that are tracked or filtered."""
        if orders is not None:
            return tuple(orders)
        enough = self.rate * 2 * np.pi >= _SAMPLES * float(np.abs(self.speed).max())
        return _FILTERED if enough else _FILTERED[:1]

    def highest(self, orders: Sequence[float]) -> float:
        """Hz, of the axis."""
        return _BEYOND * max(orders) * float(np.abs(self.speed).max()) / (2 * np.pi) or self.rate


def _stretch(
    response: Response, station: str | None, start: float | None, part: float, title: str
) -> _Stretch:
    (station,) = select.named(station, select.swaying(response.machine)[:1], "station")
    at, t = response[station], np.asarray(response.t)
    if not isinstance(at, StationResponse):
        raise InputError(f"`{station}`: is no station: name a rotor, a bearing or a driven end")
    begin = t[0] + part * (t[-1] - t[0]) if start is None else start
    if not begin < t[-1]:
        raise InputError(
            f"`start`: must lie within the run, which ends at {t[-1]:g} s, but is {begin:g} s: begin "
            "earlier"
        )
    inside = slice(int(np.searchsorted(t, begin - 1e-9)), None)
    q, v = np.asarray(at.position)[inside], np.asarray(at.velocity)[inside]
    return _Stretch(
        q[:, 0], q[:, 1], v[:, 0], q[:, 5], np.asarray(at.speed)[inside], 1.0 / (t[1] - t[0]),
        title.replace("{station}", station),
    )  # fmt: skip


def run_orbit(
    response: Response,
    station: str | None = None,
    start: float | None = None,
    orders: Sequence[float] | None = None,
    title: str = "{station}",
    ax: Given | None = None,
) -> np.ndarray:
    """Orbits of a station (by default the heaviest rotor): its last turns as they are, and what the
    `orders` (per turn; by default once and twice) make of it, alone and together. `start`: s, from when on
    the run is looked at; by default its last third. With one axes the first alone."""
    part = _stretch(response, station, start, _SETTLED, title)
    at = part.x, part.y, part.angle, part.rate
    found = {"all": orbit(*at, turns=_TURNS)}
    if ax is None or np.size(np.asarray(ax, object)) > 1:
        chosen = part.filtered(orders)
        whole = int(abs(part.angle[-1] - part.angle[0]) / (2 * np.pi)) - 1
        turns = min(max(whole, 1), _LONG)
        for some in dict.fromkeys((chosen[:1], chosen)):
            words = " + ".join(f"{k:g}×" for k in some)
            found[words] = filtered_orbit(*at, some, turns, "hann")
    return orbits(found, title=part.title, ax=ax)


def run_full_spectrum(
    response: Response,
    station: str | None = None,
    start: float | None = None,
    orders: Sequence[float] | None = None,
    title: str = "Full spectrum of {station}",
    ax: Given | None = None,
) -> Axes:
    """Amplitudes of backward and forward whirl of a station (by default the heaviest rotor) over frequency,
    with `orders` of its mean speed marked. `start`: s, from when on the run is looked at; by default its
    last third."""
    part = _stretch(response, station, start, _SETTLED, title)
    found = full_spectrum(part.x, part.y, part.rate)
    speed = float(np.mean(np.abs(part.speed)))
    return diagnose.full_spectrum(found, speed, orders or _MARKED, title=part.title, ax=ax)


def _waterfall(draw: Callable[..., Axes], response, station, start, orders, title, ax) -> Axes:
    part, marked = _stretch(response, station, start, 0.0, title), orders or _MARKED
    found = waterfall(part.x, part.speed, part.rate, y=part.y)
    return draw(found, marked, highest=part.highest(marked), title=part.title, ax=ax)


def run_waterfall(
    response: Response,
    station: str | None = None,
    start: float | None = None,
    orders: Sequence[float] | None = None,
    title: str = "Waterfall of {station}",
    ax: Given | None = None,
) -> Axes:
    """Full spectra of a station (by default the heaviest rotor) by colour over frequency and speed, with
    lines of `orders`. `start`: s, from when on the run is looked at; by default all of it."""
    return _waterfall(diagnose.waterfall_map, response, station, start, orders, title, ax)


def run_cascade(
    response: Response,
    station: str | None = None,
    start: float | None = None,
    orders: Sequence[float] | None = None,
    title: str = "Cascade of {station}",
    ax: Given | None = None,
) -> Axes:
    """As `waterfall`, the spectra as lines above each other."""
    return _waterfall(diagnose.cascade, response, station, start, orders, title, ax)


def run_order_tracks(
    response: Response,
    station: str | None = None,
    start: float | None = None,
    orders: Sequence[float] | None = None,
    title: str = "Orders of {station}, x",
    ax: Given | None = None,
) -> np.ndarray:
    """Amplitude and phase of `orders` (by default once and twice a turn) of a station's x over its speed: two
    panels. By default of the heaviest rotor. `start`: s, from when on the run is looked at; by default
    all."""
    part = _stretch(response, station, start, 0.0, title)
    chosen = part.filtered(orders)
    found = order_tracking(part.x, part.angle, part.rate, chosen, _TURNS, 1, "hann")
    return diagnose.order_tracks(found, title=part.title, ax=ax)


def run_centreline(
    response: Response,
    station: str | None = None,
    start: float | None = None,
    clearance: float | None = None,
    title: str = "Shaft centreline of {station}",
    ax: Given | None = None,
) -> Axes:
    """Mean positions of a station (by default the heaviest rotor), the speed by colour; `clearance`: m,
    radius of a circle around. `start`: s, from when on the run is looked at; by default all of it."""
    part = _stretch(response, station, start, 0.0, title)
    # over several turns: a whirl at half the speed leaves no trace then
    turned = abs(part.angle[-1] - part.angle[0]) / (2 * np.pi)
    turns = int(np.clip(turned / _POINTS, 1, _LONG))
    found = shaft_centreline(part.x, part.y, part.angle, part.rate, turns)
    return centreline(found, clearance, title=part.title, ax=ax)


def run_poincare(
    response: Response,
    station: str | None = None,
    start: float | None = None,
    title: str = "Poincaré section of {station}",
    ax: Given | None = None,
) -> Axes:
    """x and its rate of a station (by default the heaviest rotor) once a turn. `start`: s, from when on the
    run is looked at; by default its last third."""
    part = _stretch(response, station, start, _SETTLED, title)
    found = poincare(part.x, part.vx, part.angle, part.rate)
    return draw_section(found, title=part.title, ax=ax)
