"""The [sweep] section of a study."""

import operator
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.units import shown
from ..machine.machine import Machine
from ..search.instrumented import Instrumented
from ..simulation.simulation import Simulation
from ..sweeps.cases import Cases
from ..sweeps.layout import OWN
from ..sweeps.outputs import OverSpeed, TimeSeries
from .build import FAILED
from .cases import OF_SAMPLES, read_cases, whole
from .kinds import public_kinds
from .measures import MEASURES, build_measure, unit_seen
from .mistakes import Faults
from .spread import read_range
from .unknowns import read_quantity

_KEYS = (*OF_SAMPLES, "chunk", "parameters", "table", "outputs")
_KINDS = (*MEASURES, TimeSeries, OverSpeed)
_LIMITS = {"at_most": operator.le, "at_least": operator.ge}
_SIGNS = {"at_most": "<=", "at_least": ">="}


@dataclass(frozen=True)
class Limit:
    """`kind`: at_most or at_least; `value`: SI."""

    kind: str
    value: float

    def __str__(self) -> str:
        return _SIGNS[self.kind]

    def met(self, values: np.ndarray) -> np.ndarray:
        return _LIMITS[self.kind](values, self.value)


@dataclass(frozen=True)
class Sweep:
    """What [sweep] asks for. `paths`: what is swept of itself, without what is tied to it; `units`: of paths
    and outputs; `base`: of Saltelli's design its count, else 0."""

    cases: Cases
    paths: tuple[str, ...]
    outputs: dict[str, Any]
    limits: dict[str, Limit]
    units: dict[str, str]
    chunk: int | None = None
    base: int = 0


def read_sweep(table: Any, machine: Machine, settings: Simulation, folder: Path) -> Sweep:
    """Raises `InputError` with every fault of the section. Each case runs as [simulation] says.

    ```toml
    [sweep]
    count = 256                      # cases; best a power of two
    method = "sobol"                 # or "latin", "random"; "saltelli" for shares of the variance, of
                                     # count * (parameters + 2) cases
    seed = 0
    chunk = 32                       # machines in a batch; left out: by the memory there is

    [[sweep.parameters]]
    path = "main.unbalance.eccentricity"
    distribution = { kind = "uniform", low = "0.1 mm", high = "0.6 mm" }
    # or normal (mean, std, and low, high where it is cut), lognormal (median, sigma of the logarithm),
    # triangular (low, mode, high)
    also = { "second.unbalance.eccentricity" = 0.1 }     # follows, by a factor

    [[sweep.correlations]]           # of normal scores
    paths = ["main.unbalance.eccentricity", "main.mass"]
    value = 0.5

    [sweep.outputs.peak]             # a measure as in [optimize], a TimeSeries or an OverSpeed
    kind = "PeakValue"
    sensor = { kind = "Radial", station = "main" }
    at_most = "0.5 mm"               # or at_least: the share of cases that keep it is told
    ```

    A grid instead, every combination: all parameters have values, or from, to and points:

    ```toml
    [[sweep.parameters]]
    path = "end.profile.duration"
    values = ["1 s", "2 s", "4 s"]   # or from = "1 s", to = "4 s", points = 7
    ```

    Or a table in a file (.csv, .parquet), a row for each case, its columns named as the parameters:

    ```toml
    [sweep.table]
    file = "machines.csv"
    units = { "main.mass" = "kg", "main.unbalance.eccentricity" = "um" }
    ignore = ["serial number"]       # columns that are no parameters
    ```
    """
    faults = Faults()
    if not isinstance(table, dict):
        raise InputError(f"`sweep`: must be a table, but is {shown(table)}: write [sweep]")
    meant = faults.unknown_keys("sweep", table, _KEYS)
    for keys, words in (
        (("parameters", "table"), "[[sweep.parameters]] tables with a path, or [sweep.table]"),
        (("outputs",), '[sweep.outputs.NAME] with a kind, such as "PeakValue"'),
    ):
        if not any(table.get(key) for key in keys) and not meant & set(keys):
            faults.add("sweep", f"{' or '.join(keys)} is missing: write {words}")
    bench = Instrumented(machine, {})
    chunk = whole(table, "chunk", 1, faults) if "chunk" in table else None
    cases, paths = read_cases(table, folder, bench, faults)
    outputs, limits, units = _outputs(table.get("outputs", {}), machine, settings, folder, faults)
    if faults.sentences or cases is None:
        raise InputError(*faults.sentences)
    base = table["count"] if table.get("method") == "saltelli" else 0
    units |= {path: bench.unit(path) for path in cases.values}
    return Sweep(cases, paths, outputs, limits, units, chunk, base)


def _outputs(
    tables: Any, machine: Machine, settings: Simulation, folder: Path, faults: Faults
) -> tuple[dict[str, Any], dict[str, Limit], dict[str, str]]:
    """And their limits and units."""
    found, limits, units = {}, {}, {}
    if not isinstance(tables, dict):
        faults.add(
            "sweep", f"outputs must be tables, but is {shown(tables)}: write [sweep.outputs.peak]"
        )
        return found, limits, units
    for name, table in tables.items():
        place = f"sweep.outputs.{name}"
        if not re.fullmatch(r"[A-Za-z][\w-]*", name) or name in OWN:
            faults.add(
                place,
                f"needs a name of letters, digits, _ and - that is not {', '.join(OWN)}: rename it",
            )
            continue
        if not isinstance(table, dict) or "kind" not in table:
            what = (
                "has no kind"
                if isinstance(table, dict)
                else f"must be a table, but is {shown(table)}"
            )
            faults.add(
                place, f'{what}: write kind = "...", one of {", ".join(public_kinds(_KINDS))}'
            )
            continue
        own = {k: v for k, v in table.items() if k not in _LIMITS}
        if not _edges(own, place, faults):
            continue
        output = build_measure(own, place, machine, folder, faults, _KINDS)
        if output is FAILED:
            continue
        unit = unit_seen(output, place, machine, settings, faults)
        if unit is None:
            continue
        found[name], units[name] = output, unit
        given = [key for key in _LIMITS if key in table]
        if len(given) > 1:
            faults.add(place, "takes at_most or at_least, but both are given: remove one")
        elif given:
            value = read_quantity(table[given[0]], unit, f"{place}: {given[0]}", faults)
            limits[name] = Limit(given[0], value)
    return found, limits, units


def _edges(table: dict, place: str, faults: Faults) -> bool:
    """Of an `OverSpeed` also as from, to and points."""
    edges = table.get("edges")
    if table["kind"] == "OverSpeed" and isinstance(edges, dict) and "values" not in edges:
        faults_before = len(faults.sentences)
        faults.unknown_keys(place, edges, ("from", "to", "points"), "edges.")
        values = read_range(edges, "rad/s", place, faults, "edges.")
        if values is None or len(faults.sentences) > faults_before:
            return False
        table["edges"] = {"unit": "rad/s", "values": values.tolist()}
    return True
