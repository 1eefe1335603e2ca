"""Pictures of an identification: how the channels are met, what is left, what is told apart."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from scipy.interpolate import PchipInterpolator

from ..identification.identification import Identification
from ..identification.posterior import Posterior
from ..identification.profile import LikelihoodProfile
from .style import COLOURS, GREY, Given, figure, label, legend

# Values that are drawn as dots.
_DOTS = 400


def channel_fits(found: Identification, ax: Given | None = None) -> np.ndarray:
    """Measured over simulated, and what is left with twice the standard deviation of the noise; a row for
    each channel of each run."""
    fits = found.channels
    several = len({f.run for f in fits}) > 1
    _, axes = figure(len(fits), 2, (13.0, 2.6 * len(fits) + 0.6), ax, sharex="row")
    for (left, right), fit in zip(axes, fits):
        name = f"{fit.channel} of {fit.run}" if several else fit.channel
        unit = f", {fit.unit}" if fit.unit else ""
        across = "time, s" if fit.over == "time" else "speed, rad/s"
        order = np.argsort(fit.t, kind="stable")
        t, measured, simulated = fit.t[order], fit.measured[order], fit.simulated[order]
        vectors = np.iscomplexobj(measured)
        # dots while they can be told apart, with the line in front; else a broad band behind it
        mark = "o" if measured.size < _DOTS else "-"
        line = "o" if fit.over == "speed" else "-"
        size = np.abs if vectors else np.asarray
        left.plot(
            t, size(measured), mark, color=GREY, linewidth=1.6, markersize=4, label="measured"
        )
        left.plot(
            t,
            size(simulated),
            line,
            color=COLOURS[0],
            linewidth=0.7,
            markersize=2,
            label="identified",
        )
        rest = measured - simulated
        for part, words, colour in (
            (
                (np.real(rest), "real part", COLOURS[1]),
                (np.imag(rest), "imaginary part", COLOURS[2]),
            )
            if vectors
            else ((rest, None, COLOURS[1]),)
        ):
            right.plot(t, part, line, color=colour, linewidth=0.5, markersize=3, label=words)
        for side in (-2, 2):
            right.axhline(side * fit.std, color="black", linewidth=0.9, linestyle="--")
        label(left, across, f"{'size of ' if vectors else ''}{name}{unit}")
        chance = "" if fit.white is None else f"; chance of white noise: {fit.white:.2g}"
        label(
            right,
            across,
            f"left over{unit}",
            f"{name}: 2 std of its noise dashed{chance}",
        )
        if vectors:
            right.legend(frameon=False, fontsize=8, loc="upper left", ncols=2)
    axes[0, 0].legend(frameon=False, fontsize=9, loc="upper left", ncols=2)
    return axes


def correlations(found: Identification, ax: Given | None = None) -> Axes:
    """How far the parameters are told apart: 1 or -1, and only a combination of two is known."""
    n = len(found.paths)
    fig, axes = figure(1, 1, (2.5 + 0.9 * n, 2.0 + 0.7 * n), ax)
    panel = axes[0, 0]
    image = panel.imshow(found.correlation, cmap="RdBu_r", vmin=-1, vmax=1)
    panel.set_xticks(range(n), found.paths, rotation=30, ha="right")
    panel.set_yticks(range(n), found.paths)
    panel.grid(False)
    for i in range(n):
        for j in range(n):
            r = found.correlation[i, j]
            words = f"{r:.2f}" if np.isfinite(r) else "unseen"
            panel.text(j, i, words, ha="center", va="center", fontsize=8,
                    color="white" if abs(r) > 0.6 else "black")  # fmt: skip
    fig.colorbar(image, ax=panel, label="correlation")
    return panel


def costs(found: Identification, ax: Given | None = None) -> Axes:
    """Half the sum of squared residuals, in standard deviations, at each iteration of each search. From one
    to the next the standard deviations change, and with them the cost."""
    _, axes = figure(1, 1, (7.0, 4.0), ax)
    panel, first = axes[0, 0], 1
    for k, (name, history) in enumerate(found.histories.items()):
        at = np.arange(first, first + len(history))
        panel.semilogy(at, history, "o-", color=COLOURS[k % len(COLOURS)], label=name)
        first += len(history)
    label(panel, "iteration", "cost")
    legend(panel)
    return panel


def profile_curves(
    found: Identification, curves: Mapping[str, LikelihoodProfile], ax: Given | None = None
) -> np.ndarray:
    """How twice the cost grows away from each estimate; dashed what its standard deviation makes one expect.
    Where the two part the interval is lopsided, or open."""
    axes = _panels(len(curves), ax)
    limit = found.knowledge.quantile(0.95) ** 2
    for panel, (path, curve) in zip(axes, curves.items()):
        x = np.linspace(curve.values[0], curve.values[-1], 101)
        expected = (x - found.values[path]) / curve.std
        panel.plot(
            x, expected**2, "--", color=GREY, linewidth=1.2, label="by its standard deviation"
        )
        # the root is nearly straight: between the points it is joined, not its square
        root = PchipInterpolator(curve.values, curve.root)(x)
        panel.plot(x, root**2, color=COLOURS[0], label="profile")
        panel.plot(curve.values, curve.root**2, "o", color=COLOURS[0], markersize=4)
        panel.axhline(limit, color=COLOURS[1], linewidth=0.9, label="95 %")
        panel.locator_params(axis="x", nbins=4)
        label(panel, _named(path, curve.unit), "growth of twice the cost")
    legend(axes[0])
    return axes


def posteriors(found: Identification, drawn: Posterior, ax: Given | None = None) -> np.ndarray:
    """The draws of each parameter, over the bell that its estimate and standard deviation make."""
    axes = _panels(len(found.paths), ax)
    for panel, path, unit in zip(axes, found.paths, found.units):
        x = drawn.draws[path].ravel()
        panel.hist(x, bins=40, density=True, color=COLOURS[0], alpha=0.5, label="posterior")
        at = np.linspace(x.min(), x.max(), 201)
        mean, std = found.values[path], found.std[path]
        bell = np.exp(-0.5 * ((at - mean) / std) ** 2) / (std * np.sqrt(2 * np.pi))
        panel.plot(at, bell, color=COLOURS[1], label="estimate and its std")
        panel.locator_params(axis="x", nbins=4)
        label(panel, _named(path, unit), "density")
    legend(axes[0])
    return axes


def _panels(count: int, ax: Given | None) -> np.ndarray:
    """So many axes: new ones, three in a row, or those given."""
    if ax is not None:
        return figure(count, 1, ax=ax)[1].ravel()
    columns = min(3, count)
    rows = -(-count // columns)
    _, axes = figure(rows, columns, (4.2 * columns, 3.1 * rows + 0.4))
    for panel in axes.ravel()[count:]:
        panel.set_visible(False)
    return axes.ravel()[:count]


def _named(path: str, unit: str) -> str:
    return f"{path}, {unit}" if unit else path
