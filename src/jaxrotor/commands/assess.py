"""What `jaxrotor assess` does: one table of what [standards] asks for, with verdicts, sources, and the
parameters that move each number most."""

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.files import folder_written_whole, save_json, written_whole
from ..core.readable import amount
from ..core.result_text import table_of
from ..core.version import installed_version
from ..standards.finding import Finding
from ..standards.sensitivities import by_percent, derivatives
from ..study.assessed import Assessed, Item
from ..study.assessing import assessed
from ..study.study import Study
from .assess_figures import save_figures
from .made import made_of
from .options import study_name

# 1 is what an unforeseen error of Python ends with
MET, NOT_MET = 0, 4
_MOVERS = 3
# Of the largest change: what is smaller is no mover.
_LEAST = 1e-3


class Row(NamedTuple):
    """A finding, and what a parameter that grows by 1 % adds to its room (its value, where it has no limit),
    the most first; in the finding's unit."""

    item: Item
    movers: dict[str, float]

    @property
    def finding(self) -> Finding:
        return self.item.finding

    @property
    def verdict(self) -> str:
        if self.finding.sense == "for information":
            return "-"
        if bool(self.finding.met):
            return "met"
        return "NOT MET" if self.item.decides else "asks for level 2"


def assess_study(study: Study, gradients: bool, quiet: bool) -> tuple[Assessed, list[Row]]:
    """All findings. Raises `InputError` where the study asks for none."""
    if study.standards is None and study.torsional is None:
        raise InputError(
            "`standards`: is missing: write [standards] with speeds and what is to be assessed "
            "(`jaxrotor assess --help` shows it)"
        )
    found = assessed(study.machine, study.standards, study.torsional, gradients)
    if not gradients:
        return found, [Row(item, {}) for item in found.items]
    slopes = _with_bar([item.moves for item in found.items], quiet)
    return found, [
        Row(item, by_percent(study.machine, each)) for item, each in zip(found.items, slopes)
    ]


def _with_bar(moves: list[Any], quiet: bool) -> list[dict[str, np.ndarray]]:
    from tqdm import tqdm

    with tqdm(desc="sensitivities", disable=True if quiet else None, delay=2.0, leave=False) as bar:

        def step(done: int, of: int) -> None:
            bar.total = of
            bar.update(done - bar.n)

        return derivatives(moves, step)


def run_assess(study: Study, out: Path | None, gradients: bool, quiet: bool, force: bool) -> int:
    """Prints the table, writes it with figures and summary.json. Returns the exit status: 0 where all is met,
    4 where something is not."""
    if not quiet:
        print(f"{study.title or study.name}: assessing", file=sys.stderr)
    found, rows = assess_study(study, gradients, quiet)
    folder = out if out is not None else Path("results") / f"{study.name}_assess"
    with folder_written_whole(folder, force) as part:
        for name, text in (("table.txt", text_of(rows)), ("table.md", markdown_of(rows))):
            with written_whole(part / name) as file:
                Path(file).write_text(text + "\n")
        save_figures(study, found, part)
        save_json(part / "summary.json", summary_of(study, rows))
        names = sorted(p.name for p in part.iterdir())
    print(f"{study.title or study.name}\n")
    print(text_of(rows))
    missed = [row for row in rows if row.verdict == "NOT MET"]
    print("\nall that was asked for is met" if not missed else f"\n{len(missed)} NOT MET")
    print(f"{folder}/: {', '.join(names)}")
    return NOT_MET if missed else MET


def table(rows: list[Row]) -> list[tuple[str, ...]]:
    """Texts, the header first."""
    moved = any(row.movers for row in rows)
    header = ("check", "where", "value", "limit", "verdict", "source")
    lines: list[tuple[str, ...]] = [header + (("room by +1 % of",) if moved else ())]
    for row in rows:
        one = row.finding
        told = one.sense == "for information"
        limit = "-" if told else f"{one.sense} {_said(one.limit, one.unit)}"
        line = (
            one.check,
            one.place,
            _said(one.value, one.unit),
            limit,
            row.verdict,
            one.source or "-",
        )
        lines.append(line + ((movers_of(row),) if moved else ()))
    return lines


def movers_of(row: Row) -> str:
    """ "shaft 2.diameter: +0.8 %; ..." """
    top = largest(row.movers)
    unit = row.finding.unit
    return "; ".join(f"{path}: {_signed(change, unit)}" for path, change in top.items()) or "-"


def largest(movers: dict[str, float]) -> dict[str, float]:
    """The three that change it most; what is a thousandth of the first is none."""
    order = sorted(movers, key=lambda path: -abs(movers[path]))[:_MOVERS]
    return {p: movers[p] for p in order if abs(movers[p]) > _LEAST * abs(movers[order[0]])}


def _said(value: Any, unit: str) -> str:
    return amount(np.asarray(value), unit, digits=4)


def _signed(value: float, unit: str) -> str:
    text = amount(np.asarray(value), unit, digits=2)
    return text if value < 0 else f"+{text}"


def text_of(rows: list[Row]) -> str:
    """For the terminal: what moves a number stands below it."""
    lines = table(rows)
    plain = table_of([line[:5] for line in lines]).splitlines()
    out = plain[:2]
    for words, line in zip(lines[1:], plain[2:]):
        out.append(line)
        if len(words) > 6 and words[6] != "-":
            out.append(f"    by +1 % of {words[6]}")
    sources = dict.fromkeys(line[5] for line in lines[1:])
    checks = {
        source: dict.fromkeys(x[0] for x in lines[1:] if x[5] == source) for source in sources
    }
    out += ["", "sources"]
    out += [f"  {', '.join(each)}: {source}" for source, each in checks.items()]
    return "\n".join(out)


def markdown_of(rows: list[Row]) -> str:
    header, *lines = table(rows)
    out = [header, tuple("---" for _ in header), *lines]
    return "\n".join("| " + " | ".join(x.replace("|", "\\|") for x in line) + " |" for line in out)


def summary_of(study: Study, rows: list[Row]) -> dict[str, Any]:
    return {
        "study": study_name(study),
        "made": made_of(study),
        "version": installed_version(),
        "met": not any(row.verdict == "NOT MET" for row in rows),
        "findings": [_plain(row) for row in rows],
    }


def _plain(row: Row) -> dict[str, Any]:
    one = row.finding
    value, limit = float(one.value), float(one.limit)
    room = float(one.room)
    return {
        "check": one.check,
        "place": one.place,
        "value": value if np.isfinite(value) else str(value),
        "limit": limit if np.isfinite(limit) else None,
        "sense": one.sense,
        "unit": one.unit,
        "room": room if np.isfinite(room) else None,
        "verdict": row.verdict,
        "source": one.source,
        "room_by_one_percent": dict(sorted(row.movers.items(), key=lambda x: -abs(x[1]))),
    }
