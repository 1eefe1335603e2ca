"""Doors to rooms above: methods offered here (`machine.summary()`), written where they belong."""

import importlib
from typing import Any


def through(module: str, name: str) -> Any:
    """`name` of a module of jaxrotor, such as `"simulation.summary"`, imported when it is asked for. The room
    below knows nothing of the one above but these names."""
    return getattr(importlib.import_module(f"jaxrotor.{module}"), name)


def plot_door() -> Any:
    """The attribute `plot` of what there are pictures of, for the body of its class. `plot/` is not loaded
    before it is looked at; `plot/doors.py` says which pictures there are."""

    def plot(self: Any) -> Any:
        """What can be drawn of it: tab completion, `print(x.plot)` and `help(x.plot)` list it. `x.plot()`
        draws what comes first; `ax=` draws on given axes of matplotlib; axes are returned."""
        return through("plot.doors", "pictures")(self)

    return property(plot)
