"""A recorded run, and how the machine is simulated to meet it."""

import dataclasses
from collections.abc import Mapping
from typing import Any, Unpack

import numpy as np

from ..core.arguments import mapping
from ..core.gate import takes
from ..core.result_text import shows
from ..machine.machine import Machine
from ..sensors.record import Record, Series
from ..simulation.simulate import for_slopes, settled
from ..simulation.simulation import Settings, Simulation, as_simulation
from .simulated import Run


@shows()
@dataclasses.dataclass(frozen=True, init=False)
class MeasuredRun:
    """**Arguments:**

    - `record`: what was measured; its time 0 is that of the run, which lasts a little longer than it.
    - `simulation`: how the run is simulated, a `Simulation`; or its fields as keywords (`initial="running"`,
      `speed=...`, `step=...`). `sample_rate` is by default that of the fastest channel; `t_end` is the
      record's.
    - `conditions`: what was different in this run: path -> value, such as a trial mass or another drive.

    Raises `InputError` for what cannot be.
    """

    record: Record
    simulation: Simulation
    conditions: Mapping[str, Any]

    @takes(conditions=mapping)
    def __init__(
        self,
        record: Record,
        simulation: Simulation | None = None,
        conditions: Mapping[str, Any] | None = None,
        **settings: Unpack[Settings],
    ):
        if simulation is None and settings.get("sample_rate") is None:
            settings["sample_rate"] = _fastest(record)
        # values between samples need one beyond the last
        end = {} if simulation is not None else {"t_end": record.end + 1.0}
        simulation = as_simulation(simulation, settings | end)  # pyright: ignore
        t_end = record.end + 2 / simulation.sample_rate
        for name, value in dict(
            record=record,
            simulation=dataclasses.replace(simulation, t_end=t_end),
            conditions=conditions or {},
        ).items():
            object.__setattr__(self, name, value)

    @property
    def name(self) -> str:
        return self.record.name

    @property
    def series(self) -> Mapping[str, Series]:
        """By channel."""
        return self.record.series

    def posed(self) -> Run:
        """Ready to be simulated."""
        times = {name: series.t for name, series in self.series.items()}
        return Run.of(times, self.conditions, self.simulation)

    def check(self, machine: Machine) -> None:
        """Raises `InputError` where `machine` cannot be run so."""
        self.simulation.check(machine.set(self.conditions))

    def planned(self, machine: Machine) -> "MeasuredRun":
        """With a solver and a step fit for `machine`, for slopes by forward mode."""
        ready = for_slopes(settled(machine.set(self.conditions), self.simulation), reverse=False)
        return MeasuredRun(self.record, ready, self.conditions)


def _fastest(record: Record) -> float:
    """The rate of the fastest channel, Hz."""
    return max(1.0 / float(np.median(np.diff(s.t))) for s in record.series.values())
