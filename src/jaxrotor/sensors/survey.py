"""What is in a file of measured data, before anybody has said which column is what."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.units import factor
from .formats.kinds import read_table, reading
from .formats.spelling import group_and_name, told_unit, unit_in
from .formats.table import Column, Table, even, real_numbers
from .formats.text import HowWritten, as_numbers
from .record import Record

_TIME = re.compile(r"(t|time|zeit|temps|tiempo|tempo|time[ _]?stamp|elapsed|x[ _]?axis)([ _]?m?s)?")
_RATES = (
    "fs",
    "rate",
    "samplerate",
    "samplingrate",
    "samplefrequency",
    "samplingfrequency",
    "fsample",
)
_STEPS = ("dt", "deltat", "timestep", "xincrement", "samplingtime", "sampleinterval")
# Of its steps: an axis of time rises but for faults.
_RISES = 0.9


class Signal(NamedTuple):
    """`t`: s, `None` where nothing tells it. `unit`: "" where nobody knows it, `why` says what the file has
    instead. `clock`: what a record file says of its time; `{}`: the file itself tells it."""

    name: str
    t: np.ndarray | None
    values: np.ndarray
    unit: str
    clock: dict[str, str] | None = None
    why: str = ""


class Survey(NamedTuple):
    """`notes`: how the file was read; `guesses`: what was guessed; `left_out`: what else the file holds."""

    file: Path
    signals: list[Signal]
    notes: list[str]
    guesses: list[str]
    left_out: dict[str, str]


def of_record(file: Path, record: Record) -> Survey:
    """Of what a record file describes."""
    signals = [Signal(k, s.t, s.values, s.unit, {}) for k, s in record.series.items()]
    return Survey(file, signals, list(record.notes), [], {})


def survey(file: Path) -> Survey:
    """Every column of numbers in a data file. Raises `InputError` where there is none."""
    table = read_table(file, HowWritten(), frozenset(), 1)
    left_out = dict(table.others)
    numbers: dict[str, np.ndarray] = {}
    for name, column in table.columns.items():
        found = _numbers(file, name, column)
        if isinstance(found, str):
            left_out[name] = found
        else:
            numbers[name] = found
    times = [name for name, values in numbers.items() if _is_time(name, values)]
    guesses: list[str] = []
    rate = _rate(table, guesses)
    signals: list[Signal] = []
    for name, values in numbers.items():
        column = table.columns[name]
        if name in times and column.times is None and len(numbers) > 1:
            continue
        unit, why = _unit(name, column)
        t, clock = None, None
        if column.times is not None:
            t, clock = column.times()[: len(values)], {}
        elif (
            over := _nearest(name, [k for k in times if numbers[k].size == values.size])
        ) and over != name:
            size, clock = _clock(over, table.columns[over], guesses)
            t = size * numbers[over]
        elif rate:
            clock = rate[0]
            t = even(0.0, rate[1], len(values))()
        signals.append(Signal(name, t, values, unit, clock, why))
    used = {one.clock["column"] for one in signals if one.clock and "column" in one.clock}
    left_out |= {name: "a time that is no signal's" for name in times if name not in used}
    if not signals:
        raise InputError(f"`{file}`: holds no column of numbers: is it the right file?")
    return Survey(file, signals, list(table.notes), list(dict.fromkeys(guesses)), left_out)


def _numbers(file: Path, name: str, column: Column) -> np.ndarray | str:
    """What a column holds, or why it is left out."""
    with reading(file):
        held = column.read()
    if isinstance(held, list):
        found = as_numbers(held)
        if isinstance(found, int):
            return f"no column of numbers (line {column.lines[found]} has {held[found]!r})"
        return found if np.isfinite(found).any() else "empty"
    try:
        return real_numbers(held, name)
    except InputError:
        return f"no column of real numbers ({held.dtype})"


def _is_time(name: str, values: np.ndarray) -> bool:
    if not _TIME.fullmatch(group_and_name(name)[1].lower()) or values.size < 2:
        return False
    return bool(np.mean(np.diff(values) > 0) >= _RISES)


def _nearest(name: str, times: list[str]) -> str:
    """The axis of time in the same group, else the first."""
    group = group_and_name(name)[0]
    return next((k for k in times if group_and_name(k)[0] == group), times[0] if times else "")


def _clock(name: str, column: Column, guesses: list[str]) -> tuple[float, dict[str, str]]:
    """Seconds a unit of the axis of time, and what a record file says of it."""
    unit = _unit(name, column)[0]
    size = factor(unit, "s") if unit else None
    said = f"in {unit}" if size else "in s, for nothing says otherwise"
    guesses.append(f"`{name}` is the time, {said}")
    return size or 1.0, {"column": name, "unit": unit if size else "s"}


def _unit(name: str, column: Column) -> tuple[str, str]:
    """By the file, or by the column's name; and why there is none."""
    unit, why = told_unit(column.unit)
    return (unit, why) if unit or why else told_unit(unit_in(name))


def _rate(table: Table, guesses: list[str]) -> tuple[dict[str, str], float] | None:
    """What a record file says of the rate that stands in the file as a number, and the step, s."""
    for name, value in table.single.items():
        bare = re.sub(r"[ _]", "", group_and_name(name)[1]).lower()
        if value > 0 and bare in _RATES:
            guesses.append(f"`{name}` is the rate of what has no time: {value:g} Hz")
            return {"rate": f"{value!r} Hz"}, 1.0 / value
        if value > 0 and bare in _STEPS:
            guesses.append(f"`{name}` is the step of what has no time: {value:g} s")
            return {"step": f"{value!r} s"}, value
    return None
