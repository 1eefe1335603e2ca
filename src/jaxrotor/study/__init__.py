"""Studies: a machine and a simulation as a TOML file, checked whole before anything runs."""

from .study import Study, load

__all__ = ["Study", "load"]


def __dir__() -> list[str]:
    return __all__
