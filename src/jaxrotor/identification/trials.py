"""Whatever was measured, as `identify` takes it."""

from collections.abc import Sequence
from typing import Any

from ..core.errors import InputError
from ..sensors.record import Record
from .measured_response import MeasuredResponse
from .measured_run import MeasuredRun

Trial = MeasuredRun | MeasuredResponse


def as_trials(data: Any) -> tuple[Trial, ...]:
    """From a record, a measured run or response, or several of them."""
    many = data if isinstance(data, Sequence) else [data]
    found = []
    for one in many:
        if isinstance(one, Record):
            one = MeasuredRun(one)
        if not isinstance(one, Trial):
            raise InputError(
                "data must be Records, MeasuredRuns or MeasuredResponses, but one is "
                f"{type(one).__name__}"
            )
        if isinstance(one, MeasuredRun) and min(float(s.t[0]) for s in one.series.values()) < -1e-9:
            raise InputError(
                f"`{one.name}`: has values before t = 0, where the run starts: shift its time"
            )
        found.append(one)
    if not found:
        raise InputError("no data: give a Record, a MeasuredRun or a MeasuredResponse at least")
    return tuple(found)
