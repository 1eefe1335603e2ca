"""The page of an identification: what was found, how well it is met, what is told apart."""

import csv
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..plot.labels import number
from .charts import BLUE, COLOURS, GREY, ORANGE, Curve, Panel, plain, stacked
from .page import Chapter, Interactive, Part, Table, Words
from .parts import closing_chapters, machine_chapter, shown, warnings_of
from .result import Result

# Values that are drawn as dots; channels that are drawn.
_DOTS, _MOST = 400, 8
_FIT = "fit.csv"


def chapters(result: Result) -> list[Chapter]:
    summary = result.summary
    found = [Chapter("What was found", _found(summary))]
    parts, drawn = _fits(result)
    if parts:
        found.append(Chapter("Measured and identified", parts))
    found.append(Chapter("What is told apart", _apart(summary)))
    if summary.get("costs"):
        found.append(Chapter("The search", _search(summary)))
        drawn.append("cost")
    closing = closing_chapters(result, [*drawn, "correlation"])
    return [*found, machine_chapter(result), *closing]


def _found(summary: Any) -> list[Part]:
    rows = []
    for path, one in summary["parameters"].items():
        low, high = one.get("interval_95_by_profile") or one["interval_95"]
        known = None not in (low, high)
        between = (
            f"{shown(low, one['unit'], 5)} to {shown(high, one['unit'], 5)}" if known else "open"
        )
        rows.append(
            (path, shown(one["value"], one["unit"], 6), shown(one["std"], one["unit"]), between)
        )
    told = list(summary.get("warnings") or [])
    if summary.get("interrupted"):
        told.insert(0, "The search was stopped: these are the estimates so far.")
    elif summary.get("came_to_rest") is False:
        told.insert(0, "The search did not come to rest: give it more iterations.")
    profile = any("interval_95_by_profile" in one for one in summary["parameters"].values())
    how = "by profile" if profile else "by standard deviation"
    header = ("parameter", "estimate", "standard deviation", f"95 % interval, {how}")
    count = summary.get("values_compared")
    words = f"{count} measured values were compared; loss: {summary.get('loss', 'squares')}."
    return [*warnings_of(told), Table("Parameters", header, rows), Words(words)]


def _read(result: Result) -> list[dict[str, Any]]:
    """Channels, with their values; none where an earlier version left no table."""
    path = result.folder / _FIT
    if not path.is_file():
        return []
    channels: dict[tuple[str, str], dict[str, Any]] = {}
    try:
        with open(path, newline="", encoding="utf-8") as lines:
            _, *rows = csv.reader(lines)
        for run, channel, unit, over, *values in rows:
            own = channels.setdefault(
                (run, channel),
                {"run": run, "channel": channel, "unit": unit, "over": over, "rows": []},
            )
            own["rows"].append([float(x) if x else 0.0 for x in values])
    except (OSError, ValueError):
        raise InputError(f"`{path}`: is damaged: run the command again") from None
    out = []
    for one in channels.values():
        at, seen, told, seen_im, told_im = np.array(one.pop("rows")).T
        vectors = bool(np.any(seen_im) or np.any(told_im))
        order = np.argsort(at, kind="stable")
        one["at"] = at[order] * (30 / np.pi if one["over"] == "speed" else 1.0)
        one["measured"] = (seen + 1j * seen_im if vectors else seen)[order]
        one["identified"] = (told + 1j * told_im if vectors else told)[order]
        out.append(one)
    return out


