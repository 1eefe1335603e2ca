"""What every reader of a file gives: columns by name."""

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
    """`notes`: what was found out about the file. `others`: what else is in it, by name: no columns."""

    columns: dict[str, Column]
    notes: tuple[str, ...] = ()
    others: dict[str, str] = {}


def even(start: float, step: float, count: int) -> Callable[[], np.ndarray]:
    """Instants of an even sampling, for a column."""
    return lambda: start + step * np.arange(count)


def real_numbers(values: np.ndarray, place: str) -> np.ndarray:
    """float64; `InputError` for whatever is no integer and no float."""
    if values.dtype.kind in "iuf":
        return np.asarray(values, float)
    held = _KINDS.get(values.dtype.kind, str(values.dtype))
    raise InputError(f"{place} holds {held} and not real numbers: write it as numbers")


def signals(
    name: str, shape: tuple[int, ...], read: Callable[[], np.ndarray], unit: str = ""
) -> tuple[dict[str, Column], str]:
    """The columns of a stored array, and a note or the words for what it is instead. A row, or a column, is
    one signal; of a matrix the longer side is time, and its signals are name[0], name[1] ..."""
    long = tuple(n for n in shape if n != 1)
    if len(long) == 1:
        return {name: Column(lambda: read().ravel(), unit)}, ""
    if len(long) != 2:
        size = " x ".join(map(str, shape))
        return {}, f"an array of {size}" if long else "one number"
    if 0 in long:
        return {}, "empty"
    upright = long[0] >= long[1]

    def signal(k: int) -> Column:
        def values() -> np.ndarray:
            matrix = read().reshape(long)
            return matrix[:, k] if upright else matrix[k]

        return Column(values, unit)

    side, count = ("columns", long[1]) if upright else ("rows", long[0])
    note = f"the {count} {side} of `{name}` are `{name}[0]` to `{name}[{count - 1}]`"
    return {f"{name}[{k}]": signal(k) for k in range(count)}, note
