"""Steady vectors from files, with a small TOML that says which column is what."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from ..core.arguments import path
from ..core.document import read_document
from ..core.errors import InputError, refuse
from ..core.gate import takes
from ..machine.machine import Machine
from ..sensors.described import SHARED_KEYS, check_keys, quantity_of, table_of, unit_of, values_of
from ..sensors.formats.table import Table
from ..sensors.formats.text import HowWritten
from .measured_response import MeasuredResponse

_SHARED = tuple(key for key in SHARED_KEYS if key not in ("time", "offset", "sort"))
_FILE_KEYS = (*_SHARED, "name", "speed", "vectors", "conditions", "at")
_VECTOR_KEYS = ("column", "unit", "phase", "imaginary")


@takes(path=path)
def read_response(path: str | os.PathLike[str], machine: Machine) -> MeasuredResponse:
    """Steady vectors over speed, described by a TOML file such as

    ```toml
    file = "steady.csv"                      # beside this file; a row for each steady state
    speed = { column = "n", unit = "rpm" }
    at = "undeformed"                        # or left out; see jr.MeasuredResponse
    missing = -1                             # what stands for a missing value (empty and nan always do)

    [vectors.probe]                          # the name of a TrackingFilter
    column = "amplitude"
    phase = { column = "lag", unit = "deg" } # or imaginary = "NAME", where column holds the real part
    unit = "mil"

    [conditions]                             # what was different: a column, or one value for all rows
    "disc.unbalance.eccentricity" = { column = "u", unit = "g*mm/kg" }
    "disc.unbalance.angle" = "30 deg"
    ```

    `file` may be of any kind that `jr.read_record` reads, and is written as that says. `machine`: whose
    parameters the conditions name, for their units. Raises `InputError` with file, column and row for
    whatever cannot be read or makes no sense.
    """
    place = Path(path)
    told = read_document(place, "file, speed and [vectors.NAME]")
    check_keys(told, _FILE_KEYS, f"`{place}`")
    channels = told.get("vectors")
    if not isinstance(channels, dict) or not channels:
        raise InputError(
            f"`{place}`: names no vectors: write [vectors.NAME] with column, phase and unit"
        )
    conditions = told.get("conditions", {})
    if not isinstance(conditions, dict):
        raise InputError(f"`{place}`: conditions must be a table of path = value")
    if "speed" not in told:
        raise InputError(
            f'`{place}`: speed is missing: write speed = {{ column = "n", unit = "rpm" }}'
        )
    tables: dict[tuple[Path, HowWritten], Table] = {}
    file, problems = place.parent / str(told.get("file", "")), []
    wanted = frozenset(
        str(one.get("column"))
        for one in [told["speed"], *channels.values(), *conditions.values()]
        if isinstance(one, dict)
    )
    shared = {key: told[key] for key in _SHARED if key in told}
    vectors: dict[str, Any] = {}
    units: dict[str, str] = {}
    for name, own in channels.items():
        where = f"`{place}`: vectors.{name}"
        if not isinstance(own, dict):
            raise InputError(f"{where} must be a table with column, phase and unit, but is {own!r}")
        check_keys(own, _VECTOR_KEYS, where)
        table = table_of(shared | own, place.parent, where, tables, wanted)
        try:
            vectors[name] = values_of(shared | own, table, file, where)
            units[name] = unit_of(own, table.columns[str(own["column"])], where)
        except InputError as error:
            problems += error.problems
    refuse(dict.fromkeys(problems))
    table = next(iter(tables.values()))
    speeds = quantity_of(told["speed"], "rad/s", shared, table, file, f"`{place}`: speed")
    if np.ndim(speeds) == 0:
        speeds = np.full(len(next(iter(vectors.values()))), speeds)
    found = {}
    for key, given in conditions.items():
        where = f"`{place}`: conditions: {key}"
        try:
            unit = machine.units(key)[0]
        except InputError as error:
            problems += [f"{where}: {p.removeprefix(f'`{key}`: ')}" for p in error.problems]
            continue
        try:
            found[key] = quantity_of(given, unit, shared, table, file, where)
        except InputError as error:
            problems += error.problems
    refuse(problems)
    name, at = str(told.get("name", place.stem)), told.get("at", "equilibrium")
    try:
        return MeasuredResponse(speeds, vectors, found, units, name, at)
    except InputError as error:
        raise InputError(*(f"`{place}`: {problem}" for problem in error.problems)) from None
