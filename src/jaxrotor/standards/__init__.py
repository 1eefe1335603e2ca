"""The numbers by which rotors are accepted or rejected: checks of API and ISO, each with its gradient."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
