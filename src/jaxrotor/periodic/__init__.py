"""Steady motions that repeat with the turns of the shaft, however nonlinear: harmonic balance, branches over speed."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
