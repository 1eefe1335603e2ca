"""Studies: a machine and a simulation as a TOML file, checked whole before anything runs."""

from .study import Study as Study, load as load
