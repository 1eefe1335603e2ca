"""Pictures of a sweep: how outputs are distributed, over speed and time too, and maps of grids."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..core.errors import InputError
from ..machine.wiring import unknown
from ..sweeps.statistics import axes_of, done, numbers_of, ran_to_end, share
from .labels import number, readable
from .style import COLOURS, GREY, Given, envelope, figure, label, legend

_PERCENT = (5, 25, 50, 75, 95)
# Values that are read for one figure over time, and points beyond which only an envelope is seen.
_READ, _DENSE = 2e7, 700
# Positive values of an axis that span more than this factor have a logarithmic one.
_WIDE = 20.0
_ABOVE = dict(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)


def quantity_label(found: xr.Dataset, name: str, values: Any = None) -> tuple[float, str]:
    """By what to multiply it, and its name with the unit it is in then."""
    values = found[name].values if values is None else values
    size, unit = readable(found[name].attrs.get("units", ""), values)
    return size, f"{name}, {unit}" if unit else name


def _numbers(found: xr.Dataset, names: str | Sequence[str]) -> dict[str, np.ndarray]:
    """Those of the named outputs that are one number for each machine."""
    wanted = [names] if isinstance(names, str) else list(names)
    for name in wanted:
        if name not in found:
            raise InputError(f"names: {unknown('output', name, map(str, found.data_vars))}")
    numbers = numbers_of(found, wanted)
    if not numbers:
        raise InputError(
            f"names: none of {', '.join(wanted)} is one number for each case: draw it over time or speed, by "
            "percentile_bands or grid_over"
        )
    return numbers


def distributions(
    found: xr.Dataset,
    names: str | Sequence[str],
    limits: Mapping[str, Any] | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Of each output that is one number: a histogram, and the share of cases that do not exceed a value.
    Dashed: its limit (`limits`: name -> something with a `value` and `met`). Raises `InputError` where
    a name is no output, or none of them is one number for each case."""
    limits, numbers = limits or {}, _numbers(found, names)
    _, axes = figure(len(numbers), 2, (11.0, 0.6 + 2.9 * len(numbers)), ax)
    for (left, right), (name, values) in zip(axes, numbers.items()):
        sound = np.sort(values[np.isfinite(values)])
        size, words = quantity_label(found, name, values)
        label(left, words, "cases")
        label(right, words, "share of cases, %")
        if not sound.size:
            left.set_title(f"{name}: no case ran to its end", fontsize=10, loc="left")
            continue
        bins = int(np.clip(2 * np.cbrt(sound.size), 8, 60))
        low, high = np.percentile(sound, (5, 95))
        edges = size * np.linspace(sound[0], sound[-1], bins + 1)
        if sound[0] > 0 and high > _WIDE * low:
            edges = size * np.geomspace(sound[0], sound[-1], bins + 1)
            left.set_xscale("log")
            right.set_xscale("log")
        left.hist(size * sound, bins=edges, histtype="stepfilled", color=COLOURS[0], alpha=0.75)
        share_ = 100 * np.arange(1, sound.size + 1) / sound.size
        right.step(size * sound, share_, where="post", color=COLOURS[0], linewidth=1.4)
        right.set_ylim(-8, 104)
        right.set_yticks(range(0, 101, 20))
        for percent in (5, 50, 95):
            at = size * np.percentile(sound, percent)
            left.axvline(at, color=GREY, linewidth=0.9)
            right.plot([at], [percent], "o", color=GREY, markersize=4)
            right.annotate(
                f"{percent} %: {number(at)}", (at, percent), xytext=(6, -3),
                textcoords="offset points", fontsize=8, va="top",
            )  # fmt: skip
        if name in limits:
            one = limits[name]
            for panel in (left, right):
                panel.axvline(size * one.value, color="black", linewidth=1.1, linestyle="--")
            part, low, high = share(one.met(sound))
            unit = words.partition(", ")[2]
            right.set_title(
                f"{100 * part:.3g} % are {one} {number(size * one.value)} {unit} (dashed); "
                f"95 % interval {100 * low:.3g} to {100 * high:.3g} %",
                fontsize=9, loc="left",
            )  # fmt: skip
        left.set_title(f"{sound.size} cases; lines: 5, 50 and 95 %", fontsize=9, loc="left")
    return axes


