"""The page of a result that has no layout of its own: what its summary says, and its figures."""

from collections.abc import Mapping
from typing import Any

from .page import Chapter, Part, Table
from .parts import closing_chapters, machine_chapter, told
from .result import Result

_APART = ("study", "title", "source", "versions", "settings", "solver", "timings", "made")


def chapters(result: Result) -> list[Chapter]:
    summary = {k: v for k, v in result.summary.items() if k not in _APART}
    single = [(k.replace("_", " "), told(v)) for k, v in summary.items() if not _many(v)]
    parts: list[Part] = [Table("Results", ("what", "value"), single)] if single else []
    for key, value in summary.items():
        if _many(value):
            parts += _table(key, value)
    closing = closing_chapters(result)
    return [machine_chapter(result), Chapter("Results", parts), *closing]


def _many(value: Any) -> bool:
    inner = value.values() if isinstance(value, Mapping) else value
    return isinstance(value, (Mapping, list)) and any(isinstance(x, Mapping) for x in inner)


def _table(key: str, value: Any) -> list[Part]:
    """Rows of one kind, as far as their entries are plain."""
    named = isinstance(value, Mapping)
    rows = list(value.items()) if named else [(str(k + 1), x) for k, x in enumerate(value)]
    rows = [(name, row) for name, row in rows if isinstance(row, Mapping)]
    heads = list(dict.fromkeys(k for _, row in rows for k in row if not _many(row[k])))
    first = "name" if named else "number"
    body = [(name, *(told(row[h]) if h in row else "-" for h in heads)) for name, row in rows]
    words = [h.replace("_", " ") for h in heads]
    return [Table(key.replace("_", " ").capitalize(), (first, *words), body)] if heads else []
