from .bifurcation import Bifurcation as Bifurcation, bifurcation as bifurcation
from .centreline import Centreline as Centreline, shaft_centreline as shaft_centreline
from .once_per_turn import PoincareSamples as PoincareSamples
from .orbit import (
    Ellipse as Ellipse,
    Orbit as Orbit,
    filtered_orbit as filtered_orbit,
    orbit as orbit,
)
from .orders import OrderTrack as OrderTrack, order_tracking as order_tracking
from .poincare import PoincareSection as PoincareSection, poincare as poincare
from .shaft_angle import turn_instants as turn_instants
from .spectra import FullSpectrum as FullSpectrum, full_spectrum as full_spectrum
from .waterfall import Waterfall as Waterfall, waterfall as waterfall