def _fits(result: Result) -> tuple[list[Part], list[str]]:
    channels = _read(result)
    if not channels:
        return [], []
    stds = {(c["run"], c["channel"]): c for c in result.summary["channels"]}
    several = len({one["run"] for one in channels}) > 1
    parts: list[Part] = []
    for one in channels[:_MOST]:
        name = f"{one['channel']} of {one['run']}" if several else one["channel"]
        unit = f", {one['unit'].replace('um', 'µm')}" if one["unit"] else ""
        seen, told, at = one["measured"], one["identified"], one["at"]
        dots = {"mode": "markers", "marker": {"size": 5}} if len(at) < _DOTS else {}
        vectors = np.iscomplexobj(seen)
        sizes = (abs(seen), abs(told)) if vectors else (seen, told)
        curves = [
            Curve("measured", at, sizes[0], GREY, dots),
            Curve("identified", at, sizes[1], BLUE),
        ]
        panels = [Panel(name, f"{'size' if vectors else 'value'}{unit}", curves)]
        if vectors:
            turn = np.angle(seen, deg=True)
            near = turn - np.angle(seen / np.where(told == 0, 1, told), deg=True)
            curves = [
                Curve("measured", at, turn, GREY, dots),
                Curve("identified", at, near, BLUE),
            ]
            panels.append(Panel("Phase", "degrees", curves))
        rest, std = seen - told, stds.get((one["run"], one["channel"]), {}).get("std")
        left = [Curve("left over", at, np.real(rest), ORANGE, dots)]
        if vectors:
            left = [
                Curve("left over, real", at, np.real(rest), ORANGE, dots),
                Curve("left over, imaginary", at, np.imag(rest), COLOURS[2], dots),
            ]
        if std:
            ends = np.array([at[0], at[-1]])
            look = {"line": {"dash": "dash", "width": 1.2}}
            left += [
                Curve("2 std of the noise", ends, np.full(2, side * std), COLOURS[3], look)
                for side in (-2.0, 2.0)
            ]
        panels.append(Panel("What is left", f"left over{unit}", left))
        label = "time, s" if one["over"] == "time" else "speed, rpm"
        white = stds.get((one["run"], one["channel"]), {}).get("white")
        chance = "" if white is None else f"; chance that what is left is white noise: {white:.2g}"
        ends = {"range": [float(at.min()), float(at.max())]} if len(at) > 1 and not dots else {}
        parts.append(Interactive(f"{name}{chance}", stacked(panels, label, ends)))
    if len(channels) > _MOST:
        parts.append(Words(f"The first {_MOST} of {len(channels)} channels; {_FIT} has all."))
    numbers = ("std", "rms_residual", "white")
    rows = [
        (c["run"], c["channel"], c["unit"] or "-", *(_short(c[key]) for key in numbers))
        for c in result.summary["channels"]
    ]
    header = (
        "run",
        "channel",
        "unit",
        "std of the noise",
        "rms of what is left",
        "chance of white noise",
    )
    return [*parts, Table("Channels", header, rows)], ["fit"]


def _short(value: float | None) -> str:
    return "-" if value is None else number(float(value))


def _apart(summary: Any) -> list[Part]:
    paths = list(summary["parameters"])
    values = np.array(summary["correlation"], float).reshape(len(paths), -1)
    words = [[f"{r:.2f}" if np.isfinite(r) else "unseen" for r in row] for row in values]
    spec = {
        "data": [
            {
                "type": "heatmap",
                "x": paths,
                "y": paths,
                "z": plain(values, 3),
                "text": words,
                "texttemplate": "%{text}",
                "zmin": -1,
                "zmax": 1,
                "colorscale": [[0, "#2166AC"], [0.5, "#F4F4F4"], [1, "#B2182B"]],
                "hovertemplate": "%{x}<br>%{y}<br>%{z}<extra></extra>",
                "colorbar": {"thickness": 14, "outlinewidth": 0},
                "xgap": 2,
                "ygap": 2,
            }
        ],
        "layout": {
            "height": 190 + 42 * len(paths),
            "margin": {"l": 40, "r": 20, "t": 20, "b": 40},
            "xaxis": {"showgrid": False, "tickangle": -30},
            "yaxis": {"showgrid": False, "autorange": "reversed"},
        },
    }
    words = "Correlation of the estimates: at 1 or -1 only a combination of two is known"
    parts: list[Part] = [Interactive(words, spec)] if len(paths) > 1 else []
    blind = summary.get("blind") or []
    if blind:
        told = "; ".join(" with ".join(direction) for direction in blind)
        parts.append(Words(f"What the measurements do not tell: {told}."))
    singular = [f"{x:.3g}" for x in summary.get("singular_values") or []]
    parts.append(Words(f"Singular values of what is known: {', '.join(singular)}."))
    return parts


def _search(summary: Any) -> list[Part]:
    curves, first = [], 1
    for k, (name, cost) in enumerate(summary["costs"].items()):
        at = np.arange(first, first + len(cost))
        look = {"mode": "lines+markers"}
        curves.append(Curve(name, at, np.array(cost, float), COLOURS[k % len(COLOURS)], look))
        first += len(cost)
    panel = Panel("Cost", "cost", curves, {"type": "log", "exponentformat": "power"})
    words = "Half the sum of squared residuals, in standard deviations, at each iteration"
    return [Interactive(words, stacked([panel], "iteration", {"dtick": max(1, first // 12)}))]
