"""The pages of linear analysis: Campbell diagram, response over frequency, modes."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..plot.labels import readable
from .charts import BLUE, COLOURS, GREEN, GREY, ORANGE, PURPLE, Curve, Panel, stacked
from .page import Chapter, Interactive, Part, Table, Words
from .parts import closing_chapters, machine_chapter, shown
from .result import Result

RPM, HERTZ = 30 / np.pi, 1 / (2 * np.pi)
# Colour and dash of each kind of mode.
_LOOKS = {
    "forward": (BLUE, "solid"),
    "backward": (ORANGE, "dash"),
    "torsional": (GREEN, "dashdot"),
    "axial": (PURPLE, "dot"),
}
# Magnitudes that span more have a logarithmic axis.
_WIDE = 100.0


def chapters(result: Result) -> list[Chapter]:
    laid = {"campbell": _campbell, "response": _response, "modes": _modes}[result.kind]
    parts, drawn = laid(result)
    title = {"campbell": "Campbell diagram", "response": "Response", "modes": "Modes"}[result.kind]
    closing = closing_chapters(result, drawn)
    return [Chapter(title, parts), machine_chapter(result), *closing]


def read_columns(path: Path) -> dict[str, np.ndarray]:
    """Columns of a table of numbers. Raises `InputError` where it is missing or damaged."""
    try:
        with open(path, newline="", encoding="utf-8") as lines:
            header, *rows = csv.reader(lines)
        values = np.array([[float(x) for x in row] for row in rows]).reshape(-1, len(header))
    except (OSError, ValueError) as error:
        what = "is missing" if isinstance(error, FileNotFoundError) else "is damaged"
        raise InputError(f"`{path}`: {what}: run the command again") from None
    return dict(zip(header, values.T))


def _campbell(result: Result) -> tuple[list[Part], list[str]]:
    columns = read_columns(result.folder / "campbell.csv")
    rpm = RPM * columns["speed, rad/s"]
    names = [str(n) for n in result.summary["modes"]]
    critical = result.summary.get("critical_speeds_rad_s") or {}
    orders = [float(k.removesuffix("x")) for k in critical]
    reach = max(orders, default=1.0) * float(rpm.max()) / 60
    curves, damping, rows = [], [], []
    for name in names:
        hertz = HERTZ * columns[f"{name}, rad/s"]
        ratio = columns[f"{name}, damping ratio"]
        kind = next((k for k in _LOOKS if k in name), "")
        colour, dash = _LOOKS.get(kind, (GREY, "solid"))
        rows.append((name, f"{hertz[-1]:.5g}", f"{60 * hertz[-1]:.5g}", f"{ratio[-1]:.4g}"))
        if np.nanmin(np.where(hertz > 0, hertz, np.nan), initial=np.inf) > 2.5 * reach:
            continue
        # overdamped at this speed: it does not oscillate
        hertz = np.where((hertz > 0) & (ratio < 0.9999), hertz, np.nan)
        look = {"line": {"dash": dash}, "showlegend": False}
        curves.append(Curve(name, rpm, hertz, colour, look))
        damping.append(Curve(name, rpm, np.where(np.isfinite(hertz), ratio, np.nan), colour, look))
    lines = [
        Curve(
            f"{order:g} per turn",
            np.array([0.0, rpm.max()]),
            np.array([0.0, order * rpm.max() / 60]),
            GREY,
            {"line": {"dash": "dot", "width": 1.2}},
        )
        for order in orders
    ]
    marks = _crossings(result.summary)
    highest = max((float(np.max(c.y[np.isfinite(c.y)], initial=0.0)) for c in curves), default=0.0)
    top = 1.06 * min(max(highest, reach), 2.5 * reach)
    panels = [Panel("Frequencies", "frequency, Hz", [*lines, *curves, *marks], {"range": [0, top]})]
    ratios = np.concatenate([c.y for c in damping]) if damping else np.zeros(1)
    if np.nanmax(np.abs(ratios), initial=0.0) > 1e-9:
        panels.append(Panel("Damping", "damping ratio", damping))
    spec = stacked(panels, "speed, rpm", {"range": [0.0, float(rpm.max())]})
    spec["layout"]["height"] += 160
    _weigh(spec, 1.9)
    _keyed(spec, {_kind_of(c.colour) for c in curves})
    words = (
        "Natural frequencies over speed; blue: forward, orange dashed: backward, green: torsional, grey: "
        "mixed. Diamonds: critical speeds, undamped"
    )
    parts: list[Part] = [Interactive(words, spec)]
    for key, speeds in critical.items():
        kinds = (result.summary.get("critical_kinds") or {}).get(key, [""] * len(speeds))
        own = (result.summary.get("critical_modes") or {}).get(key, [""] * len(speeds))
        table = [
            (n, f"{RPM * w:.6g}", f"{HERTZ * w * float(key.removesuffix('x')):.5g}", k)
            for n, w, k in zip(own, speeds, kinds)
        ]
        if table:
            header = ("mode", "speed, rpm", "frequency, Hz", "kind")
            parts.append(
                Table(f"Critical speeds at {key.removesuffix('x')} per turn", header, table)
            )
        else:
            parts.append(Words(f"No critical speed at {key.removesuffix('x')} per turn."))
    header = ("mode", "frequency, Hz", "cycles/min", "damping ratio")
    parts.append(Table(f"Modes at {rpm[-1]:.5g} rpm", header, rows))
    return parts, ["campbell"]


def _kind_of(colour: str) -> str:
    return next((k for k, (c, _) in _LOOKS.items() if c == colour), "mixed")


def _keyed(spec: dict[str, Any], kinds: set[str]) -> None:
    """A legend of kinds in place of one of every mode; a mode's name is told where the mouse is."""
    shown: set[str] = set()
    for trace in spec["data"]:
        colour = trace["line"]["color"]
        if "markers" in trace["mode"] or trace["line"].get("dash") == "dot":
            continue
        kind = _kind_of(colour)
        trace["hovertemplate"] = f"{trace['name']}<br>%{{x:.5g}} rpm, %{{y:.5g}}<extra></extra>"
        trace |= {"name": kind, "legendgroup": kind, "showlegend": kind not in shown}
        shown.add(kind)
    spec["layout"]["margin"]["r"], spec["layout"]["showlegend"] = 150, True


