"""Steady nonlinear motions that repeat with the shaft: harmonic balance, branches over speed, stability"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
