"""Pictures of a sweep: how outputs are distributed, over speed and time too, and maps of grids."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..sweeps.statistics import axes_of, done, numbers_of, ran_to_end, share
from .labels import number, readable
from .style import COLOURS, GREY, envelope, figure, label, legend

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


def distributions(
    found: xr.Dataset, names: Sequence[str], limits: Mapping[str, Any] | None = None
) -> Figure:
    """Of each output that is one number: a histogram, and the share of cases that do not exceed a value.
    Dashed: its limit (`limits`: name -> something with a `value` and `met`)."""
    limits, numbers = limits or {}, numbers_of(found, names)
    fig, axes = figure(len(numbers), 2, (11.0, 0.6 + 2.9 * len(numbers)))
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
            for ax in (left, right):
                ax.axvline(size * one.value, color="black", linewidth=1.1, linestyle="--")
            part, low, high = share(one.met(sound))
            unit = words.partition(", ")[2]
            right.set_title(
                f"{100 * part:.3g} % are {one} {number(size * one.value)} {unit} (dashed); "
                f"95 % interval {100 * low:.3g} to {100 * high:.3g} %",
                fontsize=9, loc="left",
            )  # fmt: skip
        left.set_title(f"{sound.size} cases; lines: 5, 50 and 95 %", fontsize=9, loc="left")
    return fig


def percentile_bands(found: xr.Dataset, name: str, limit: Any = None) -> Figure:
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
    fig, axes = figure(1, 1, (9.5, 5.0))
    ax = axes[0, 0]
    sizes = dict(color=COLOURS[0], linewidth=0)
    ax.fill_between(x, size * low, size * high, alpha=0.2, label="5 to 95 %", **sizes)
    ax.fill_between(x, size * quarter, size * upper, alpha=0.4, label="25 to 75 %", **sizes)
    ax.plot(x, size * middle, color=COLOURS[1], linewidth=0.5 if dense else 1.6, label="median")
    if limit is not None:
        ax.axhline(size * limit.value, color="black", linewidth=1.1, linestyle="--", label="limit")
    if over_speed and np.nanmin(low, initial=0.0) >= 0:
        ax.set_ylim(0, None)
    ax.set_xlim(float(x[0]), float(x[-1]))
    label(ax, "speed, rpm" if over_speed else "time, s", words)
    legend(ax, ncols=4, **_ABOVE)
    return fig


def _quantiles(values: np.ndarray) -> np.ndarray:
    """(5, n): of the cases that have a number there."""
    out = np.full((len(_PERCENT), values.shape[1]), np.nan)
    there = np.isfinite(values).any(axis=0)
    out[:, there] = np.nanpercentile(values[:, there], _PERCENT, axis=0)
    return out


def grid_lines(
    found: xr.Dataset, names: Sequence[str], limits: Mapping[str, Any] | None = None
) -> Figure:
    """Of a grid of one axis: each output that is one number, over it."""
    (path,) = axes_of(found)
    numbers, limits = numbers_of(found, names), limits or {}
    x_size, x_words = quantity_label(found, path)
    x = x_size * found[path].values
    order = np.argsort(x)
    fig, axes = figure(len(numbers), 1, (8.5, 1.0 + 2.8 * len(numbers)), sharex=True)
    for ax, (name, values) in zip(axes[:, 0], numbers.items()):
        size, words = quantity_label(found, name, values)
        ax.plot(x[order], size * values[order], "o-", color=COLOURS[0], markersize=4, linewidth=1.3)
        if name in limits:
            ax.axhline(size * limits[name].value, color="black", linewidth=1.1, linestyle="--")
            ax.set_title(_dashed(limits[name], size, words), fontsize=9, loc="left")
        label(ax, "", words)
    _scaled(axes[-1, 0], found[path].values, "x")
    axes[-1, 0].set_xlabel(x_words)
    return fig


def grid_map(
    found: xr.Dataset, names: Sequence[str], limits: Mapping[str, Any] | None = None
) -> Figure:
    """Of a grid of two axes: each output that is one number, as a map; dashed its limit. Cases that failed
    are white."""
    first, second = axes_of(found)
    numbers, limits = numbers_of(found, names), limits or {}
    (x_size, x_words), (y_size, y_words) = (quantity_label(found, p) for p in (second, first))
    x, y = x_size * found[second].values, y_size * found[first].values
    across, up = np.argsort(x), np.argsort(y)
    columns = min(2, len(numbers))
    rows = -(-len(numbers) // columns)
    fig, axes = figure(rows, columns, (0.6 + 6.0 * columns, 4.6 * rows))
    for ax in axes.ravel()[len(numbers) :]:
        ax.set_visible(False)
    for ax, (name, values) in zip(axes.ravel(), numbers.items()):
        size, words = quantity_label(found, name, values)
        z = size * values.reshape(len(y), len(x))[up][:, across]
        _map(fig, ax, x[across], y[up], z, words)
        _scaled(ax, found[second].values, "x")
        _scaled(ax, found[first].values, "y")
        if name in limits and np.nanmin(z) < size * limits[name].value < np.nanmax(z):
            at = [size * limits[name].value]
            ax.contour(x[across], y[up], z, at, colors="#D55E00", linestyles="--", linewidths=2)
            ax.set_title(_dashed(limits[name], size, words), fontsize=9, loc="left")
        label(ax, x_words, y_words)
    return fig


def grid_over(found: xr.Dataset, name: str, limit: Any = None) -> Figure:
    """Of a grid of one axis: an output over speed or time, a line for each value; of many values a map."""
    (path,) = axes_of(found)
    array = found[name]
    (along,) = (str(d) for d in array.dims if d != path)
    over_speed = along.endswith("_speed")
    x = array[along].values * (30 / np.pi if over_speed else 1.0)
    order = np.argsort(found[path].values)
    values = array.values[order]
    size, words = quantity_label(found, name, values)
    p_size, p_words = quantity_label(found, path)
    at = p_size * found[path].values[order]
    fig, axes = figure(1, 1, (9.5, 5.0))
    ax = axes[0, 0]
    if len(at) <= len(COLOURS):
        for k, row in enumerate(values):
            ax.plot(x, size * row, color=COLOURS[k], linewidth=1.2, label=number(at[k]))
        if limit is not None:
            ax.axhline(size * limit.value, color="black", linewidth=1.1, linestyle="--")
        legend(ax, title=p_words, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        label(ax, "speed, rpm" if over_speed else "time, s", words)
        ax.set_xlim(float(x[0]), float(x[-1]))
        return fig
    thin = max(1, len(x) // 1500)
    _map(fig, ax, x[::thin], at, size * values[:, ::thin], words)
    _scaled(ax, found[path].values, "y")
    label(ax, "speed, rpm" if over_speed else "time, s", p_words)
    return fig


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
