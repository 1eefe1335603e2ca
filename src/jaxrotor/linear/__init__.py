"""The same machine, linear: modes, critical speeds, frequency response."""

from .linearise import LinearModel as LinearModel, linearize as linearize
