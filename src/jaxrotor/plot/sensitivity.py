"""Pictures of what matters in a sweep: points over parameters, bars of their weight."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from .style import COLOURS, GREY, Given, figure, heading_above, label, legend_below
from .sweep import _numbers, quantity_label

# Panels beyond which nothing is read any more.
_COLUMNS, _ROWS = 7, 8
_SHOWN = 4000


def scatter_matrix(
    found: xr.Dataset,
    paths: Sequence[str],
    names: str | Sequence[str],
    ranks: xr.Dataset | None = None,
    limits: Mapping[str, Any] | None = None,
    ax: Given | None = None,
) -> np.ndarray:
    """Each output that is one number over each parameter, a point for each case. `ranks`: of
    `rank_regression`: its correlations of ranks are printed, and order the parameters."""
    limits, numbers = limits or {}, dict(list(_numbers(found, names).items())[:_ROWS])
    chosen = list(paths)
    if ranks is not None:
        weight = abs(ranks["correlation"]).max(dim="output").to_series()
        chosen.sort(key=lambda p: -weight[p])
    left_out, chosen = chosen[_COLUMNS:], chosen[:_COLUMNS]
    size = (1.4 + 2.6 * len(chosen), 1.0 + 2.2 * len(numbers))
    _, axes = figure(len(numbers), len(chosen), size, ax, sharex="col", sharey="row")
    for j, path in enumerate(chosen):
        x_size, words = quantity_label(found, path)
        x = np.broadcast_to(found[path].values.ravel(), next(iter(numbers.values())).shape)
        for i, (name, values) in enumerate(numbers.items()):
            panel = axes[i, j]
            size_, own = quantity_label(found, name, values)
            every = max(1, len(x) // _SHOWN)
            panel.plot(
                x_size * x[::every], size_ * values[::every], "o", color=COLOURS[0],
                markersize=2.5 if len(x) > 300 else 3.5, alpha=0.6, markeredgewidth=0,
            )  # fmt: skip
            if name in limits:
                panel.axhline(
                    size_ * limits[name].value, color="black", linewidth=1, linestyle="--"
                )
            if ranks is not None and name in ranks["output"]:
                r = float(ranks["correlation"].sel(output=name, parameter=path))
                panel.set_title(f"rank correlation {r:+.2f}", fontsize=9, loc="left")
            panel.locator_params(axis="x", nbins=4)
            if j == 0:
                panel.set_ylabel(own)
        axes[-1, j].set_xlabel(words, fontsize=9 if len(words) < 34 else 7.5)
    if left_out:
        heading_above(axes, ax, f"not shown, as they matter less: {', '.join(left_out)}", 9)
    return axes


def sensitivity_bars(weights: xr.Dataset, ax: Given | None = None) -> np.ndarray:
    """Which parameter matters, of each output: the coefficients of `rank_regression`, or the shares of
    `sobol_indices`, with their intervals of confidence; the weightiest on top."""
    shares = "total" in weights
    main = "total" if shares else "coefficient"
    outputs, paths = [str(o) for o in weights["output"].values], weights["parameter"].values
    height = 0.42 * len(paths) + 1.1
    _, axes = figure(len(outputs), 1, (8.5, 0.6 + height * len(outputs)), ax, sharex=True)
    for panel, name in zip(axes[:, 0], outputs):
        own = weights.sel(output=name)
        order = np.argsort(np.abs(own[main].values))
        y = np.arange(len(order))
        if shares:
            for key, shift, colour, words in (
                ("first", 0.19, COLOURS[0], "alone"),
                ("total", -0.19, COLOURS[4], "with all that it does together with others"),
            ):
                _bars(
                    panel,
                    y + shift,
                    own,
                    key,
                    order,
                    f"{key}_low",
                    f"{key}_high",
                    0.36,
                    colour,
                    words,
                )
            panel.set_title(f"{name}: share of its variance", fontsize=10, loc="left")
        else:
            _bars(panel, y, own, "coefficient", order, "low", "high", 0.6, COLOURS[0], None)
            panel.set_title(
                f"{name}: standardised rank regression, R² = {float(own['explained']):.2f}",
                fontsize=10, loc="left",
            )  # fmt: skip
        panel.axvline(0.0, color="black", linewidth=0.8)
        panel.set_yticks(y, [str(p) for p in paths[order]], fontsize=9)
        panel.grid(False, axis="y")
    words = (
        "share of the variance"
        if shares
        else "change of the output's rank per change of the parameter's, in standard deviations"
    )
    label(axes[-1, 0], words, "")
    if shares:
        legend_below(axes, ax, 2, *axes[0, 0].get_legend_handles_labels())
    return axes[:, 0]


def _bars(ax, y, own, key, order, low, high, height, colour, words) -> None:
    values = own[key].values[order]
    ax.barh(y, values, height=height, color=colour, label=words, alpha=0.85)
    ends = np.abs(np.stack([values - own[low].values[order], own[high].values[order] - values]))
    ax.errorbar(values, y, xerr=ends, fmt="none", ecolor=GREY, elinewidth=1.2, capsize=2.5)
