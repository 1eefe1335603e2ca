"""Measured runs from files: CSV, Parquet or netCDF, with a small TOML that says which column is what."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from ..core.arguments import path
from ..core.document import read_document
from ..core.errors import InputError, MissingExtraError
from ..core.gate import takes
from ..core.units import known_unit, quantity, read, shown
from ..machine.wiring import unknown
from .record import Record, Series
from .text_table import HowWritten, TextTable, as_numbers, read_text_table

# How a text file is written, each found out where it is left out.
_WRITTEN = HowWritten._fields
_SHARED = ("file", "time", "offset", "sort", "missing", *_WRITTEN)
_FILE_KEYS = (*_SHARED, "name", "channels")
_CHANNEL_KEYS = (*_SHARED, "column", "unit")
_TIME_KEYS = ("column", "unit")


@takes(path=path)
def read_record(path: str | os.PathLike[str]) -> Record:
    """A recorded run, described by a TOML file such as

    ```toml
    file = "run_up.csv"                    # .csv, .parquet or .nc, beside this file
    time = { column = "t", unit = "ms" }
    missing = -9999.0                      # what stands for a missing value, or several: [-9999, "n/a"]
                                           # (empty and nan always do)

    [channels.housing]                     # the name of a sensor
    column = "A3"
    unit = "m/s^2"

    [channels.tacho]                       # another rate: another file, or another time column
    file = "tacho.csv"
    time = { column = "t", unit = "s" }
    column = "n"
    unit = "rpm"
    offset = "12 ms"                       # added to its time
    ```

    `sort = true` sorts the rows by time; without it rows out of order are refused. Every channel needs a
    unit, here or in the file (`unit = "1"` for a plain number); a time without one is in s.

    A text file's separator, decimal sign, encoding, a line of units and lines before the names of the
    columns are found out, and told in the record's `notes`; or give `separator` (`"\\t"`, `";"`, `" "` for
    any spaces), `decimal = ","`, `encoding = "latin-1"`, `skip` (how many lines stand before the names).
    Raises `InputError` with file, column and row for whatever cannot be read or makes no sense, and
    `MissingExtraError` for a Parquet file without pyarrow (extra `data`).
    """
    place = Path(path)
    told = read_document(place, "file, time and [channels.NAME]")
    _keys(told, _FILE_KEYS, f"`{place}`")
    channels = told.get("channels")
    if not isinstance(channels, dict) or not channels:
        raise InputError(f"`{place}`: names no channel: write [channels.NAME] with column and unit")
    tables: dict[tuple, Any] = {}
    series = {}
    wanted = _names(told, *channels.values())
    for name, own in channels.items():
        where = f"`{place}`: channels.{name}"
        if not isinstance(own, dict):
            raise InputError(f"{where} must be a table with column and unit, but is {own!r}")
        _keys(own, _CHANNEL_KEYS, where)
        series[name] = _series({**told, **own}, place.parent, where, tables, wanted)
    notes = [
        f"`{key[0].name}`: {'; '.join(table.notes)}"
        for key, table in tables.items()
        if isinstance(table, TextTable) and table.notes
    ]
    return Record(series, str(told.get("name", place.stem)), notes)


def _keys(given: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in given:
        if key not in known:
            raise InputError(f"{where}: {unknown('key', key, known)}")


def _series(
    told: dict[str, Any], folder: Path, where: str, tables: dict[tuple, Any], wanted: frozenset[str]
) -> Series:
    for key in ("file", "time", "column"):
        if key not in told:
            raise InputError(f"{where}: `{key}` is missing")
    file, how = folder / str(told["file"]), _how_written(told, where)
    if (file, how) not in tables:
        tables[file, how] = _table(file, how, wanted)
    table = tables[file, how]
    clock = told["time"] if isinstance(told["time"], dict) else {"column": told["time"]}
    _keys(clock, _TIME_KEYS, f"{where}.time")
    missing = _missing(told, where)
    t, own = _column(table, clock.get("column", ""), file, where, ())
    values, unit = _column(table, told["column"], file, where, missing)
    t = t * _size(clock.get("unit", own or "s"), "s", f"{where}.time")
    if "offset" in told:
        t = t + quantity(told["offset"], "s")
    unit = str(told.get("unit", unit))
    if not unit:
        raise InputError(
            f'{where}: `unit` is missing: write unit = "m/s^2" or the like, "1" for a plain number'
        )
    if not known_unit(unit):
        raise InputError(f"{where}: `{unit}` is no unit")
    if not isinstance(sort := told.get("sort", False), bool):
        raise InputError(f"{where}: sort must be true or false, but is {shown(sort)}")
    if sort:
        order = np.argsort(t, kind="stable")
        t, values = t[order], values[order]
    return Series(t, values, unit, f"`{file.name}`: {told['column']}")


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


def read_columns(file: Path, wanted: frozenset[str] = frozenset()) -> dict[str, Any]:
    """The columns of a table in a file, whatever they hold; `wanted`: some of their names. Raises
    `InputError`."""
    table = _table(file, HowWritten(), wanted, 1)
    if isinstance(table, TextTable):
        return {
            name: texts if isinstance(numbers := as_numbers(texts), int) else numbers
            for name, texts in table.columns.items()
        }
    names = table.columns if hasattr(table, "columns") else table.variables
    return {str(name): np.asarray(table[name]) for name in names}


def _names(*tables: Any) -> frozenset[str]:
    """Every column that is asked for."""
    found = set()
    for told in tables:
        if isinstance(told, dict):
            time = told.get("time")
            found |= {
                str(told.get("column")),
                str(time.get("column") if isinstance(time, dict) else time),
            }
    return frozenset(found)


def _table(file: Path, how: HowWritten, wanted: frozenset[str], least: int = 2) -> Any:
    """Columns by name, with their units where the file tells them."""
    if not file.is_file():
        raise InputError(f"`{file}`: there is no such file")
    kind = file.suffix.lower()
    try:
        if kind in (".csv", ".txt", ".dat", ".tsv", ".asc"):
            return read_text_table(file, how, wanted, least)
        if kind == ".parquet":
            import pandas

            return pandas.read_parquet(file)
        if kind in (".nc", ".h5", ".netcdf"):
            import xarray

            with xarray.open_dataset(file, engine="h5netcdf") as data:
                return data.load()
    except ImportError:
        raise MissingExtraError(
            f"`{file}`: reading Parquet needs pyarrow: pip install 'jaxrotor[data]'"
        ) from None
    except InputError:
        raise
    except Exception as error:  # each reader has its own dozen
        first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise InputError(f"`{file}`: cannot be read: {first}") from None
    raise InputError(f"`{file}`: is neither .csv (.txt, .dat, .tsv, .asc), .parquet nor .nc")


def _column(
    table: Any, name: str, file: Path, where: str, missing: tuple[float | str, ...]
) -> tuple[np.ndarray, str]:
    """Values and unit of a column; `missing`: what stands for no value."""
    held = table.variables if hasattr(table, "variables") else table.columns
    known = [str(k) for k in held]
    if name not in known:
        raise InputError(
            f"{where}: `{file.name}` has no such column: {unknown('column', str(name), known)}"
        )
    if known.count(name) > 1:
        raise InputError(
            f"{where}: {known.count(name)} columns of `{file.name}` are named `{name}`: rename all but one"
        )
    if isinstance(table, TextTable):
        texts = [x for x in missing if isinstance(x, str)]
        column = (
            ["" if x in texts else x for x in table.columns[name]] if texts else table.columns[name]
        )
        values, unit = as_numbers(column), table.units.get(name, "")
        if isinstance(values, int):
            row, line, value = values + 1, table.lines[values], column[values]
            raise InputError(
                f"{where}: row {row} of column `{name}` in `{file.name}` (line {line}) is {value!r}, no "
                f"number: correct it, leave it empty where the value is missing, or say missing = {value!r}"
            )
    else:
        column = np.asarray(table[name])
        unit = str(getattr(table[name], "attrs", {}).get("units", ""))
        if column.dtype.kind not in "iuf":
            raise InputError(
                f"{where}: column `{name}` of `{file.name}` holds {column.dtype} and not real numbers: write "
                "it as numbers"
            )
        values = np.asarray(column, float)
    for number in missing:
        if not isinstance(number, str):
            values = np.where(values == float(number), np.nan, values)
    return values, unit