def percentile_bands(
    found: xr.Dataset, name: str, limit: Any = None, ax: Given | None = None
) -> Axes:
    """An output over speed or time: the median, half and nine tenths of the cases that ran to their end, at
    each point. Where an oscillation is too dense to be followed, the bands enclose it. `found` may be a store
    that still grows, `xarray.open_zarr(...)`."""
    found = done(found)
    axes_ = axes_of(found)
    (along,) = (str(d) for d in found[name].dims if d not in axes_)
    x, over_speed = found[along].values, along.endswith("_speed")
    rows = int(np.prod([found.sizes[d] for d in axes_]))
    every = max(1, int(rows * len(x) / _READ))
    values = found[name].isel({along: slice(None, None, every)}).values.reshape(rows, -1)
    x, ran = x[::every], ran_to_end(found)
    low, quarter, middle, upper, high = _quantiles(values[ran])
    size, words = quantity_label(found, name, np.stack([low, high]))
    dense = not over_speed and len(x) > _DENSE
    if dense:
        window = max(3, len(x) // 250)
        low, quarter = (envelope(v, window)[0] for v in (low, quarter))
        upper, high = (envelope(v, window)[1] for v in (upper, high))
    x = x * (30 / np.pi if over_speed else 1.0)
    _, axes = figure(1, 1, (9.5, 5.0), ax)
    panel = axes[0, 0]
    sizes = dict(color=COLOURS[0], linewidth=0)
    panel.fill_between(x, size * low, size * high, alpha=0.2, label="5 to 95 %", **sizes)
    panel.fill_between(x, size * quarter, size * upper, alpha=0.4, label="25 to 75 %", **sizes)
    panel.plot(x, size * middle, color=COLOURS[1], linewidth=0.5 if dense else 1.6, label="median")
    if limit is not None:
        panel.axhline(
            size * limit.value, color="black", linewidth=1.1, linestyle="--", label="limit"
        )
    if over_speed and np.nanmin(low, initial=0.0) >= 0:
        panel.set_ylim(0, None)
    panel.set_xlim(float(x[0]), float(x[-1]))
    label(panel, "speed, rpm" if over_speed else "time, s", words)
    legend(panel, ncols=4, **_ABOVE)
    return panel


def _quantiles(values: np.ndarray) -> np.ndarray:
    """(5, n): of the cases that have a number there."""
    out = np.full((len(_PERCENT), values.shape[1]), np.nan)
    there = np.isfinite(values).any(axis=0)
    out[:, there] = np.nanpercentile(values[:, there], _PERCENT, axis=0)
    return out


def _one_axis(found: xr.Dataset) -> str:
    first, *others = axes_of(found)
    if others:
        raise InputError(
            f"this is a grid of {1 + len(others)} axes, {' and '.join((first, *others))}: take `grid_map`, "
            f'or one value of an axis, `found.isel({{"{others[-1]}": 0}})`'
        )
    return first


def grid_lines(
    found: xr.Dataset,
    names: str | Sequence[str],
    limits: Mapping[str, Any] | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Of a grid of one axis: each output that is one number, over it. Raises `InputError` where a name
    is no output, none of them is one number for each case, or the grid has more axes."""
    path = _one_axis(found)
    numbers, limits = _numbers(found, names), limits or {}
    x_size, x_words = quantity_label(found, path)
    x = x_size * found[path].values
    order = np.argsort(x)
    _, axes = figure(len(numbers), 1, (8.5, 1.0 + 2.8 * len(numbers)), ax, sharex=True)
    for panel, (name, values) in zip(axes[:, 0], numbers.items()):
        size, words = quantity_label(found, name, values)
        panel.plot(
            x[order], size * values[order], "o-", color=COLOURS[0], markersize=4, linewidth=1.3
        )
        if name in limits:
            panel.axhline(size * limits[name].value, color="black", linewidth=1.1, linestyle="--")
            panel.set_title(_dashed(limits[name], size, words), fontsize=9, loc="left")
        label(panel, "", words)
    _scaled(axes[-1, 0], found[path].values, "x")
    axes[-1, 0].set_xlabel(x_words)
    return axes[:, 0]


def grid_map(
    found: xr.Dataset,
    names: str | Sequence[str],
    limits: Mapping[str, Any] | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Of a grid of two axes: each output that is one number, as a map; dashed its limit. Cases that failed
    are white. Raises `InputError` where a name is no output, or none of them is one number for each
    case."""
    first, second = axes_of(found)
    numbers, limits = _numbers(found, names), limits or {}
    (x_size, x_words), (y_size, y_words) = (quantity_label(found, p) for p in (second, first))
    x, y = x_size * found[second].values, y_size * found[first].values
    across, up = np.argsort(x), np.argsort(y)
    columns = min(2, len(numbers)) if ax is None else len(numbers)
    rows = -(-len(numbers) // columns)
    fig, axes = figure(rows, columns, (0.6 + 6.0 * columns, 4.6 * rows), ax)
    for panel in axes.ravel()[len(numbers) :]:
        panel.set_visible(False)
    drawn = axes.ravel()[: len(numbers)]
    for panel, (name, values) in zip(drawn, numbers.items()):
        size, words = quantity_label(found, name, values)
        z = size * values.reshape(len(y), len(x))[up][:, across]
        _map(fig, panel, x[across], y[up], z, words)
        _scaled(panel, found[second].values, "x")
        _scaled(panel, found[first].values, "y")
        if name in limits and np.nanmin(z) < size * limits[name].value < np.nanmax(z):
            at = [size * limits[name].value]
            panel.contour(x[across], y[up], z, at, colors="#D55E00", linestyles="--", linewidths=2)
            panel.set_title(_dashed(limits[name], size, words), fontsize=9, loc="left")
        label(panel, x_words, y_words)
    return drawn


def grid_over(found: xr.Dataset, name: str, limit: Any = None, ax: Given | None = None) -> Axes:
    """Of a grid of one axis: an output over speed or time, a line for each value; of many values a map.
    Raises `InputError` where the grid has more axes."""
    path = _one_axis(found)
    array = found[name]
    (along,) = (str(d) for d in array.dims if d != path)
    over_speed = along.endswith("_speed")
    x = array[along].values * (30 / np.pi if over_speed else 1.0)
    order = np.argsort(found[path].values)
    values = array.values[order]
    size, words = quantity_label(found, name, values)
    p_size, p_words = quantity_label(found, path)
    at = p_size * found[path].values[order]
    fig, axes = figure(1, 1, (9.5, 5.0), ax)
    panel = axes[0, 0]
    if len(at) <= len(COLOURS):
        for k, row in enumerate(values):
            panel.plot(x, size * row, color=COLOURS[k], linewidth=1.2, label=number(at[k]))
        if limit is not None:
            panel.axhline(size * limit.value, color="black", linewidth=1.1, linestyle="--")
        legend(panel, title=p_words, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        label(panel, "speed, rpm" if over_speed else "time, s", words)
        panel.set_xlim(float(x[0]), float(x[-1]))
        return panel
    thin = max(1, len(x) // 1500)
    _map(fig, panel, x[::thin], at, size * values[:, ::thin], words)
    _scaled(panel, found[path].values, "y")
    label(panel, "speed, rpm" if over_speed else "time, s", p_words)
    return panel


def _map(fig: Figure, ax: Axes, x: np.ndarray, y: np.ndarray, z: np.ndarray, words: str) -> None:
    low, high = np.nanmin(z), np.nanmax(z)
    two_sided = low < 0 < high and min(-low, high) > 0.3 * max(-low, high)
    end = max(-low, high)
    span: dict[str, Any] = dict(cmap="RdBu_r", vmin=-end, vmax=end) if two_sided else {}
    image = ax.pcolormesh(x, y, z, shading="nearest", rasterized=True, **span)
    ax.grid(False)
    fig.colorbar(image, ax=ax, label=words)


def _dashed(limit: Any, size: float, words: str) -> str:
    return f"dashed: {limit} {number(size * limit.value)} {words.partition(', ')[2]}"


def _scaled(ax: Axes, values: np.ndarray, which: str) -> None:
    if values.min() > 0 and values.max() > _WIDE * values.min():
        (ax.set_xscale if which == "x" else ax.set_yscale)("log")
