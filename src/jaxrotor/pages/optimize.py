"""The page of an optimisation: what was gained and by which values, what holds it back, the search."""

import numpy as np

from ..plot.labels import number
from .charts import BLUE, GREEN, GREY, Curve, Panel, stacked
from .linear import read_columns
from .page import Chapter, Interactive, Part, Table
from .parts import alike, closing_chapters, machine_chapter, told, warnings_of
from .result import Result

_MET, _LEAST = 1e-3, 1e-8


def chapters(result: Result) -> list[Chapter]:
    summary = result.summary
    parts: list[Part] = []
    if summary.get("interrupted"):
        parts += warnings_of(["The search was stopped: this is the best design so far."])
    elif summary.get("converged") is False:
        parts += warnings_of([f"The search did not converge: {summary.get('stopped')}"])
    one = summary["objective"]
    (before, after), unit = alike([one["before"], one["after"]], one["unit"])
    gained = 100 * (one["after"] / one["before"] - 1) if one["before"] else 0.0
    header = ("objective", "unit", "before", "after", "change")
    parts.append(
        Table(
            "The objective", header, [(one["name"], unit or "-", before, after, f"{gained:+.3g} %")]
        )
    )
    rows = []
    for path, own in summary["parameters"].items():
        values, unit = alike([own["before"], own["after"]], own["unit"])
        rows.append((path, unit or "-", *values))
    parts.append(Table("Parameters", ("parameter", "unit", "before", "after"), rows))
    if held := summary.get("constraints"):
        heads = [k for k in held[0] if not isinstance(held[0][k], (list, dict))]
        rows = [tuple(told(c[k]) for k in heads) for c in held]
        parts.append(Table("Constraints", [h.replace("_", " ") for h in heads], rows))
    found = [Chapter("What was gained", parts)]
    drawn: list[str] = []
    if (result.folder / "history.csv").is_file():
        found.append(Chapter("The search", [_history(result)]))
        drawn.append("history")
    return [*found, machine_chapter(result), *closing_chapters(result, drawn)]


def _history(result: Result) -> Interactive:
    columns = read_columns(result.folder / "history.csv")
    at, search, value, missed = columns.values()
    kept = np.where(np.isfinite(value) & (missed <= _MET), value, np.inf)
    best = np.minimum.accumulate(kept)
    best = np.where(np.isfinite(best), best, np.nan)
    unit = result.summary["objective"]["unit"]
    before = result.summary["objective"]["before"]
    sound = value[np.isfinite(value)]
    wide = sound.size and sound.min() > 0 and sound.max() > 5 * sound.min()
    dots = {"mode": "markers", "marker": {"size": 5}}
    curves = [
        Curve("evaluated", at, value, GREY, dots),
        Curve("best so far within bounds", at, best, BLUE, {"line": {"shape": "hv", "width": 2}}),
        Curve(
            "before",
            np.array([at[0], at[-1]]),
            np.full(2, before),
            "#D0442E",
            {"line": {"dash": "dash"}},
        ),
    ]
    axis = {"type": "log", "exponentformat": "power"} if wide else {}
    panels = [Panel("Objective", f"objective, {unit}" if unit else "objective", curves, axis)]
    if np.any(missed > 0):
        look = {"mode": "lines+markers", "line": {"width": 1}}
        bounds = [Curve("missed", at, np.maximum(missed, _LEAST), GREEN, look)]
        axis = {"type": "log", "exponentformat": "power"}
        panels.append(Panel("Bounds missed by, as part of their limit", "part", bounds, axis))
    searches = int(search[-1])
    more = f" of {searches} searches, one after the other" if searches > 1 else ""
    words = f"{number(float(at[-1]))} evaluations{more}"
    return Interactive(words, stacked(panels, "evaluation"))
