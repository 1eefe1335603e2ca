"""Doors to rooms above: methods offered here (`machine.summary()`), written where they belong."""

import importlib
from typing import Any


def through(module: str, name: str) -> Any:
    """`name` of a module of jaxrotor, such as `"simulation.summary"`, imported when it is asked for. The room
    below knows nothing of the one above but these names."""
    return getattr(importlib.import_module(f"jaxrotor.{module}"), name)
