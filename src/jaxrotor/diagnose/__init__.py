"""Diagnostics of sampled vibration: spectra, orders, orbits, sections; NumPy in, NumPy out."""

from .bifurcation import Bifurcation as Bifurcation, bifurcation as bifurcation
from .centreline import Centreline as Centreline, shaft_centreline as shaft_centreline
from .once import OnceATurn as OnceATurn
from .orbit import (
    Ellipse as Ellipse,
    Orbit as Orbit,
    ellipse as ellipse,
    filtered_orbit as filtered_orbit,
    orbit as orbit,
)
from .orders import OrderTrack as OrderTrack, order_tracking as order_tracking
from .poincare import PoincareSection as PoincareSection, poincare as poincare
from .spectra import FullSpectrum as FullSpectrum, full_spectrum as full_spectrum
from .turning import turn_instants as turn_instants
from .waterfall import Waterfall as Waterfall, waterfall as waterfall
