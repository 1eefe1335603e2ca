"""Measured runs from files of any kind, with a small TOML that says which column is what."""

import os
from pathlib import Path
from typing import Any

from ..core.arguments import path
from ..core.document import read_document
from ..core.errors import InputError, refuse
from ..core.gate import takes
from .described import SHARED_KEYS, check_keys, series_of, table_of
from .formats.kinds import read_table
from .formats.table import Table
from .formats.text import HowWritten, as_numbers
from .record import Record

_FILE_KEYS = (*SHARED_KEYS, "name", "channels")
_CHANNEL_KEYS = (*SHARED_KEYS, "column", "unit", "phase", "imaginary")


@takes(path=path)
def read_record(path: str | os.PathLike[str]) -> Record:
    """A recorded run, described by a TOML file such as

    ```toml
    file = "run_up.csv"                    # beside this file; its kind is seen from what it holds
    time = { column = "t", unit = "ms" }   # or { rate = "2048 Hz" }, { step = "0.5 ms", start = "1 s" }
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

    [channels.probe]                       # vectors, for a TrackingFilter
    column = "amplitude"
    unit = "um"
    phase = { column = "lag", unit = "deg" } # or imaginary = "NAME", where column holds the real part
    ```

    `jaxrotor record FILE --init` writes one for a file. `sort = true` sorts the rows by time; without it rows
    out of order are refused. Every channel needs a unit, here or in the file (`unit = "1"` for a plain
    number); a time without one is in s.

    Files, and what `column` says there: text tables (.csv, .txt, .dat, .tsv, .asc), .parquet and netCDF a
    name; HDF5, MATLAB's .mat (7.3 too) and TDMS a path (`"group/signal"`, `"run/acceleration"` in a struct);
    WAV `"1"`, `"2"` ..., scaled to a full scale of 1; universal files (data set 58, text or binary) what the
    response is called. The signals of a matrix are `"name[0]"`, `"name[1]"` ... along its shorter side.
    `time` may be left out where the file says how it was sampled: WAV, TDMS with `wf_increment`, universal
    files.

    A text file's separator, decimal sign, encoding, a line of units and lines before the names of the
    columns are found out, and told in the record's `notes`; or give `separator` (`"\\t"`, `";"`, `" "` for
    any spaces), `decimal = ","`, `encoding = "latin-1"`, `skip` (how many lines stand before the names).
    Raises `InputError` with file, column and row for whatever cannot be read or makes no sense, and
    `MissingExtraError` without the library for Parquet (extra `data`), universal files (`uff`) or TDMS
    (`tdms`).
    """
    place = Path(path)
    told = read_document(place, "file, time and [channels.NAME]")
    check_keys(told, _FILE_KEYS, f"`{place}`")
    channels = told.get("channels")
    if not isinstance(channels, dict) or not channels:
        raise InputError(f"`{place}`: names no channel: write [channels.NAME] with column and unit")
    tables: dict[tuple[Path, HowWritten], Table] = {}
    wanted = _names(told, *channels.values())
    opened = {}
    for name, own in channels.items():
        where = f"`{place}`: channels.{name}"
        if not isinstance(own, dict):
            raise InputError(f"{where} must be a table with column and unit, but is {own!r}")
        check_keys(own, _CHANNEL_KEYS, where)
        opened[name] = table_of({**told, **own}, place.parent, where, tables, wanted)
    series, problems = {}, []
    for name, own in channels.items():
        where = f"`{place}`: channels.{name}"
        over = f"{where}.time" if "time" in own else f"`{place}`: time"
        try:
            series[name] = series_of({**told, **own}, place.parent, where, over, opened[name])
        except InputError as error:
            problems += error.problems
    refuse(dict.fromkeys(problems))
    notes = [
        f"`{key[0].name}`: {'; '.join(table.notes)}" for key, table in tables.items() if table.notes
    ]
    return Record(series, str(told.get("name", place.stem)), notes)


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


def read_columns(file: Path, wanted: frozenset[str] = frozenset()) -> dict[str, Any]:
    """The columns of a table in a file, whatever they hold; `wanted`: some of their names. Raises
    `InputError`."""
    found = {}
    for name, column in read_table(file, HowWritten(), wanted, 1).columns.items():
        held = column.read()
        numbers = as_numbers(held) if isinstance(held, list) else held
        found[name] = held if isinstance(numbers, int) else numbers
    return found
