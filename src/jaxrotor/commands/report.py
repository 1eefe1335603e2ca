"""What `jaxrotor report` does: the assessment as one document, laid out in the order of the field."""

import datetime
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.files import written_whole
from ..core.version import installed_version
from ..pages.page import Chapter, Figure, Table, Words, page
from ..study.assessed import Assessed
from ..study.study import Study
from .assess import MET, NOT_MET, Row, assess_study, table
from .assess_figures import figures_of
from .options import RPM, study_name
from .report_parts import campbell, orbits, static, support_map

_LATERAL = ("amplification factor", "separation margin")
_RESPONSE = ("amplitude at probes, pp", "scale factor", "scaled amplitude in clearance, pp")


def run_report(study: Study, out: Path | None, gradients: bool, quiet: bool) -> int:
    """Writes the document; returns the exit status of `jaxrotor assess`."""
    target = out if out is not None else Path("results") / f"{study.name}_report.html"
    if target.suffix.lower() not in (".html", ".htm"):
        raise InputError(f'`{target}`: must end in .html, but ends in "{target.suffix}"')
    if not quiet:
        print(f"{study.title or study.name}: assessing", file=sys.stderr)
    found, rows = assess_study(study, gradients, quiet)
    chapters = list(_chapters(study, found, rows))
    date = datetime.date.today().isoformat()
    made = (
        f"Laid out in the order of API 617. Made by jaxrotor {installed_version()} from {study_name(study)}, "
        f"{date}."
    )
    with written_whole(target) as file:
        Path(file).write_text(page(study.title or study.name, made, chapters), encoding="utf-8")
    missed = [row for row in rows if row.verdict == "NOT MET"]
    for row in missed:
        print(f"NOT MET: {row.finding.check}, {row.finding.place}")
    print(target)
    return NOT_MET if missed else MET


def _chapters(study: Study, found: Assessed, rows: list[Row]) -> Iterator[Chapter]:
    drawn = {stem: Figure(caption, draw) for stem, caption, draw in figures_of(study, found)}

    def of(*starts: str) -> list[Any]:
        return [one for stem, one in drawn.items() if stem.startswith(starts)]

    def told(caption: str, wanted: Callable[[str], bool]) -> list[Any]:
        kept = [row for row in rows if wanted(row.finding.check)]
        if not kept:
            return []
        header, *lines = table(kept)
        return [Table(caption, header, lines)]

    if study.source:
        yield Chapter("Machine", [Words(study.source), *_layout(study)])
    else:
        yield Chapter("Machine", _layout(study))
    yield Chapter("Static deflection and bearing loads", static(study))
    if study.standards is not None:
        top = study.standards.trip or study.standards.greatest
        yield Chapter("Undamped critical speed map", support_map(study))
        yield Chapter("Damped natural frequencies (Campbell diagram)", campbell(study, 1.25 * top))
    if found.cases:
        yield Chapter("Mode shapes with the unbalance placed", of("unbalance"))
    if found.separations:
        parts = [
            *of("response"),
            *told("Amplification factors and separation margins", lambda c: c in _LATERAL),
            *told("Vibration and clearances", lambda c: c in _RESPONSE),
        ]
        yield Chapter("Response to unbalance", parts)
        yield Chapter("Orbits at the greatest speed", orbits(study, found))
    first = told("Level 1", lambda c: c.startswith("level 1"))
    if first:
        yield Chapter("Stability, level 1", [*of("stability", "screening"), *first])
    second = told("Level 2", lambda c: c.startswith("level 2"))
    if second:
        yield Chapter("Stability, level 2", [*_modes(study), *second])
    if found.torsional_speeds is not None:
        parts = told("Torsion", lambda c: "torsional" in c or "stress" in c or "torque" in c)
        yield Chapter("Torsion", [*of("interference"), *parts])
    missed = sum(row.verdict == "NOT MET" for row in rows)
    words = (
        "All that was asked for is met." if not missed else f"{missed} of the limits are not met."
    )
    words += (
        " The last column tells by how much the room to the limit grows where a parameter grows by 1 %: the "
        "three that count most."
        if any(row.movers for row in rows)
        else ""
    )
    yield Chapter("Summary", [Words(words), *told("All that was assessed", lambda c: True)])


def _layout(study: Study) -> list[Any]:
    from ..plot.machine import draw_machine

    return [Figure("The machine, side view to scale", lambda: draw_machine(study.machine))]


def _modes(study: Study) -> list[Any]:
    from ..linear.linearise import linearize
    from ..linear.modes import modes

    speed = study.standards.greatest
    found = [
        m
        for m in modes(linearize(study.machine, speed, study.standards.state), 8)
        if m.kind == "lateral"
    ]
    lines = [
        (m.name, f"{RPM * m.frequency:.5g}", f"{m.log_decrement:.4g}", f"{m.whirl:+.2f}")
        for m in found
    ]
    header = ("mode", "frequency, cycles/min", "log decrement", "whirl (+1 forward)")
    return [Table(f"Lateral modes at {RPM * speed:.5g} rpm", header, lines)]
