"""Spectra, orders, orbits, waterfalls, Poincaré sections, bifurcations: what a run says of a machine."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
