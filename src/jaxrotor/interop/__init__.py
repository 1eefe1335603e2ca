"""Machines from other programs' models."""

from .ross import from_ross

__all__ = ["from_ross"]


def __dir__() -> list[str]:
    return __all__
