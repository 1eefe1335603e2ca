"""Figures of plotly.js in plain values: panels above each other over one axis, orbits, maps, bars."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from ..plot.style import turning_points
from .thin import envelope, thinned

# Readable on white and on black; a quantity has one colour throughout a page.
BLUE, ORANGE, GREEN, PURPLE = "#2583C6", "#E0661A", "#15977A", "#B0609F"
GOLD, CYAN, GREY = "#C98A00", "#4FA9D8", "#8A929C"
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, GOLD, CYAN, GREY)
OF_AXIS = {"x": BLUE, "y": ORANGE, "z": GREEN}
# Beyond so many turning points a line across the page is a smear: its envelope is drawn too.
_DENSE, _BAND, _TURNS, _SIDE = 300, 240, 6, 3
FAINT = 0.22
_HEAD, _FOOT, _ROW, _GAP = 34, 56, 190, 34


@dataclass(frozen=True)
class Curve:
    """`y` over `x`, in the units of the axes. `more`: attributes of the trace."""

    name: str
    x: np.ndarray
    y: np.ndarray
    colour: str = BLUE
    more: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Panel:
    """`label`: of the axis, with its unit. `axis`: attributes of it, such as a logarithmic type."""

    title: str
    label: str
    curves: Sequence[Curve]
    axis: dict[str, Any] = field(default_factory=dict)


def plain(values: Any, digits: int = 5) -> list[Any]:
    """Numbers with so many digits; `None` for what is not finite, as JSON has no word for it."""
    array = np.asarray(values, float)
    if array.ndim > 1:
        return [plain(row, digits) for row in array]
    return [float(f"{v:.{digits}g}") if np.isfinite(v) else None for v in array.tolist()]


def stacked(
    panels: Sequence[Panel], x_label: str, x_axis: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Panels above each other that are zoomed together along `x`."""
    count = len(panels)
    inside = count * _ROW + (count - 1) * _GAP
    layout: dict[str, Any] = {
        "height": _HEAD + _FOOT + inside,
        "margin": {"l": 78, "r": 150, "t": _HEAD, "b": _FOOT},
        "hovermode": "closest",
        "xaxis": {"title": {"text": x_label}, "anchor": _axis("y", count), **(x_axis or {})},
        "annotations": [],
        "legend": {"x": 1.01, "y": 1, "tracegroupgap": 6, "itemsizing": "constant"},
    }
    traces: list[dict[str, Any]] = []
    shown: set[str] = set()
    for k, panel in enumerate(panels):
        top = 1 - k * (_ROW + _GAP) / inside
        domain = [max(0.0, top - _ROW / inside), top]
        layout[f"yaxis{k + 1 if k else ''}"] = {
            "title": {"text": panel.label},
            "domain": [round(d, 4) for d in domain],
            **panel.axis,
        }
        layout["annotations"].append(heading(panel.title, domain[1]))
        for curve in panel.curves:
            for trace in drawn(curve):
                name = trace.get("legendgroup", "")
                first = trace.pop("titled") and name not in shown and bool(name)
                if first:
                    shown.add(name)
                traces.append({**trace, "yaxis": _axis("y", k + 1), "showlegend": first})
    if len(shown) < 2:
        layout["margin"]["r"], layout["showlegend"] = 24, False
    return {"data": traces, "layout": layout}


def heading(words: str, top: float, x: float = 0.0) -> dict[str, Any]:
    """Words above the left end of a panel that ends at `top` of the paper."""
    return {
        "text": f"<b>{_text(words)}</b>",
        "xref": "paper",
        "yref": "paper",
        "x": x,
        "y": top,
        "xanchor": "left",
        "yanchor": "bottom",
        "yshift": 5,
        "showarrow": False,
    }


