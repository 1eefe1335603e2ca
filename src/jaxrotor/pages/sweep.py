"""The page of a sweep: percentiles, distributions, what matters, outputs over parameters, failures."""

from typing import Any

import numpy as np
import xarray as xr

from ..core.errors import InputError
from ..plot.labels import number, readable
from .charts import BLUE, COLOURS, GREY, ORANGE, Curve, Panel, plain, stacked, translucent
from .page import Chapter, Interactive, Part, Table, Words, require_plotly
from .parts import alike, closing_chapters, machine_chapter, shown, warnings_of
from .result import SWEEP, Result

_KINDS = ("percentiles", "of_the_largest", "of_the_least")
# Parameters and outputs that stand against each other; points drawn of each.
_ROWS, _COLUMNS, _POINTS = 4, 4, 1000
# Of values over time or speed: shades from the palest to the darkest.
_BANDS = ((5, 95, 0.16), (25, 75, 0.28))


def chapters(result: Result) -> list[Chapter]:
    require_plotly()
    summary, data = result.summary, _opened(result)
    found = [Chapter("At a glance", _glance(summary))]
    numbers = [n for n in summary["outputs"] if n in data and data[n].ndim == 1]
    series = [n for n in summary["outputs"] if n in data and data[n].ndim == 2]
    paths = [p for p in summary["parameters"] if p in data]
    drawn = ["distributions", "scatter", "sensitivity", "lines", *series]
    if numbers:
        found.append(Chapter("Distributions", [_histogram(n, data, summary) for n in numbers]))
        weights = summary.get("sensitivities")
        if weights:
            found.append(Chapter("What matters", _weights(weights, numbers)))
        found.append(Chapter("Outputs over parameters", [_scatter(data, paths, numbers, summary)]))
    if series:
        found.append(Chapter("Over time or speed", [_bands(n, data, summary) for n in series]))
    found += [Chapter("Parameters", _parameters(summary)), machine_chapter(result)]
    if summary.get("failures"):
        found.append(Chapter("Cases that failed", _failures(summary)))
    return [*found, *closing_chapters(result, drawn)]


def _opened(result: Result) -> xr.Dataset:
    """In the order of the table. Raises `InputError` where the store is damaged."""
    from ..sweeps.statistics import done

    path = result.folder / SWEEP
    try:
        return done(xr.open_zarr(path, consolidated=False).load())
    except ImportError:
        from ..core.errors import MissingExtraError

        raise MissingExtraError(
            'report: of a sweep needs zarr, which is not installed: pip install "jaxrotor[sweep]"'
        ) from None
    except Exception as error:  # each codec has its own
        raise InputError(
            f"`{path}`: cannot be read ({type(error).__name__}): run the sweep again"
        ) from None


def _glance(summary: Any) -> list[Part]:
    rows = []
    for name, one in summary["outputs"].items():
        kind = next(k for k in _KINDS if k in one)
        values, unit = alike([one[kind][k] for k in ("5", "50", "95")], one["unit"])
        called = name if kind == "percentiles" else f"{name}, its {kind.removeprefix('of_the_')}"
        rows.append((called, unit or "-", *values, _kept(one)))
    count, failed = summary["count"], summary["failed"]
    told = [f"{failed} of {count} cases failed: they are left out."] if failed else []
    how = str(summary["cases"])
    return [
        *warnings_of(told),
        Words(how if how.startswith(str(count)) else f"{count} cases, {how}."),
        Table("Outputs", ("output", "unit", "5 %", "50 %", "95 %", "within its limit"), rows),
    ]


def _kept(one: Any) -> str:
    limit = one.get("limit")
    if not limit:
        return "-"
    kind = "at_most" if "at_most" in limit else "at_least"
    sign = "≤" if kind == "at_most" else "≥"
    words = f"{sign} {shown(limit[kind], one['unit'])}: {limit['within']} of {one['ran']}"
    if limit.get("share") is not None:
        low, high = (100 * x for x in limit["interval_95"])
        words += f", {100 * limit['share']:.3g} % ({low:.3g} to {high:.3g} %)"
    return words


