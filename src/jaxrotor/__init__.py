"""jaxrotor: differentiable transient dynamics of rotating machines.

    machine = jr.Machine.in_line({"disc": jr.Rotor(...), "shaft": jr.Shaft(...), ...})
    response = jr.simulate(machine, t_end=3.0, sample_rate=1000.0)

What a script starts with stands here; the rest by what it is: `jr.elements`, `jr.profiles`, `jr.linear`,
`jr.diagnostics`, `jr.sensors`, `jr.identification`, `jr.objectives`, `jr.optimization`, `jr.sweeps`,
`jr.simulation`, `jr.integrators`, `jr.plot`, `jr.protocols` (to write elements of your own) and `jr.interop`.
"""

from typing import Any

import lazy_loader

from .core import interrupt as _interrupt

if _interrupt.is_command_line():
    _interrupt.leave_at_once()

_attached, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from .core.version import installed_version

        return installed_version()
    try:
        return _attached(name)
    except AttributeError as error:
        place = "" if name.startswith("_") else _place_of(name)
        raise AttributeError(f"{error}{place}", name=name) from None


def _place_of(name: str) -> str:
    """Where a name stands that is not here."""
    from types import ModuleType

    for room in __all__:
        module = _attached(room) if room.islower() else None
        if isinstance(module, ModuleType) and name in module.__all__:
            return f": it is jr.{room}.{name}"
    return ""
