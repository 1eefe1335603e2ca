"""Pictures of an identification: how the channels are met, what is left, what is told apart."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from scipy.interpolate import PchipInterpolator

from ..identification.fit_by_channel import ChannelFit
from ..identification.identification import Identification
from ..identification.posterior import Posterior
from ..identification.profile import LikelihoodProfile
from .style import COLOURS, GREY, Given, figure, label, legend

# Values that are drawn as dots.
_DOTS = 400


def channel_fits(found: Identification, ax: Given | None = None) -> np.ndarray:
    """Of each channel of each run what was measured and what is identified, of vectors their size and phase;
    below what is left, with twice the standard deviation of the noise. Returns the panels, a row for each
    channel: two, or three where there are vectors (`None` for the phase of what is none)."""
    fits = found.channels
    several = len({f.run for f in fits}) > 1
    vectors = [np.iscomplexobj(fit.measured) for fit in fits]
    columns = 2 if len(fits) > 2 and len(set(vectors)) == 1 else 1
    heights = [(3.0, 2.0, 1.5) if one else (3.0, 1.5) for one in vectors][::columns]
    ratios = [height for block in heights for height in block]
    size = (8.0 * columns + 3.0 * (columns == 1), 0.9 * sum(ratios))
    _, axes = figure(len(ratios), columns, size, ax, height_ratios=ratios)
    panels = np.full((len(fits), 3 if any(vectors) else 2), None, object)
    rows = np.cumsum([0, *map(len, heights)])
    for k, (fit, complex_) in enumerate(zip(fits, vectors)):
        block = axes[rows[k // columns] : rows[k // columns + 1], k % columns]
        panels[k, [0, 1, 2] if complex_ else [0, -1]] = block
        name = f"{fit.channel} of {fit.run}" if several else fit.channel
        _fit(block, fit, name, complex_)
    for unused in axes[rows[-2] :, 1] if columns == 2 and len(fits) % 2 else ():
        unused.remove()
    panels[0, 0].legend(frameon=False, fontsize=9, loc="upper left", ncols=2)
    return panels


def _fit(block: np.ndarray, fit: ChannelFit, name: str, vectors: bool) -> None:
    """One channel, from the top down."""
    main, left = block[0], block[-1]
    unit = f", {fit.unit}" if fit.unit else ""
    order = np.argsort(fit.t, kind="stable")
    t, measured, simulated = fit.t[order], fit.measured[order], fit.simulated[order]
    if fit.over == "speed":
        t = t * 30 / np.pi
    # dots while they can be told apart, with the line in front; else a broad band behind it
    mark = "o" if measured.size < _DOTS else "-"
    line = "x" if fit.over == "speed" else "-"
    rest = measured - simulated
    shown = [(main, measured, simulated)]
    if vectors:
        turn = np.angle(measured, deg=True)  # the identified one within half a turn of it
        shown = [(main, abs(measured), abs(simulated))]
        shown.append((block[1], turn, turn - np.angle(measured / simulated, deg=True)))
    for panel, seen, told in shown:
        panel.plot(t, seen, mark, color=GREY, linewidth=1.6, markersize=4, label="measured")
        look = dict(linewidth=0.9, markersize=5, label="identified")
        panel.plot(t, told, line, color=COLOURS[0], **look)
    parts = [(np.real(rest), "real part", COLOURS[1])]
    if vectors:
        parts.append((np.imag(rest), "imaginary part", COLOURS[2]))
    for part, words, colour in parts:
        left.plot(t, part, line, color=colour, linewidth=0.7, markersize=4, label=words)
    for side in (-2, 2):
        left.axhline(side * fit.std, color="black", linewidth=0.9, linestyle="--")
    chance = "" if fit.white is None else f"; chance of white noise: {fit.white:.2g}"
    label(main, "", f"size of {name}{unit}" if vectors else f"{name}{unit}")
    main.set_title(f"{name}: 2 std of its noise dashed{chance}", fontsize=10, loc="left")
    if vectors:
        label(block[1], "", "phase, degrees")
        left.legend(frameon=False, fontsize=8, loc="upper left", ncols=2)
    label(left, "time, s" if fit.over == "time" else "speed, rpm", f"left over{unit}")
    for above in block[:-1]:
        above.sharex(left)
        above.tick_params(labelbottom=False)
    for panel in block:
        panel.yaxis.set_major_locator(MaxNLocator(5, min_n_ticks=3))


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
