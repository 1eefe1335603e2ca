"""One machine many times over, in batches."""

import lazy_loader

from . import accessor as _accessor  # datasets know it from here on

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
