"""The machine, what it is made of inside, and its vector field."""

from .machine import Machine

__all__ = ["Machine"]


def __dir__() -> list[str]:
    return __all__
