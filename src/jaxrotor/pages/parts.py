"""Chapters that every page has: the machine, the study as written, how it was made; numbers in tables."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..plot.labels import number, readable
from .page import Chapter, Figure, Part, Source, Table, Warnings, Words
from .result import Result


def machine_chapter(result: Result) -> Chapter:
    """Drawing and parts, as far as the study can be read."""
    from ..plot.machine import draw_machine

    parts: list[Part] = []
    source = result.summary.get("source") or (result.study.source if result.study else "")
    if source:
        parts.append(Words(f"Source: {source}"))
    if result.study is None:
        return Chapter("Machine", [*parts, *map(Words, result.told)])
    machine = result.study.machine
    parts.append(Figure("The machine, side view to scale", lambda: draw_machine(machine), True))
    rows = [
        (name, type(one).__name__, _where(machine, name))
        for name, one in machine.elements().items()
    ]
    parts.append(Table("Its parts", ("part", "kind", "joins, or acts on"), rows))
    return Chapter("Machine", [*parts, *map(Words, result.told)])


def _where(machine: Any, name: str) -> str:
    return ", ".join(machine.connections().get(name, ()))


def warnings_of(sentences: Iterable[str]) -> list[Part]:
    found = [one for one in sentences if one]
    return [Warnings(found)] if found else []


def closing_chapters(result: Result, drawn: Iterable[str] = ()) -> list[Chapter]:
    """What pictures are left in the folder (those that were `drawn` go without), the study, its making."""
    out = []
    pictures = [] if result.lone else sorted(result.folder.glob("*.png"))
    pictures = [p for p in pictures if p.stem not in set(drawn)]
    if pictures:
        figures = [Figure(_caption(p), p.read_bytes) for p in pictures]
        out.append(Chapter("Other figures", figures))
    if result.text:
        name = Path(str(result.summary.get("study", "study.toml"))).name
        out.append(Chapter("Study as it was written", [Source(name, result.text)]))
    out.append(Chapter("How it was made", [_making(result)]))
    return out


def _caption(path: Path) -> str:
    return path.stem.lstrip("0123456789").strip("_").replace("_", " ").capitalize() or path.stem


def _making(result: Result) -> Table:
    summary, made = result.summary, result.made
    rows: list[tuple[str, str]] = []

    def add(what: str, value: Any) -> None:
        if value not in (None, "", {}, []):
            rows.append((what, value if isinstance(value, str) else told(value)))

    add("command", made.get("command"))
    add("study", summary.get("study"))
    add("date", made.get("date"))
    versions = summary.get("versions") or {"jaxrotor": made.get("jaxrotor")}
    add("versions", ", ".join(f"{k} {v}" for k, v in versions.items() if v))
    for key, value in (summary.get("settings") or {}).items():
        add(f"setting {key}", value)
    for key, value in (summary.get("solver") or {}).items():
        add(key.replace("_", " "), value)
    for key, value in (summary.get("timings") or {}).items():
        add(key.removesuffix("_s").replace("_", " "), f"{told(value)} s")
    if "seconds" in summary:
        add("seconds", summary["seconds"])
    add("folder", str(result.folder))
    return Table("How it was made", ("what", "value"), rows)


def told(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value)
    if isinstance(value, (list, tuple)):
        return ", ".join(map(told, value))
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {told(v)}" for k, v in value.items())
    return str(value)


def shown(value: float | None, unit: str, digits: int = 4) -> str:
    """A value in SI with a unit that suits it."""
    if value is None or not np.isfinite(value):
        return "-"
    size, words = readable(unit, [value])
    return f"{size * value:.{digits}g} {words}".strip()


def alike(values: Sequence[float | None], unit: str) -> tuple[list[str], str]:
    """Several in one unit, and that unit."""
    finite = [v for v in values if v is not None and np.isfinite(v)]
    size, words = readable(unit, finite or [0.0])
    return ["-" if v is None or not np.isfinite(v) else number(size * v) for v in values], words
