"""jaxrotor: differentiable transient dynamics of rotating machines.

    machine = jr.Machine.in_line({"disc": jr.Rotor(...), "shaft": jr.Shaft(...), ...})
    response = jr.simulate(machine, t_end=3.0, sample_rate=1000.0)

What a script starts with stands here; the rest by what it is: `jr.elements`, `jr.profiles`, `jr.linear`,
`jr.periodic`, `jr.diagnostics`, `jr.sensors`, `jr.identification`, `jr.objectives`, `jr.optimization`,
`jr.sweeps`, `jr.standards`, `jr.simulation`, `jr.integrators`, `jr.plot`, `jr.protocols` (to write elements
of your own) and `jr.interop`.
"""

from typing import Any

import lazy_loader

from .core import interrupt as _interrupt
from .core.one_kernel import ask_for_one_kernel as _ask_for_one_kernel

_ask_for_one_kernel()
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


# Words of other programs.
_OTHERS = {
    "disc": "Rotor", "disk": "Rotor", "bearing": "LinearSupport, RadialBearing or SelfAligningBearing",
    "ballbearing": "RollingBearing or LinearSupport", "motor": "PrescribedSpin or InductionMotor",
    "gear": "GearMesh", "seal": "SpeedDependentSupport",
}  # fmt: skip


def _place_of(name: str) -> str:
    """Where a name stands that is not here, or what it might mean."""
    import difflib
    from types import ModuleType

    rooms = {}
    for room in __all__:
        module = _attached(room) if room.islower() else None
        if isinstance(module, ModuleType):
            rooms |= {one: f"{room}.{one}" for one in module.__all__}
    if name in rooms:
        return f": it is jr.{rooms[name]}"
    if name.lower() in _OTHERS:
        return f": see jr.{_OTHERS[name.lower()]}"
    known = {one.lower(): place for one, place in (rooms | {n: n for n in __all__}).items()}
    close = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.75)
    return f": did you mean jr.{known[close[0]]}?" if close else ""
