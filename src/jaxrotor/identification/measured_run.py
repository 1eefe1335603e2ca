"""A recorded run, and how the machine is simulated to meet it."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..core.arguments import mapping, number, positive
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from ..machine.machine import Machine
from ..sensors.record import Record
from ..simulation.checks import check_solver, initial_speed
from ..simulation.plan import Plan, plan
from ..simulation.simulate import Initial
from ..simulation.solver import is_planned, solver_for
from ..simulation.state import State


@shows(sample_rate="Hz", speed="rad/s")
@takes(
    rtol=number(above=0.0, below=1.0),
    atol=positive(),
    sample_rate=positive("Hz"),
    solver=None,
    conditions=mapping,
)
@dataclasses.dataclass(frozen=True)
class MeasuredRun:
    """**Arguments:**

    - `record`: what was measured; its time 0 is that of the run.
    - `sample_rate`: Hz, of the simulation; by default that of the fastest channel.
    - `initial`, `speed`, `step`, `solver`, `rtol`, `atol`: as for `jr.simulate`.
    - `conditions`: what was different in this run: path -> value, such as a trial mass or another drive.
    """

    record: Record
    sample_rate: float | None = None
    initial: Initial | State = "static"
    speed: float | None = None
    conditions: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    step: Plan | float | None = None
    solver: Any = None
    rtol: float = 1e-7
    atol: float = 1e-10

    def check(self, machine: Machine) -> None:
        """Raises `InputError` where `machine` cannot be run so."""
        machine = machine.set(self.conditions)
        check_solver(machine, self.solver, self.step, self.rtol, self.atol)
        initial_speed(machine, self.initial, self.speed)

    def planned(self, machine: Machine) -> "MeasuredRun":
        """With its sample rate, and with a step fit for `machine`."""
        rate = self.sample_rate
        if rate is None:
            rate = max(1.0 / float(np.median(np.diff(s.t))) for s in self.record.series.values())
        machine = machine.set(self.conditions)
        solver, step = solver_for(machine, self.solver), self.step
        if step is None and is_planned(solver):
            step = plan(machine, self.record.end + 2 / rate, rate, self.speed)
        return dataclasses.replace(self, sample_rate=float(rate), step=step, solver=solver)

    @property
    def t_end(self) -> float:
        """A little beyond the last value, for values between samples."""
        assert self.sample_rate is not None
        return self.record.end + 2 / self.sample_rate


def as_measured_runs(data: Any) -> tuple[MeasuredRun, ...]:
    """From a record, a trial, or several of them."""
    many = data if isinstance(data, Sequence) else [data]
    found = []
    for one in many:
        if isinstance(one, Record):
            one = MeasuredRun(one)
        if not isinstance(one, MeasuredRun):
            raise InputError(
                f"data must be Records or MeasuredRuns, but one is {type(one).__name__}"
            )
        if min(float(s.t[0]) for s in one.record.series.values()) < -1e-9:
            raise InputError(
                f"`{one.record.name}`: has values before t = 0, where the run starts: shift its time"
            )
        found.append(one)
    if not found:
        raise InputError("no data: give a Record or a MeasuredRun at least")
    return tuple(found)
