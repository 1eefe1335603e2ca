"""Spectra, orders, orbits, waterfalls, Poincaré sections, bifurcations: what a run says of a machine."""

from .bifurcation import Bifurcation, bifurcation
from .centreline import Centreline, shaft_centreline
from .once_per_turn import PoincareSamples
from .orbit import Ellipse, Orbit, filtered_orbit, orbit
from .orders import OrderTrack, order_tracking
from .poincare import PoincareSection, poincare
from .shaft_angle import turn_instants
from .spectra import FullSpectrum, full_spectrum
from .waterfall import Waterfall, waterfall

__all__ = [
    "Bifurcation",
    "Centreline",
    "Ellipse",
    "FullSpectrum",
    "PoincareSamples",
    "Orbit",
    "OrderTrack",
    "PoincareSection",
    "Waterfall",
    "bifurcation",
    "filtered_orbit",
    "full_spectrum",
    "orbit",
    "order_tracking",
    "poincare",
    "shaft_centreline",
    "turn_instants",
    "waterfall",
]


def __dir__() -> list[str]:
    return __all__