def _weigh(spec: dict[str, Any], first: float) -> None:
    """Makes the first of two panels so many times as high as the second."""
    layout = spec["layout"]
    if "yaxis2" not in layout:
        return
    gap = 0.11
    low = (1 - gap) / (1 + first)
    layout["yaxis"]["domain"], layout["yaxis2"]["domain"] = [low + gap, 1.0], [0.0, low]
    layout["annotations"][1]["y"] = low


def _crossings(summary: Mapping[str, Any]) -> list[Curve]:
    found = []
    for key, speeds in (summary.get("critical_speeds_rad_s") or {}).items():
        order = float(key.removesuffix("x"))
        kinds = (summary.get("critical_kinds") or {}).get(key, [])
        excited = [w for w, k in zip(speeds, kinds or ["lateral"] * len(speeds)) if k == "lateral"]
        if excited:
            w = np.array(excited)
            look = {
                "mode": "markers",
                "marker": {"symbol": "diamond", "size": 9, "color": "#B3261E"},
            }
            found.append(Curve("critical speed", RPM * w, order * HERTZ * w, "#B3261E", look))
    return found


def _response(result: Result) -> tuple[list[Part], list[str]]:
    columns = read_columns(result.folder / "response.csv")
    first, *rest = columns
    unbalance = first.startswith("speed")
    along = (RPM if unbalance else HERTZ) * columns[first]
    order = np.argsort(along)
    panels: dict[str, list[Curve]] = {}
    phases: list[Curve] = []
    units: dict[str, str] = {}
    for k, name in enumerate(rest[::2]):
        line, _, unit = name.rpartition(", ")
        units[line] = unit
        colour = COLOURS[k % len(COLOURS)]
        # y lies on x where the supports are alike
        look = {"line": {"dash": "dash"}} if line.endswith((".y", ".theta")) else {}
        curve = Curve(line, along[order], columns[name][order], colour, look)
        panels.setdefault(unit, []).append(curve)
        turn = np.degrees(np.unwrap(columns[rest[2 * k + 1]][order]))
        phases.append(Curve(line, along[order], turn, colour, look))
    drawn = []
    for unit, curves in panels.items():
        values = np.concatenate([c.y for c in curves])
        size, words = readable(unit, values)
        top, usual = float(values.max()), float(np.median(values[values > 0], axis=None))
        wide = top > _WIDE * usual or not unbalance
        axis = {"type": "log", "exponentformat": "power"} if wide else {"rangemode": "tozero"}
        scaled = [Curve(c.name, c.x, size * c.y, c.colour, c.more) for c in curves]
        drawn.append(Panel("Amplitude", f"amplitude, {words}", scaled, axis))
    drawn.append(Panel("Phase", "phase, degrees", phases, {"dtick": 90}))
    x_label = "speed, rpm" if unbalance else "frequency, Hz"
    spec = stacked(drawn, x_label, {"range": [float(along.min()), float(along.max())]})
    critical = RPM * np.array(result.summary.get("critical_speeds_rad_s") or [])
    spec["layout"]["shapes"] = [
        {"type": "line", "x0": w, "x1": w, "y0": 0, "y1": 1, "yref": "paper",
         "line": {"color": GREY, "width": 1, "dash": "dot"}}
        for w in critical.tolist()
    ]  # fmt: skip
    what = "unbalance" if unbalance else "a harmonic force"
    dotted = "; dotted: undamped critical speeds" if critical.size else ""
    rows = [
        (
            name,
            shown(one["amplitude"], one["unit"]) if one.get("bounded", True) else "without bound",
            f"{RPM * one['at_rad_s']:.6g}",
            f"{HERTZ * one['at_rad_s']:.5g}",
        )
        for name, one in result.summary["peaks"].items()
    ]
    header = ("output", "largest amplitude", "at, rpm" if unbalance else "at, cycles/min", "at, Hz")
    return [
        Interactive(f"Response to {what}{dotted}", spec),
        Table("Largest amplitudes", header, rows),
    ], ["bode"]


def _modes(result: Result) -> tuple[list[Part], list[str]]:
    rows = []
    for one in result.summary["modes"]:
        rows.append(
            (
                str(one["name"]),
                f"{HERTZ * one['frequency_rad_s']:.5g}",
                f"{RPM * one['frequency_rad_s']:.5g}",
                f"{one['damping_ratio']:.4g}",
                f"{one['log_decrement']:.4g}" if one["log_decrement"] is not None else "-",
                f"{one['whirl']:+.2f}" if one["whirl"] is not None else "-",
                ", ".join(f"{100 * v:.0f} % {k}" for k, v in one["energy"].items() if v > 0.005),
            )
        )
    header = (
        "mode", "frequency, Hz", "cycles/min", "damping ratio", "log decrement", "whirl (+1 forward)",
        "energy",
    )  # fmt: skip
    at = RPM * float(result.summary["speed_rad_s"])
    return [Table(f"Modes at {at:.6g} rpm", header, rows)], []
