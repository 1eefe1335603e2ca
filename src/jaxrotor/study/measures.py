"""Measures that a study names by kind: built, and tried on the machine's shapes; nothing runs."""

import dataclasses
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from ..core.errors import InputError
from ..machine.machine import Machine
from ..objectives.machine_measures import AbstractMachineMeasure, unit_on
from ..objectives.measure import AbstractMeasure, AbstractSignalMeasure, within
from ..sensors.quantities import Signal
from ..simulation.response import Response, blank_run
from ..simulation.run_info import RunInfo
from ..simulation.simulation import Simulation
from .build import FAILED, Context, build_element
from .kinds import find_kind
from .mistakes import Faults
from .quantities import quantities

MEASURES = (AbstractMeasure, AbstractMachineMeasure)


def build_measure(
    table: dict,
    place: str,
    machine: Machine,
    folder: Path,
    faults: Faults,
    bases: tuple[type, ...] = MEASURES,
    prefix: str = "",
) -> Any:
    """What a table with a `kind` describes, or FAILED."""
    table = dict(table)
    cls = find_kind(table.pop("kind"), bases, place, faults, folder, prefix)
    if cls is None:
        return FAILED
    measure = build_element(cls, table, Context(faults, place, folder, prefix=prefix))
    return measure if measure is FAILED else _with_unit(measure, machine)


def _with_unit(measure: Any, machine: Machine) -> Any:
    """The unit of an element's signal is known to the machine."""
    sensor = getattr(measure, "sensor", None)
    if type(sensor) is not Signal or sensor.unit:
        return measure
    unit = quantities(machine).get(sensor.element, {}).get(sensor.name, "")
    return dataclasses.replace(measure, sensor=dataclasses.replace(sensor, unit=unit))


def unit_seen(
    measure: Any, place: str, machine: Machine, settings: Simulation, faults: Faults
) -> str | None:
    """Its unit, or None where it does not find what it looks at: told by shapes alone."""
    try:
        if isinstance(measure, AbstractMachineMeasure):
            eqx.filter_eval_shape(measure, machine)
            return unit_on(measure, machine)
        return _seen(measure, machine, settings)
    except InputError as error:
        faults.sentences += [f"`{place}`: {p}" for p in error.problems]
        return None


def _seen(measure: Any, machine: Machine, settings: Simulation) -> str:
    """The unit of what can look at the run; raises `InputError`."""
    t = jnp.array([0.0, 0.5, 1.0]) * settings.t_end

    if isinstance(measure, AbstractSignalMeasure):
        ends = jnp.linspace(0.0, settings.t_end, 1 + round(settings.t_end * settings.sample_rate))
        within(measure, Response(machine, ends, jnp.zeros((ends.size, 0)), RunInfo("none")))
    eqx.filter_eval_shape(lambda m, t: measure(blank_run(m, t)), machine, t)
    return measure.unit if hasattr(measure, "unit") else measure.sensor.unit