def drawn(curve: Curve) -> list[dict[str, Any]]:
    """Its traces: a line; of one too dense for a line its envelope, filled so that what is behind shows, and
    its thin trace inside. Long ones are thinned."""
    x, y = np.asarray(curve.x, float), np.asarray(curve.y, float)
    keep = thinned(y)
    mode = curve.more.get("mode", "lines")
    base: dict[str, Any] = {
        "type": "scatter",
        "mode": mode,
        "x": plain(x[keep]),
        "y": plain(y[keep]),
        "name": _text(curve.name),
        "legendgroup": _text(curve.name),
        "line": {"color": curve.colour, "width": 1.6},
        "titled": True,
    }
    if "markers" in mode:
        base["marker"] = {"color": curve.colour, "size": 5}
    finite = y[np.isfinite(y)]
    turns = len(turning_points(y)) if mode == "lines" and finite.size == y.size else 0
    dense = turns > _DENSE
    if not dense or not np.all(np.diff(x) > 0):
        if dense:
            base["line"] = {"color": curve.colour, "width": 0.7}
        return [_merged(base, curve.more)]
    # some turns in each stretch, and the neighbours' peaks: else the envelope would follow each pulse
    at, low, high = envelope(x, y, min(_BAND, turns // _TURNS))
    low, high = minimum_filter1d(low, _SIDE), maximum_filter1d(high, _SIDE)
    edge = {
        "type": "scatter",
        "mode": "lines",
        "line": {"width": 1, "color": translucent(curve.colour, 0.75)},
        "hoverinfo": "skip",
        "legendgroup": _text(curve.name),
        "titled": False,
    }
    fill = {"fill": "tonexty", "fillcolor": translucent(curve.colour, 0.2)}
    # faint as long as it is a smear: page.js draws it in full where one zooms in
    inside = {"line": {"color": curve.colour, "width": 0.8}, "opacity": FAINT, "meta": "dense"}
    # its name stands by the edge, which has its colour in full
    base["titled"] = False
    return [
        {**edge, "x": plain(at), "y": plain(low), "name": base["name"], "titled": True},
        {**edge, **fill, "x": plain(at), "y": plain(high)},
        _merged({**base, **inside}, curve.more),
    ]


def _merged(base: dict[str, Any], more: dict[str, Any]) -> dict[str, Any]:
    out = dict(base)
    for key, value in more.items():
        own = out.get(key)
        out[key] = {**own, **value} if isinstance(own, dict) and isinstance(value, dict) else value
    return out


def translucent(colour: str, part: float) -> str:
    r, g, b = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({r},{g},{b},{part})"


def _axis(letter: str, number: int) -> str:
    return letter if number == 1 else f"{letter}{number}"


def _text(words: str) -> str:
    """Plotly reads a few tags of HTML."""
    return words.replace("&", "&amp;").replace("<", "&lt;")


def squares(
    panels: Sequence[tuple[str, Sequence[Curve]]], unit: str, columns: int = 3
) -> dict[str, Any]:
    """Orbits: panels side by side, x and y to one scale, all of them to the same."""
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    side, gap = 250, 0.09
    wide = (1 - gap * (columns - 1)) / columns
    tall = 1.0 if rows == 1 else (1 - 0.16 * (rows - 1)) / rows
    layout: dict[str, Any] = {
        "height": 110 + rows * (side + 50),
        "margin": {"l": 70, "r": 20, "t": _HEAD, "b": 90},
        "hovermode": "closest",
        "annotations": [],
        "legend": {"orientation": "h", "y": -60 / (rows * (side + 50)), "yanchor": "top", "x": 0},
    }
    traces, shown = [], set()
    for k, (title, curves) in enumerate(panels):
        row, column = divmod(k, columns)
        left = column * (wide + gap)
        top = 1 - row * (tall + 0.16)
        suffix = "" if k == 0 else str(k + 1)
        layout[f"xaxis{suffix}"] = {
            "domain": [round(left, 4), round(left + wide, 4)],
            "anchor": f"y{suffix}",
            "title": {"text": f"x, {unit}"},
            "constrain": "domain",
        }
        layout[f"yaxis{suffix}"] = {
            "domain": [round(max(0.0, top - tall), 4), round(top, 4)],
            "anchor": f"x{suffix}",
            "scaleanchor": f"x{suffix}",
            "title": {"text": f"y, {unit}" if column == 0 else ""},
            "constrain": "domain",
        }
        layout["annotations"].append(heading(title, top, left))
        for curve in curves:
            trace = _merged(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": plain(curve.x),
                    "y": plain(curve.y),
                    "name": _text(curve.name),
                    "legendgroup": _text(curve.name),
                    "line": {"color": curve.colour, "width": 1.4},
                },
                curve.more,
            )
            trace |= {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
            traces.append({**trace, "showlegend": curve.name not in shown})
            shown.add(curve.name)
    return {"data": traces, "layout": layout}
