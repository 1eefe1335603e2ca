"""One channel of a record file: which values, at which instants, in which unit."""

from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.units import known_unit, read, shown
from ..machine.wiring import unknown
from .formats.kinds import read_table, reading
from .formats.spelling import told_unit
from .formats.table import Column, Table, even, real_numbers
from .formats.text import HowWritten, as_numbers
from .record import Series

# What a record file holds where nobody knows yet.
UNKNOWN = "?"
# How a text file is written, each found out where it is left out.
_WRITTEN = HowWritten._fields
SHARED_KEYS = ("file", "time", "offset", "sort", "missing", *_WRITTEN)
_TIME_KEYS = ("column", "unit", "rate", "step", "start")


def check_keys(given: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in given:
        if key not in known:
            raise InputError(f"{where}: {unknown('key', key, known)}")


def table_of(
    told: dict[str, Any],
    folder: Path,
    where: str,
    tables: dict[tuple[Path, HowWritten], Table],
    wanted: frozenset[str],
) -> Table:
    """The file that a channel is in; each is read once, and kept in `tables`."""
    for key in ("file", "column"):
        if key not in told:
            raise InputError(f"{where}: `{key}` is missing")
    file, how = folder / str(told["file"]), _how_written(told, where)
    if (file, how) not in tables:
        tables[file, how] = read_table(
            file, how, wanted, 2 if "column" in _clock(told, where) else 1
        )
    return tables[file, how]


def series_of(
    told: dict[str, Any], folder: Path, where: str, where_time: str, table: Table
) -> Series:
    """The signal of a channel; `where`, `where_time`: in the record file."""
    file, name = folder / str(told["file"]), str(told["column"])
    column = _found(table, name, file, where)
    values = values_of(told, table, file, where)
    t = _instants(_clock(told, where), table, column, len(values), file, where_time)
    if "offset" in told:
        t = t + _quantity(told["offset"], "s", f"{where}: offset")
    if not isinstance(sort := told.get("sort", False), bool):
        raise InputError(f"{where}: sort must be true or false, but is {shown(sort)}")
    unit = unit_of(told, column, where)
    if sort:
        order = np.argsort(t, kind="stable")
        t, values = t[order], values[order]
    return Series(t, values, unit, f"`{file.name}`: {name}")


def values_of(told: dict[str, Any], table: Table, file: Path, where: str) -> np.ndarray:
    """What a channel's columns hold, as written: real numbers, or vectors."""
    name = str(told["column"])
    values = _numbers(_found(table, name, file, where), name, file, where, _missing(told, where))
    return _as_vectors(values, told, table, file, where)


def quantity_of(
    given: Any, unit: str, told: dict[str, Any], table: Table, file: Path, where: str
) -> np.ndarray | float:
    """In `unit`: a quantity that holds for all rows ("30 deg"), or a column's, { column, unit }."""
    if not isinstance(given, dict):
        return _quantity(given, unit, where)
    check_keys(given, ("column", "unit"), where)
    name = str(given.get("column", ""))
    column = _found(table, name, file, where)
    size = _size(unit_of(given, column, where), unit, where)
    return size * _numbers(column, name, file, where, _missing(told, where))


def _as_vectors(
    values: np.ndarray, told: dict[str, Any], table: Table, file: Path, where: str
) -> np.ndarray:
    """Complex, where the channel has a phase or an imaginary part in a column of its own."""
    ways = [key for key in ("phase", "imaginary") if key in told]
    if not ways:
        return values
    if len(ways) > 1:
        raise InputError(f"{where}: has {' and '.join(ways)}: keep one of them")
    place, given = f"{where}: {ways[0]}", told[ways[0]]
    given = given if isinstance(given, dict) else {"column": given}
    check_keys(given, ("column", "unit") if ways == ["phase"] else ("column",), place)
    name = str(given.get("column", ""))
    column = _found(table, name, file, place)
    other = _numbers(column, name, file, place, _missing(told, where))
    if ways == ["imaginary"]:
        return values + 1j * other
    unit = str(given.get("unit", told_unit(column.unit)[0] or "deg"))
    return values * np.exp(1j * _size(unit, "rad", place) * other)


def _clock(told: dict[str, Any], where: str) -> dict[str, Any]:
    clock = told.get("time", {})
    clock = clock if isinstance(clock, dict) else {"column": clock}
    check_keys(clock, _TIME_KEYS, f"{where}.time")
    return clock


def unit_of(told: dict[str, Any], column: Column, where: str) -> str:
    if "unit" not in told:
        unit, why = told_unit(column.unit)
        if not unit:
            raise InputError(
                f'{where}: `unit` is missing{f" ({why})" if why else ""}: write unit = "m/s^2" or the like, '
                '"1" for a plain number'
            )
        return unit
    unit = str(told["unit"])
    if unit == UNKNOWN:
        raise InputError(
            f'{where}: unit is still "{UNKNOWN}": write what it was measured in, such as "m/s^2", or "1" for '
            "a plain number"
        )
    if not unit or not known_unit(unit):
        raise InputError(f"{where}: `{unit}` is no unit")
    return unit


def _instants(
    clock: dict[str, Any], table: Table, column: Column, count: int, file: Path, place: str
) -> np.ndarray:
    """s: from a column, at a given rate, or as the file was sampled."""
    ways = [key for key in ("column", "rate", "step") if key in clock]
    if len(ways) > 1:
        raise InputError(f"{place}: has {' and '.join(ways)}: keep one of them")
    if "start" in clock and not {"rate", "step"} & set(ways):
        raise InputError(f"{place}: start goes with rate or step: write offset beside time instead")
    if "unit" in clock and ways != ["column"]:
        raise InputError(f"{place}: unit goes with column: take it out")
    if not ways:
        if column.times is None:
            raise InputError(
                f"{place} is missing, and `{file.name}` does not say how it was sampled: write "
                'time = "NAME", the column of instants, or time = { rate = "2048 Hz" } or { step = "0.5 ms" }'
            )
        return column.times()
    if ways == ["column"]:
        name = str(clock["column"])
        instants = _found(table, name, file, place)
        unit, why = told_unit(instants.unit)
        if why and "unit" not in clock:
            raise InputError(f'{place}: {why}: write time = {{ column = "{name}", unit = "s" }}')
        size = _size(clock.get("unit", unit or "s"), "s", place)
        return size * _numbers(instants, name, file, place, ())
    if UNKNOWN in str(clock[ways[0]]):
        raise InputError(
            f'{place}: {ways[0]} is still "{clock[ways[0]]}": write how it was sampled, such as rate = '
            '"2048 Hz", or which column holds the instants'
        )
    given = _quantity(clock[ways[0]], "Hz" if ways == ["rate"] else "s", f"{place}: {ways[0]}")
    if not given > 0:
        raise InputError(f"{place}: {ways[0]} must be positive, but is {shown(clock[ways[0]])}")
    start = _quantity(clock.get("start", "0 s"), "s", f"{place}: start")
    return even(start, 1 / given if ways == ["rate"] else given, count)()


def _quantity(value: Any, unit: str, place: str) -> float:
    try:
        return read(value, unit)
    except ValueError as error:
        raise InputError(f"{place} {error}") from None


def _how_written(told: dict[str, Any], where: str) -> HowWritten:
    how = HowWritten(**{key: told[key] for key in _WRITTEN if key in told})
    for name, value, fits, words in (
        ("separator", how.separator, lambda x: isinstance(x, str) and len(x) == 1, "one character"),
        ("decimal", how.decimal, lambda x: x in (".", ","), '"." or ","'),
        ("skip", how.skip, lambda x: type(x) is int and 0 <= x < 10**6, "a number of lines"),
        ("encoding", how.encoding, lambda x: isinstance(x, str), "a name such as utf-8"),
    ):
        if value is not None and not fits(value):
            raise InputError(f"{where}: {name} must be {words}, but is {shown(value)}")
    return how


def _missing(told: dict[str, Any], where: str) -> tuple[float | str, ...]:
    given = told.get("missing", [])
    given = given if isinstance(given, list) else [given]
    for value in given:
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise InputError(
                f"{where}: missing must be a number or a text, or a list of them, but has {shown(value)}"
            )
    return tuple(given)


def _size(unit: str, wanted: str, where: str) -> float:
    try:
        return read(f"1 {unit}", wanted)
    except ValueError as error:
        raise InputError(f"{where}: its unit {error}") from None


def _found(table: Table, name: str, file: Path, where: str) -> Column:
    if name in table.columns:
        return table.columns[name]
    if name in table.others:
        raise InputError(f"{where}: `{name}` of `{file.name}` is {table.others[name]}, no signal")
    raise InputError(
        f"{where}: `{file.name}` has no such column: {unknown('column', name, table.columns)}"
    )


def _numbers(
    column: Column, name: str, file: Path, where: str, missing: tuple[float | str, ...]
) -> np.ndarray:
    """A column's values; `missing`: what stands for no value."""
    with reading(file):
        held = column.read()
    if isinstance(held, list):
        held = ["" if x in missing else x for x in held]
        values = as_numbers(held)
        if isinstance(values, int):
            row, line, value = values + 1, column.lines[values], held[values]
            raise InputError(
                f"{where}: row {row} of column `{name}` in `{file.name}` (line {line}) is {value!r}, no "
                f"number: correct it, leave it empty where the value is missing, or say missing = {value!r}"
            )
    else:
        values = real_numbers(held, f"{where}: column `{name}` of `{file.name}`")
    for number in missing:
        if not isinstance(number, str):
            values = np.where(values == float(number), np.nan, values)
    return values
