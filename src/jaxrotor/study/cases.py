"""The cases of [sweep]: a sample, a grid or a table, with all that is tied to them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..core import arguments
from ..core.errors import InputError
from ..core.units import factor, known_unit, shown
from ..search.instrumented import Instrumented
from ..sensors.read import read_columns
from ..sweeps.cases import Cases
from ..sweeps.sensitivity import sobol_cases
from .mistakes import Faults, guess
from .spread import Swept, read_swept, unit_of
from .unknowns import read_quantity

OF_SAMPLES = ("count", "method", "seed", "correlations")
_METHODS = ("sobol", "latin", "random", "saltelli")


def read_cases(
    table: dict, folder: Path, bench: Instrumented, faults: Faults
) -> tuple[Cases | None, tuple[str, ...]]:
    """Of the whole section; and the paths that are swept of themselves."""
    if table.get("table") and table.get("parameters"):
        faults.add("sweep", "takes parameters or a table, but both are given: remove one")
    if "table" in table:
        _refuse(table, "a table", faults)
        columns = _columns(table["table"], folder, bench, faults)
        cases, paths = None, tuple(columns)
        if columns:
            cases = _attempt(lambda: Cases(columns, f"a table, {table['table']['file']}"), faults)
    else:
        swept = _parameters(table.get("parameters", []), bench, faults)
        paths = tuple(one.path for one in swept)
        cases = _cases(table, swept, faults) if swept else None
    if cases is not None:
        _check_values(cases, bench, faults)
    return cases, paths


def _attempt(make: Callable[[], Any], faults: Faults, place: str = "sweep") -> Any:
    try:
        return make()
    except InputError as error:
        faults.sentences += [f"`{place}`: {p}" for p in error.problems]
        return None


def _refuse(table: dict, what: str, faults: Faults) -> None:
    """Keys that go with samples alone."""
    for key in OF_SAMPLES:
        if key in table:
            faults.add("sweep", f"{key} goes with distributions, but this is {what}: remove {key}")


def _parameters(tables: Any, bench: Instrumented, faults: Faults) -> list[Swept]:
    """Empty where one of them is not sound."""
    if not isinstance(tables, list):
        faults.add(
            "sweep",
            f"parameters must be a list, but is {shown(tables)}: write [[sweep.parameters]]",
        )
        return []
    before, seen = len(faults.sentences), set()
    found = []
    for i, table in enumerate(tables):
        place = f"sweep.parameters, entry {i + 1}"
        one = read_swept(table, place, bench, faults)
        if one is None:
            continue
        for path in (one.path, *one.also):
            if path in seen:
                faults.add(place, f"`{path}` is swept twice: name it once")
            seen.add(path)
        found.append(one)
    return found if len(faults.sentences) == before else []


def _cases(table: dict, swept: Sequence[Swept], faults: Faults) -> Cases | None:
    drawn = [one for one in swept if one.distribution is not None]
    if not drawn:
        _refuse(table, "a grid", faults)
        axes = {one.path: one.values for one in swept}
        found = _attempt(lambda: Cases.grid(axes), faults)
    elif len(drawn) < len(swept):
        other = next(one for one in swept if one.distribution is None)
        faults.add(
            other.place,
            f"`{other.path}` has values, but `{drawn[0].path}` a distribution: give all of them a "
            "distribution (a sample), or all values (a grid)",
        )
        return None
    else:
        found = _sample(table, drawn, faults)
    if found is None:
        return None
    tied = {p: f * found.values[one.path] for one in swept for p, f in one.also.items()}
    return Cases({**found.values, **tied}, found.how, found.axes)


def _sample(table: dict, drawn: Sequence[Swept], faults: Faults) -> Cases | None:
    before = len(faults.sentences)
    if "count" not in table:
        faults.add("sweep", "count is missing: write count = 256, how many cases are drawn")
    count, seed = whole(table, "count", 1, faults), whole(table, "seed", 0, faults, 0)
    method = table.get("method", "sobol")
    if method not in _METHODS:
        faults.add(
            "sweep",
            f"method must be one of those known, but is {shown(method)}{guess(method, _METHODS)}",
        )
    paths = [one.path for one in drawn]
    correlations = _correlations(table.get("correlations", []), paths, faults)
    if correlations and method == "saltelli":
        faults.add(
            "sweep",
            'correlations do not go with method = "saltelli", whose parameters are independent',
        )
    if len(faults.sentences) > before:
        return None
    distributions = {one.path: one.distribution for one in drawn}
    if method == "saltelli":
        return _attempt(lambda: sobol_cases(distributions, count, seed), faults)
    return _attempt(lambda: Cases.sampled(distributions, count, method, seed, correlations), faults)


def whole(table: dict, key: str, least: int, faults: Faults, default: int = 1) -> int:
    most = arguments.LARGEST if key == "seed" else arguments.MANY
    try:
        return arguments.whole(least, most)(table.get(key, default), key)
    except InputError as error:
        faults.add("sweep", f"{error}: correct it")
        return max(default, least)


def _correlations(tables: Any, paths: list[str], faults: Faults) -> dict[tuple[str, str], float]:
    if not isinstance(tables, list):
        faults.add(
            "sweep",
            f"correlations must be a list, but is {shown(tables)}: write [[sweep.correlations]]",
        )
        return {}
    found = {}
    for i, table in enumerate(tables):
        place = f"sweep.correlations, entry {i + 1}"
        if not isinstance(table, dict):
            faults.add(place, f"must be a table with paths and value, but is {shown(table)}")
            continue
        faults.unknown_keys(place, table, ("paths", "value"))
        pair = table.get("paths")
        if not isinstance(pair, list) or len(pair) != 2 or pair[0] == pair[1]:
            faults.add(place, f"paths must be two parameters, but is {shown(pair)}")
            continue
        for path in pair:
            if path not in paths:
                faults.add(place, f"`{path}` has no distribution{guess(path, paths)}")
        value = read_quantity(table.get("value"), "", f"{place}: value", faults)
        if not -1 < value < 1 and "value" in table:
            faults.add(place, f"value must lie between -1 and 1, but is {value:g}: correct it")
        found[tuple(pair)] = value
    return found


def _columns(
    table: Any, folder: Path, bench: Instrumented, faults: Faults
) -> dict[str, np.ndarray]:
    """SI, from a file."""
    place = "sweep.table"
    if not isinstance(table, dict) or not isinstance(table.get("file"), str):
        faults.add(place, 'needs a file and the units of its columns: write file = "machines.csv"')
        return {}
    faults.unknown_keys(place, table, ("file", "units", "ignore"))
    units, ignored = table.get("units", {}), table.get("ignore", [])
    if not isinstance(units, dict) or not isinstance(ignored, list):
        faults.add(place, 'units must be a table such as { "main.mass" = "kg" }, ignore a list')
        return {}
    read = _attempt(lambda: read_columns(folder / table["file"], frozenset(units)), faults, place)
    if read is None:
        return {}
    names = [name for name in read if name not in ignored]
    for name in units:
        if name not in names:
            faults.add(place, f"units names `{name}`, which is no column{guess(name, names)}")
    found = {}
    for name in names:
        unit = unit_of(name, f"{place}: column", bench, faults)
        given = units.get(name, "")
        if unit is None:
            faults.sentences[-1] += " (a column that is no parameter: name it in ignore)"
            continue
        size = factor(given, unit) if isinstance(given, str) and known_unit(given) else None
        if size is None:
            what = f"is in {shown(given)}" if name in units else "has no unit"
            faults.add(
                place, f'`{name}` must be in {unit}, but {what}: write units."{name}" = "{unit}"'
            )
            continue
        try:
            values = np.asarray(read[name], float)
        except (TypeError, ValueError):
            faults.add(place, f"column `{name}` must hold numbers alone: correct the file")
            continue
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            faults.add(
                place, f"column `{name}` has no number in row {bad[0] + 1}: correct the file"
            )
            continue
        found[name] = size * values
    return found


def _check_values(cases: Cases, bench: Instrumented, faults: Faults) -> None:
    """Whether the rows with the least and greatest value of each parameter are machines."""
    rows = [int(end(x)) for x in cases.values.values() for end in (np.argmin, np.argmax)]
    told = set()
    for row in dict.fromkeys(rows):
        try:
            bench.set({path: float(x[row]) for path, x in cases.values.items()})
        except InputError as error:
            # one of a kind is enough: values differ from row to row
            new = [p for p in error.problems if p.partition(" must")[0] not in told]
            told |= {p.partition(" must")[0] for p in new}
            faults.sentences += [f"`sweep`: case {row + 1} is no machine: {p}" for p in new]