def _histogram(name: str, data: xr.Dataset, summary: Any) -> Interactive:
    one = summary["outputs"][name]
    values = np.asarray(data[name].values, float)
    values = values[np.isfinite(values)]
    size, unit = readable(one["unit"], values)
    counts, edges = np.histogram(size * values, bins=min(40, max(8, values.size // 6)))
    shapes, words = [], ""
    limit = one.get("limit") or {}
    at = limit.get("at_most", limit.get("at_least"))
    if at is not None:
        line = {"color": "#D0442E", "width": 1.5, "dash": "dash"}
        ends = {"x0": size * at, "x1": size * at, "y0": 0, "y1": 1, "yref": "paper"}
        shapes = [{"type": "line", **ends, "line": line}]
        words = f"; dashed: the limit, {_kept(one)}"
    trace = {
        "type": "bar",
        "x": plain(0.5 * (edges[1:] + edges[:-1])),
        "y": counts.tolist(),
        "width": plain(np.diff(edges)),
        "marker": {"color": translucent(BLUE, 0.75), "line": {"color": BLUE, "width": 0.5}},
        "hovertemplate": "%{x:.4g}: %{y} cases<extra></extra>",
    }
    layout = {
        "height": 250,
        "margin": {"l": 70, "r": 20, "t": 14, "b": 52},
        "xaxis": {"title": {"text": f"{name}, {unit}" if unit else name}},
        "yaxis": {"title": {"text": "cases"}},
        "shapes": shapes,
        "bargap": 0,
    }
    return Interactive(f"{name}{words}", {"data": [trace], "layout": layout})


def _weights(weights: Any, numbers: list[str]) -> list[Part]:
    kind, parts = str(weights["kind"]), []
    keys = ("first", "total") if kind == "shares of variance" else ("coefficient",)
    for name in numbers:
        if name not in weights:
            continue
        own = weights[name]["parameters"]
        # the longest bar on top
        order = sorted(own, key=lambda p: abs(own[p][keys[-1]] or 0.0))
        traces = []
        for key, colour in zip(keys, (BLUE, ORANGE)):
            values = np.array([own[p][key] or 0.0 for p in order], float)
            ends = np.array([own[p][f"{key}_interval_95"] for p in order], float)
            traces.append(
                {
                    "type": "bar",
                    "orientation": "h",
                    "y": order,
                    "x": plain(values),
                    "name": {"first": "alone", "total": "with others"}.get(key, key),
                    "marker": {"color": translucent(colour, 0.8)},
                    "error_x": {
                        "type": "data",
                        "symmetric": False,
                        "array": plain(np.maximum(ends[:, 1] - values, 0.0)),
                        "arrayminus": plain(np.maximum(values - ends[:, 0], 0.0)),
                        "thickness": 1,
                        "width": 3,
                        "color": GREY,
                    },
                    "hovertemplate": "%{y}: %{x:.3g}<extra></extra>",
                }
            )
        explained = weights[name].get("explained")
        more = (
            "" if explained is None else f", which explains {100 * explained:.0f} % of its variance"
        )
        layout = {
            "height": 110 + 34 * len(order) * len(keys),
            "margin": {"l": 40, "r": 20, "t": 14, "b": 52},
            "xaxis": {"title": {"text": "share of variance" if len(keys) == 2 else "coefficient"}},
            "yaxis": {"showgrid": False},
            "showlegend": len(keys) == 2,
            "barmode": "group",
        }
        words = f"{name}: {kind}, with 95 % intervals{more}"
        parts.append(Interactive(words, {"data": traces, "layout": layout}))
    return parts


def _scatter(data: xr.Dataset, paths: list[str], numbers: list[str], summary: Any) -> Interactive:
    columns, rows = paths[:_COLUMNS], numbers[:_ROWS]
    keep = slice(0, _POINTS)
    wide, tall = (
        (1 - 0.05 * (len(columns) - 1)) / len(columns),
        (1 - 0.06 * (len(rows) - 1)) / len(rows),
    )
    layout: dict[str, Any] = {
        "height": 90 + 190 * len(rows),
        "margin": {"l": 80, "r": 20, "t": 14, "b": 60},
        "showlegend": False,
        "hovermode": "closest",
    }
    traces = []
    for k, path in enumerate(columns):
        left = k * (wide + 0.05)
        size, unit = readable(summary["parameters"][path]["unit"], data[path].values)
        title = f"{path}, {unit}" if unit else path
        layout[f"xaxis{k + 1 if k else ''}"] = {
            "domain": [round(left, 4), round(left + wide, 4)],
            "anchor": _axis("y", len(rows)),
            "title": {"text": title, "font": {"size": 11}},
            "nticks": 5,
        }
        for i, name in enumerate(rows):
            scale, words = readable(summary["outputs"][name]["unit"], data[name].values)
            bottom = 1 - (i + 1) * tall - i * 0.06
            layout[f"yaxis{i + 1 if i else ''}"] = {
                "domain": [round(max(bottom, 0.0), 4), round(bottom + tall, 4)],
                "title": {"text": f"{name}, {words}" if words else name, "font": {"size": 11}},
                "nticks": 5,
            }
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": plain(size * data[path].values[keep]),
                    "y": plain(scale * data[name].values[keep]),
                    "xaxis": _axis("x", k + 1),
                    "yaxis": _axis("y", i + 1),
                    "marker": {"size": 4, "color": COLOURS[i % len(COLOURS)], "opacity": 0.6},
                }
            )
    more = []
    if len(paths) > len(columns):
        more.append(f"the first {len(columns)} of {len(paths)} parameters")
    if data[numbers[0]].size > _POINTS:
        more.append(f"the first {_POINTS} of {data[numbers[0]].size} cases")
    words = "Each point is a case" + (f"; {', '.join(more)}" if more else "")
    return Interactive(words, {"data": traces, "layout": layout})


def _axis(letter: str, number: int) -> str:
    return letter if number == 1 else f"{letter}{number}"


def _bands(name: str, data: xr.Dataset, summary: Any) -> Interactive:
    one, array = summary["outputs"][name], data[name]
    along = str(array.dims[1])
    x = np.asarray(data[along].values if along in data.coords else np.arange(array.shape[1]), float)
    size, unit = readable(one["unit"], array.values)
    values = size * np.asarray(array.values, float)
    sound = values[:, np.isfinite(values).any(axis=0)]
    x = x[np.isfinite(values).any(axis=0)]
    speeds = "time" not in along
    x = 30 / np.pi * x if speeds else x
    traces: list[dict[str, Any]] = []
    look = {"type": "scatter", "mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
    for low, high, shade in _BANDS:
        ends = np.nanpercentile(sound, [low, high], axis=0)
        fill = {
            "fill": "tonexty",
            "fillcolor": translucent(BLUE, shade),
            "name": f"{low} to {high} %",
        }
        traces += [
            {**look, "x": plain(x), "y": plain(ends[0]), "showlegend": False},
            {**look, **fill, "x": plain(x), "y": plain(ends[1])},
        ]
    curves = [Curve("median", x, np.nanmedian(sound, axis=0), BLUE, {"line": {"width": 2}})]
    limit = one.get("limit") or {}
    at = limit.get("at_most", limit.get("at_least"))
    if at is not None:
        ends = np.array([x[0], x[-1]])
        dash = {"line": {"dash": "dash"}}
        curves.append(Curve("limit", ends, np.full(2, size * at), "#D0442E", dash))
    panel = Panel(name, f"{name}, {unit}" if unit else name, curves)
    spec = stacked([panel], "speed, rpm" if speeds else "time, s")
    spec["data"] = traces + spec["data"]
    for trace in spec["data"]:
        trace.setdefault("showlegend", True)
    spec["layout"]["margin"]["r"], spec["layout"]["showlegend"] = 150, True
    spec["layout"]["height"] += 60
    kept = f"; {_kept(one)}" if limit else ""
    return Interactive(f"{name}, of {len(values)} cases{kept}", spec)


def _parameters(summary: Any) -> list[Part]:
    rows = []
    for path, one in summary["parameters"].items():
        values, unit = alike([one[k] for k in ("lowest", "median", "highest")], one["unit"])
        rows.append((path, unit or "-", *values))
    header = ("parameter", "unit", "lowest", "median", "highest")
    return [Table("Parameters of the cases", header, rows)]


def _failures(summary: Any) -> list[Part]:
    rows = [
        (
            str(f["case"]),
            f["why"],
            ", ".join(f"{p} = {number(v)}" for p, v in f["parameters"].items()),
        )
        for f in summary["failures"]
    ]
    return [Table("Failed cases, parameters in SI", ("case", "why", "parameters"), rows)]
