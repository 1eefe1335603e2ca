"""Machines from other programs' models."""

from .ross import from_ross as from_ross
