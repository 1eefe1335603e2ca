"""What a result shows of itself: what it holds, how much of it, from where to where, in which unit."""

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

import numpy as np
from jax import Array, ShapeDtypeStruct

from .arguments import short
from .readable import amount

Result = TypeVar("Result")
# Of a line, and of a list in it; digits of a number.
WIDTH, ROOM, DIGITS = 100, 75, 4
# The unit of a frequency that is kept in rad/s and shown in Hz.
HERTZ = "rad/s as Hz"


def shows(*, without: Iterable[str] = (), **units: str) -> Callable[[type[Result]], type[Result]]:
    """Gives a result (a NamedTuple, a dataclass, a module) its `__repr__`.

    `units`: of its fields, SI; of a property too, which is shown behind them. `"@unit"` is what its field
    `unit` says. `without`: fields that are left out.
    """
    hidden = frozenset(without)

    def text(self: Any) -> str:
        names = [name for name in _fields(self) if name not in hidden]
        names += [name for name in units if name not in names]
        shown = [(name, _said(self, name, units.get(name, ""))) for name in names]
        return laid_out(type(self).__name__, shown)

    def decorate(cls: type[Result]) -> type[Result]:
        cls.__repr__ = text
        return cls

    return decorate


def laid_out(title: str, shown: list[tuple[str, str]]) -> str:
    """On one line where that is enough, else a line for each."""
    whole = f"{title}({', '.join(f'{name}={text}' for name, text in shown)})"
    if len(whole) <= WIDTH and "\n" not in whole:
        return whole
    size = max(len(name) for name, _ in shown)
    return "\n".join([title, *(cut(f"  {name:{size}}  {text}") for name, text in shown)])


def table_of(rows: list[tuple[str, ...]]) -> str:
    """Lines of text with a rule below the first, which heads the columns."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths)).rstrip() for row in rows]
    return "\n".join([lines[0], "-" * max(map(len, lines)), *lines[1:]])


def cut(line: str) -> str:
    """No longer than a screen is wide."""
    line = line.partition("\n")[0]
    return line if len(line) <= WIDTH else line[: WIDTH - 4] + " ..."


def listed(names: Iterable[str], width: int) -> str:
    """Names between commas, the middle of a long list left out."""
    names = list(names)
    kept = len(names)
    while True:
        first, last = names[: (kept + 1) // 2], names[len(names) - kept // 2 :]
        left = len(names) - kept
        text = ", ".join([*first, f"... {left} more ...", *last] if left else names)
        if len(text) <= width or kept <= 2:
            return text
        kept -= 1


def _fields(result: Any) -> list[str]:
    if hasattr(result, "_fields"):  # a NamedTuple
        return list(result._fields)
    return [field.name for field in dataclasses.fields(result) if field.repr]


def _said(result: Any, name: str, unit: str) -> str:
    value = getattr(result, name, None)
    if unit.startswith("@"):
        unit = str(getattr(result, unit[1:], ""))
    return told(value, unit)


def told(value: Any, unit: str = "") -> str:
    """One entry of a result."""
    if isinstance(value, (bool, str)) or value is None:
        return repr(value)
    if isinstance(value, (int, float, complex, np.ndarray, np.generic, Array, ShapeDtypeStruct)):
        return amount(value, unit, DIGITS)
    if isinstance(value, Mapping):
        return f"{{{listed((f'{k}: {told(v, unit)}' for k, v in value.items()), ROOM)}}}"
    if hasattr(value, "_fields") or dataclasses.is_dataclass(value):  # modules too
        return repr(value).partition("\n")[0]
    if isinstance(value, (tuple, list)):
        if _are_texts(value):
            return f"[{listed(value, ROOM)}]"
        if all(map(_are_texts, value)):  # ("main", "x")
            return f"[{listed(map('.'.join, value), ROOM)}]"
        inside = ", ".join(told(one, unit) for one in value)
        return (
            f"[{inside}]" if len(inside) <= ROOM else f"{len(value)} of {type(value[0]).__name__}"
        )
    return short(value)


def _are_texts(value: Any) -> bool:
    return isinstance(value, (tuple, list)) and all(isinstance(one, str) for one in value)
