"""What every reader of a file gives: columns by name."""

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core.errors import InputError

# What NumPy's kinds of numbers hold; integers and floats alone are signals.
_KINDS = {
    "b": "truth values",
    "c": "complex numbers",
    "M": "dates",
    "m": "durations",
    "O": "objects",
    "S": "texts",
    "T": "texts",
    "U": "texts",
    "V": "records",
}


class Column(NamedTuple):
    """`read()`: the values, an array; they are read when they are asked for. `unit`: in the words of the
    file, "" where it tells none. `times()`: the instants, s, of a signal that knows how it was sampled.
    `lines`: where the rows stand in a text file, from 1; its `read()` gives texts."""

    read: Callable[[], Any]
    unit: str = ""
    times: Callable[[], np.ndarray] | None = None
    lines: Sequence[int] = ()


class Table(NamedTuple):
    """`notes`: what was found out about the file. `others`: what else is in it, by name: no columns.
    `single`: those of them that are one number."""

    columns: dict[str, Column]
    notes: tuple[str, ...] = ()
    others: dict[str, str] = {}
    single: dict[str, float] = {}


def even(start: float, step: float, count: int) -> Callable[[], np.ndarray]:
    """Instants of an even sampling, for a column."""
    return lambda: start + step * np.arange(count)


def real_numbers(values: np.ndarray, place: str) -> np.ndarray:
    """float64; `InputError` for whatever is no integer and no float."""
    if values.dtype.kind in "iuf":
        return np.asarray(values, float)
    held = _KINDS.get(values.dtype.kind, str(values.dtype))
    raise InputError(f"{place} holds {held} and not real numbers: write it as numbers")


class Gathering:
    """A table in the making, from arrays of any shape."""

    def __init__(self):
        self.columns: dict[str, Column] = {}
        self.notes: list[str] = []
        self.others: dict[str, str] = {}
        self.single: dict[str, float] = {}

    def table(self) -> Table:
        return Table(self.columns, tuple(self.notes), self.others, self.single)

    def add(
        self, name: str, shape: tuple[int, ...], read: Callable[[], np.ndarray], unit: str = ""
    ) -> None:
        """A row, or a column, is one signal; of a matrix the longer side is time, and its signals are
        name[0], name[1] ..."""
        long = tuple(n for n in shape if n != 1)
        if 0 in long:
            self.others[name] = "empty"
        elif len(long) == 1:
            self.columns[name] = Column(lambda: read().ravel(), unit)
        elif len(long) == 2:
            upright = long[0] >= long[1]
            count = long[1] if upright else long[0]
            once = functools.cache(read)  # not for each of its signals
            for k in range(count):
                self.columns[f"{name}[{k}]"] = Column(_line(once, long, upright, k), unit)
            side = "columns" if upright else "rows"
            self.notes.append(
                f"the {count} {side} of `{name}` are `{name}[0]` to `{name}[{count - 1}]`"
            )
        elif long:
            self.others[name] = f"an array of {' x '.join(map(str, shape))}"
        else:
            value = read().ravel()[0]
            self.others[name] = f"one number, {value}"
            if np.asarray(value).dtype.kind in "iuf":
                self.single[name] = float(value)


def _line(
    read: Callable[[], np.ndarray], shape: tuple[int, ...], upright: bool, k: int
) -> Callable[[], np.ndarray]:
    """One column, or one row, of a matrix."""
    return lambda: read().reshape(shape)[:, k] if upright else read().reshape(shape)[k]
