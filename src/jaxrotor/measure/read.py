"""Measured runs from files: CSV, Parquet or netCDF, with a small TOML that says which column is what."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import path
from ..document import read_document
from ..errors import InputError
from ..gate import takes
from ..machine.wiring import unknown
from ..units import known_unit, quantity, read
from .record import Record, Series

_FILE_KEYS = ("file", "time", "name", "offset", "sort", "missing", "channels")
_CHANNEL_KEYS = ("column", "unit", "file", "time", "offset", "sort", "missing")


@takes(path=path)
def read_record(path: str | os.PathLike) -> Record:
    """A recorded run, described by a TOML file such as

    ```toml
    file = "run_up.csv"                    # .csv, .parquet or .nc, beside this file
    time = { column = "t", unit = "ms" }
    missing = -9999.0                      # what stands for a missing value; empty and nan always do

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

    `sort = true` sorts the rows by time; without it rows out of order are refused. Raises `InputError` with
    file, column and row for whatever cannot be read or makes no sense.
    """
    place = Path(path)
    told = read_document(place, "file, time and [channels.NAME]")
    _keys(told, _FILE_KEYS, f"`{place}`")
    channels = told.get("channels")
    if not isinstance(channels, dict) or not channels:
        raise InputError(f"`{place}`: names no channel: write [channels.NAME] with column and unit")
    tables: dict[Path, Any] = {}
    series = {}
    for name, own in channels.items():
        where = f"`{place}`: channels.{name}"
        if not isinstance(own, dict):
            raise InputError(f"{where} must be a table with column and unit, but is {own!r}")
        _keys(own, _CHANNEL_KEYS, where)
        series[name] = _series({**told, **own}, place.parent, where, tables)
    return Record(series, str(told.get("name", place.stem)))


def _keys(given: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in given:
        if key not in known:
            raise InputError(f"{where}: {unknown('key', key, known)}")


def _series(told: dict[str, Any], folder: Path, where: str, tables: dict[Path, Any]) -> Series:
    for key in ("file", "time", "column"):
        if key not in told:
            raise InputError(f"{where}: `{key}` is missing")
    file = folder / str(told["file"])
    if file not in tables:
        tables[file] = _table(file)
    table = tables[file]
    clock = told["time"] if isinstance(told["time"], dict) else {"column": told["time"]}
    t, own = _column(table, clock.get("column", ""), file, where)
    values, unit = _column(table, told["column"], file, where)
    t = t * _size(clock.get("unit", own or "s"), "s", f"{where}.time")
    if "offset" in told:
        t = t + quantity(told["offset"], "s")
    unit = str(told.get("unit", unit))
    if not known_unit(unit):
        raise InputError(f"{where}: `{unit}` is no unit")
    if "missing" in told:
        values = np.where(values == float(told["missing"]), np.nan, values)
    if told.get("sort", False):
        order = np.argsort(t, kind="stable")
        t, values = t[order], values[order]
    return Series(t, values, unit, f"`{file.name}`: {told['column']}")


def _size(unit: str, wanted: str, where: str) -> float:
    try:
        return read(f"1 {unit}", wanted)
    except ValueError as error:
        raise InputError(f"{where}: its unit {error}") from None


def _table(file: Path) -> Any:
    """Columns by name, with their units where the file tells them."""
    import pandas

    if not file.is_file():
        raise InputError(f"`{file}`: there is no such file")
    kind = file.suffix.lower()
    try:
        if kind in (".csv", ".txt", ".dat"):
            return pandas.read_csv(file, comment="#", skipinitialspace=True)
        if kind == ".parquet":
            return pandas.read_parquet(file)
        if kind in (".nc", ".h5", ".netcdf"):
            import xarray

            with xarray.open_dataset(file, engine="h5netcdf") as data:
                return data.load()
    except ImportError:
        raise InputError(
            f"`{file}`: reading Parquet needs pyarrow: pip install 'jaxrotor[data]'"
        ) from None
    except Exception as error:  # each reader has its own dozen
        first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise InputError(f"`{file}`: cannot be read: {first}") from None
    raise InputError(f"`{file}`: is neither .csv, .parquet nor .nc")


def _column(table: Any, name: str, file: Path, where: str) -> tuple[np.ndarray, str]:
    known = [str(k) for k in (table.columns if hasattr(table, "columns") else table.variables)]
    if name not in known:
        raise InputError(
            f"{where}: `{file.name}` has no such column: {unknown('column', name, known)}"
        )
    column = table[name]
    unit = str(getattr(column, "attrs", {}).get("units", ""))
    try:
        return np.asarray(column, float), unit
    except (TypeError, ValueError):
        for row, value in enumerate(np.asarray(column, object)):
            try:
                float(value)
            except (TypeError, ValueError):
                raise InputError(
                    f"{where}: row {row + 1} of column `{name}` in `{file.name}` is {value!r}, no number: "
                    "correct it, or leave it empty where the value is missing"
                ) from None
        raise
