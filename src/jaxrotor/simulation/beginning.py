"""What a run and its audit begin with: the machine assembled, where it starts, and what the march needs."""

from typing import NamedTuple

from jaxtyping import Array, Float

from ..core.quick import quickly_compiled
from ..machine.machine import Machine
from ..machine.system import System
from .prepared import Known, Prepared, Steps, assembled, known_of, prepare, steps_of, with_ladder
from .run_setup import RunSetup
from .start import start


class Begun(NamedTuple):
    """`y0`: the state at t = 0, and `checks` of it."""

    system: System
    y0: Float[Array, " d"]
    checks: Array
    prepared: Prepared


def begun(machine: Machine, setup: RunSetup, alone: bool, extra: int = 0) -> Begun:
    """`alone`: where nothing is traced, by programs that others have used. `extra`: states that follow the
    machine's own."""
    known = known_of(machine, setup) if alone else None
    system, balanced = assembled(machine, setup, known)
    # where the ladder is of other programs, the same for all
    more = extra if known is None or setup.grid is not None else 0
    y0, checks = _started(system, balanced, setup.initial, setup.speed)
    prepared = _begin(system, balanced, setup.started, known, more)
    if isinstance(prepared, Steps):
        prepared = with_ladder(machine, setup, known, prepared, extra)  # pyright: ignore
    return Begun(system, y0, checks, prepared)


# The state at t = 0, and checks of it: the same for runs of any length and step, and for their audit.
_started = quickly_compiled(start)


@quickly_compiled
def _begin(
    system: System, balanced: System | None, setup: RunSetup, known: Known | None, extra: int
) -> Prepared | Steps:
    """What the march needs, or its steps alone where other programs know the weights."""
    if known is not None and setup.grid is None:
        return steps_of(system, setup)[1]
    return prepare(system, balanced, setup, known, extra)
