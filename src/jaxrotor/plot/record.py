"""What was recorded: signals above each other over one time, and their spectra."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from ..diagnostics.spectra import amplitudes
from ..sensors.sampling import gaps, rate_of, runs
from ..sensors.survey import Signal
from .labels import number
from .style import COLOURS, GREY, figure, new_figure

# More panels than these cannot be told apart on a page.
MOST = 24
# A signal of more values is drawn as the least and the greatest of each of so many stretches.
_STRETCHES = 2000
# So many gaps, and the longest stretches of missing values, are marked.
_GAPS = 50
# Pieces of a spectrum's mean, where the signal is long enough, and the fewest values of one.
_PIECES, _SHORTEST = 8, 256
# Lines below this part of the highest are rounding.
_FLOOR = 1e-7


def signals_over_time(signals: Sequence[Signal], title: str) -> np.ndarray:
    """A panel for each signal, the first 24. A long one is drawn as the band between its least and greatest
    values, so that no peak is lost; where nothing tells its time it stands over the numbers of its values."""
    shown = list(signals[:MOST])
    timed = all(one.t is not None for one in shown)
    axes = _panels(len(shown), shared=timed)
    for k, (one, panel) in enumerate(zip(shown, axes)):
        along = np.arange(len(one.values)) if one.t is None else one.t
        _trace(panel, along, one.values, COLOURS[k % len(COLOURS)])
        _name(panel, one.name, one.unit or "unit ?")
        if not timed:
            panel.margins(x=0.0)
            panel.set_xlabel("number of the value" if one.t is None else "time, s", fontsize=8)
    if timed:
        axes[-1].set_xlabel("time, s")
        ends = np.concatenate([one.t[[0, -1]] for one in shown if one.t is not None])
        if np.isfinite(ends).all() and ends.max() > ends.min():
            axes[-1].set_xlim(ends.min(), ends.max())
    _heading(axes, title, len(signals))
    return axes


class Spectrum(NamedTuple):
    """`amplitude`, of a sine, at `frequency` (Hz), the mean of `pieces`; of the values from `start` to `end`,
    s."""

    frequency: np.ndarray
    amplitude: np.ndarray
    pieces: int
    start: float
    end: float


def spectrum_of(one: Signal) -> Spectrum | None:
    """Of the longest stretch of an evenly sampled signal without a missing value, or `None` where there are
    not 16 values side by side, or where they are all the same. The mean square of half-overlapping pieces,
    Hann window (Welch's method)."""
    rate = None if one.t is None else rate_of(one.t)
    valid = runs(np.isfinite(one.values))
    if rate is None or one.t is None or not valid:
        return None
    first, count = max(valid, key=lambda run: run[1])
    if count < 16 or np.ptp(one.values[first : first + count]) == 0:
        return None
    length = min(count, max(_SHORTEST, 2 ** int(np.log2(2 * count / (_PIECES + 1)))))
    values = one.values[first : first + count]
    frames = np.lib.stride_tricks.sliding_window_view(values, length)[:: length // 2]
    square = 0.0
    for frame in frames:  # all at once a long record would not fit
        f, found = amplitudes(frame, rate, "hann")
        square = square + found**2
    amplitude = np.sqrt(square / len(frames))
    start, end = float(one.t[first]), float(one.t[first + count - 1])
    return Spectrum(f, amplitude, len(frames), start, end)


def spectra(signals: Sequence[Signal], title: str) -> np.ndarray | None:
    """A panel for each signal that has a spectrum, the first 24; `None` where none has."""
    found = [(k, one, s) for k, one in enumerate(signals) if (s := spectrum_of(one)) is not None]
    if not found:
        return None
    shown = found[:MOST]
    words = {k: _said(one, spectrum) for k, one, spectrum in shown}
    axes = _panels(len(shown), shared=True)
    for panel, (k, one, spectrum) in zip(axes, shown):
        f, amplitude = spectrum.frequency[1:], spectrum.amplitude[1:]
        top = amplitude.max()
        panel.semilogy(
            f, np.maximum(amplitude, _FLOOR * top), color=COLOURS[k % len(COLOURS)], linewidth=0.9
        )
        panel.yaxis.set_major_locator(LogLocator(numticks=5 if len(shown) <= 10 else 3))
        panel.yaxis.set_minor_locator(NullLocator())
        panel.set_ylim(max(0.05 * float(np.median(amplitude)), _FLOOR * top), 2 * top)
        more = words[k] if len(set(words.values())) > 1 else ""
        _name(panel, one.name, one.unit or "unit ?", more)
    axes[-1].set_xlabel("frequency, Hz")
    axes[-1].set_xlim(0.0, max(spectrum.frequency[-1] for _, _, spectrum in shown))
    alike = f" ({words[shown[0][0]]})" if len(set(words.values())) == 1 else ""
    _heading(axes, f"{title}{alike}", len(found))
    return axes


def _said(one: Signal, spectrum: Spectrum) -> str:
    """How a spectrum was made."""
    pieces = f"mean of {spectrum.pieces} pieces, " if spectrum.pieces > 1 else ""
    part = ""
    if one.t is not None and (spectrum.start, spectrum.end) != (one.t[0], one.t[-1]):
        part = f", from {number(spectrum.start)} to {number(spectrum.end)} s"
    return f"{pieces}lines {number(float(spectrum.frequency[1]))} Hz apart{part}"


def _panels(count: int, shared: bool) -> np.ndarray:
    height = float(np.clip(11.0 / count, 0.75, 2.6))
    width, below, above, gap = 9.5, 0.55, 0.7, 0.32 if shared else 0.6
    high = below + above + height * count
    # laid out by hand: to find out where two dozen panels may stand takes matplotlib half a minute
    new = new_figure((width, high))
    look = dict(left=0.9 / width, right=1 - 0.2 / width, bottom=below / high, top=1 - above / high)
    panels = new.subplots(
        count, 1, sharex=shared, squeeze=False, gridspec_kw=look | {"hspace": gap / (height - gap)}
    )
    _, axes = figure(count, 1, ax=panels.ravel())
    for one in axes[:, 0]:
        one.tick_params(labelsize=8)
        one.locator_params(axis="y", nbins=4)
    return axes[:, 0]


def _name(panel: Axes, name: str, unit: str, more: str = "") -> None:
    short = name if len(name) <= 60 else f"{name[:40]}...{name[-16:]}"
    panel.set_title(short.replace("$", r"\$"), fontsize=9, loc="left", pad=3)
    for written, read in (("^2", "²"), ("^3", "³"), ("*", "·"), ("$", r"\$")):
        unit = unit.replace(written, read)
    panel.set_ylabel(unit, fontsize=8)
    if more:
        panel.set_title(more, fontsize=7.5, loc="right", pad=3, color=GREY)


def _heading(axes: np.ndarray, title: str, count: int) -> None:
    high = axes[0].figure.get_figheight()
    axes[0].figure.align_ylabels(axes)
    more = f", the first {len(axes)} of {count}" if count > len(axes) else ""
    axes[0].figure.suptitle(
        f"{title}{more}".replace("$", r"\$"),
        fontsize=11,
        x=0.01,
        y=1 - 0.1 / high,
        ha="left",
        va="top",
    )


def _trace(panel: Axes, along: np.ndarray, values: np.ndarray, colour: str) -> None:
    order = np.argsort(along, kind="stable") if (np.diff(along) < 0).any() else slice(None)
    along, values = along[order], values[order]
    missing = sorted(runs(~np.isfinite(values)), key=lambda run: -run[1])[:_GAPS]
    breaks = gaps(along)[:_GAPS]
    ends = [(max(first - 1, 0), min(first + count, along.size - 1)) for first, count in missing]
    for first, last in [*ends, *((k, k + 1) for k in breaks)]:
        panel.axvspan(float(along[first]), float(along[last]), color=GREY, alpha=0.3, linewidth=0.8)
    for x, y in zip(np.split(along, breaks + 1), np.split(values, breaks + 1)):
        if values.size <= 2 * _STRETCHES:
            few = values.size <= 60
            panel.plot(x, y, color=colour, linewidth=0.9, marker="." if few else None)
        else:
            middle, low, high = stretches(x, y)
            panel.fill_between(middle, low, high, color=colour, linewidth=0.9)


def stretches(along: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle, least and greatest value of each of many stretches; neighbours share a value, so that the band
    has no holes; nan where all of a stretch is missing."""
    count = max(1, min(_STRETCHES, values.size // 2))
    edges = np.linspace(0, values.size - 1, count + 1).astype(int)
    x = 0.5 * (along[edges[:-1]] + along[edges[1:]])
    low, high = np.full(x.size, np.nan), np.full(x.size, np.nan)
    for k, (a, b) in enumerate(zip(edges[:-1], edges[1:])):
        part = values[a : b + 1]
        part = part[np.isfinite(part)]
        if part.size:
            low[k], high[k] = part.min(), part.max()
    return x, low, high
