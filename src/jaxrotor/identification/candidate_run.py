"""A run that could be made: a measured run before there is a record."""

import dataclasses
from collections.abc import Mapping
from typing import Any, Unpack

from ..core.arguments import mapping
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from ..machine.machine import Machine
from ..simulation.simulation import Settings, Simulation, as_simulation


@shows()
@dataclasses.dataclass(frozen=True, init=False)
class CandidateRun:
    """**Arguments:**

    - `simulation`: a `Simulation`, or its fields as keywords (`t_end=2.0`, `sample_rate=1000.0`,
      `initial="running"`, ...). Every sensor would record at its samples, from 0 to `t_end`.
    - `conditions`: what would be different in this run: path -> value, such as a trial mass or another speed.

    Raises `InputError` for what cannot be.
    """

    simulation: Simulation
    conditions: Mapping[str, Any]

    @takes(conditions=mapping)
    def __init__(
        self,
        simulation: Simulation | None = None,
        conditions: Mapping[str, Any] | None = None,
        **settings: Unpack[Settings],
    ):
        for key in ("t_end", "sample_rate"):
            if simulation is None and settings.get(key) is None:
                raise InputError(f"{key} must be given: it says when there would be samples")
        object.__setattr__(self, "simulation", as_simulation(simulation, settings))
        object.__setattr__(self, "conditions", dict(conditions or {}))

    def check(self, machine: Machine) -> None:
        """Raises `InputError` where `machine` cannot be run so."""
        self.simulation.check(machine.set(self.conditions))


def as_candidate_runs(given: Mapping[str, Any], machine: Machine) -> dict[str, CandidateRun]:
    """From candidates, simulations or mappings of settings, by name; all that `machine` cannot be run by is
    told at once. Raises `InputError`."""
    if not given:
        raise InputError("runs: name one at least, such as {'run-up': jr.Simulation(...)}")
    found, faults = {}, []
    for name, one in given.items():
        try:
            if isinstance(one, Simulation):
                one = CandidateRun(one)
            elif isinstance(one, Mapping):
                one = CandidateRun(**mapping(one, "a run"))
            if not isinstance(one, CandidateRun):
                raise InputError(
                    "must be a Simulation, a CandidateRun or a mapping of settings, but is "
                    f"{type(one).__name__}"
                )
            one.check(machine)
            found[name] = one
        except InputError as error:
            faults += [f"run `{name}`: {problem}" for problem in error.problems]
    if faults:
        raise InputError(*faults)
    return found
