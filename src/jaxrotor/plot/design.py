"""Pictures of a design: how the search went, and what the design changed."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from ..linear.norms import response_peaks
from ..linear.transfer import level, transfer
from ..machine.machine import Machine
from ..objectives.criterion import Constraint, described
from ..objectives.machine_measures import ResponsePeaks, unit_on
from ..objectives.measure import AbstractSignalMeasure
from ..objectives.peak import PeakValue
from ..optimization.optimum import Optimum
from ..optimization.problem import in_parts
from ..simulation.response import Response
from .curves import Curve, _draw, _scale
from .lines import _PREFIXED
from .style import COLOURS, GREY, Given, asked_panels, figure, label, legend

# Numbers that span more than this factor have a logarithmic axis; of a search, where a few go astray.
_WIDE, _ASTRAY = 20.0, 5.0
# A design whose bounds are missed by no more (scaled) counts as one of those found.
_MET = 1e-3
# What is missed by less is drawn to a straight scale, down to zero.
_NONE = 1e-8
_BEFORE, _AFTER = COLOURS[1], COLOURS[0]
_POINTS = 1200


def search_history(found: Optimum, ax: Given | None = None) -> np.ndarray:
    """The objective of every evaluation, the best so far that keeps the bounds, and, where any was missed on
    the way, by how much, as part of its limit; of several searches one after the other."""
    _, values, missed = search_steps(found)
    rows = min(asked_panels(ax, 1 + bool(np.nanmax(missed, initial=0.0) > 0)), 2)
    _, axes = figure(rows, 1, (8.5, 1.2 + 2.9 * rows), ax, sharex=True)
    panel, at = axes[0, 0], np.arange(1, len(values) + 1)
    sound = np.isfinite(values)
    kept = np.where(sound & (missed <= _MET), values, np.inf)
    best = np.minimum.accumulate(kept)
    panel.plot(at[sound], values[sound], "o", color=GREY, markersize=3, label="evaluated")
    name = "best so far" + (" within bounds" if found.constraints else "")
    reached = np.isfinite(best)
    panel.plot(at[reached], best[reached], color=_AFTER, drawstyle="steps-post", label=name)
    panel.axhline(
        found.objective_before, color=_BEFORE, linewidth=0.9, linestyle="--", label="before"
    )
    _wide(panel, values[sound], _ASTRAY)
    unit = f", {_shown(found.unit)}" if found.unit else ""
    label(panel, "", f"objective{unit}", found.name)
    if rows > 1:
        below = axes[1, 0]
        shown = np.maximum(missed, 0.0)[sound]
        below.plot(at[sound], shown, "o-", color=COLOURS[2], markersize=3, linewidth=0.7)
        below.set_yscale("symlog", linthresh=_NONE)
        below.set_ylim(-0.1 * _NONE, 3 * max(1.0, float(np.max(shown, initial=0.0))))
        label(below, "", "bounds missed by,\npart of their limit")
    for start in np.cumsum([len(search) for search in found.history])[:-1]:
        for one in axes[:, 0]:
            one.axvline(start + 0.5, color="black", linewidth=0.8, linestyle=":")
    legend(panel, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes[-1, 0].set_xlabel("evaluation")
    axes[-1, 0].xaxis.get_major_locator().set_params(integer=True)
    return axes[:, 0]


def search_steps(found: Optimum) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of every evaluation, one search after the other: the number of its search, the objective, and by how
    much its bounds are missed, as part of their limits."""
    sizes = found.problem.sizes()
    searches = [k for k, search in enumerate(found.history, 1) for _ in search]
    told = [_told(step.vector, found, sizes) for search in found.history for step in search]
    return np.array(searches), *np.array(told).T


def _told(vector: np.ndarray, found: Optimum, sizes: list[int]) -> tuple[float, float]:
    """The objective, and by how much its bounds are missed."""
    objective, *rest = in_parts(vector, sizes)
    missed = 0.0
    for values, held, scale in zip(rest, found.constraints, found.scales[1:]):
        off = (values - held.limit) / scale
        missed = max(missed, np.max({"<=": off, ">=": -off, "==": np.abs(off)}[held.sense]))
    return float(np.max(objective)), float(missed)


def _wide(ax: Axes, values: np.ndarray, factor: float = _WIDE) -> None:
    if values.size and values.min() > 0 and values.max() > factor * values.min():
        ax.set_yscale("log")


def before_after(
    measures: Sequence[AbstractSignalMeasure],
    before: Response,
    after: Response,
    constraints: Sequence[Constraint] = (),
    ax: Given | None = None,
) -> np.ndarray:
    """What each judged sensor sees of the run before and after the design, a panel for each sensor. Dashed:
    limits of its peak; grey: time that no measure looks at."""
    groups: list[list[AbstractSignalMeasure]] = []
    for measure in measures:
        own = next((g for g in groups if bool(eqx.tree_equal(g[0].sensor, measure.sensor))), None)
        if own is None:
            groups.append([measure])
        else:
            own.append(measure)
    rows, t = len(groups), np.asarray(before.t)
    _, axes = figure(rows, 1, (9.5, 1.2 + 2.9 * rows), ax, sharex=True)
    for panel, group in zip(axes[:, 0], groups):
        sensor = group[0].sensor
        curves = [
            Curve(name, np.asarray(sensor.signal(run)), sensor.unit)
            for name, run in (("before", before), ("after", after))
        ]
        size, words = _scale(curves, ())
        for curve, colour in zip(curves, (_BEFORE, _AFTER)):
            _draw(panel, t, size * curve.values, slice(None), colour, curve.name)
        for limit in _limits(group, constraints):
            for side in (-limit, limit):
                panel.axhline(size * side, color="black", linewidth=0.9, linestyle="--")
        first = min(0.0 if m.start is None else float(m.start) for m in group)
        last = max(t[-1] if m.stop is None else float(m.stop) for m in group)
        for a, b in ((t[0], first), (last, t[-1])):
            if b > a:
                panel.axvspan(a, b, color=GREY, alpha=0.15, linewidth=0)
        label(panel, "", words, described(sensor))
        legend(panel, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes[-1, 0].set_xlabel("time, s")
    axes[-1, 0].set_xlim(float(t[0]), float(t[-1]))
    return axes[:, 0]


def _limits(measures: Sequence[Any], constraints: Sequence[Constraint]) -> list[float]:
    """Of these measures (of signals: of their peaks), in their own unit."""
    found = []
    for one in constraints:
        terms = one.criterion.terms
        mine = len(terms) == 1 and any(terms[0][2] is measure for measure in measures)
        if mine and isinstance(terms[0][2], (PeakValue, ResponsePeaks)):
            if getattr(terms[0][2], "about", "zero") == "zero":
                found.append(one.limit / terms[0][0])
    return found


def peaks_before_after(
    measures: Sequence[ResponsePeaks],
    before: Machine,
    after: Machine,
    constraints: Sequence[Constraint] = (),
    ax: Given | None = None,
) -> np.ndarray:
    """|output per input| over frequency before and after the design, with the peaks that are judged; a panel
    for each. Dashed: limits."""
    different = list({_words(m): m for m in measures}.values())
    rows = len(different)
    _, axes = figure(rows, 1, (9.5, 1.2 + 2.9 * rows), ax)
    for panel, measure in zip(axes[:, 0], different):
        w = np.linspace(measure.start, measure.stop, _POINTS)
        drawn = []
        for machine in (before, after):
            peaks = response_peaks(
                machine, measure.input, measure.output, measure.start, measure.stop, measure.count,
                speed=measure.speed, at=measure.at, torsion=measure.torsion,
            )  # fmt: skip
            where, heights = (np.asarray(x) for x in peaks)
            along = np.unique(np.append(w, where))  # a sharp peak is not stepped over
            drawn.append((along, _size(measure, machine, along), where, heights))
        top = max(float(heights.max()) for *_, heights in drawn)
        size, unit = _prefixed(unit_on(measure, before), top)
        for name, colour, (along, sizes, where, heights) in zip(
            ("before", "after"), (_BEFORE, _AFTER), drawn
        ):
            panel.plot(along / (2 * np.pi), size * sizes, color=colour, linewidth=1.4, label=name)
            panel.plot(where / (2 * np.pi), size * heights, "o", color=colour, markersize=4)
        same = [m for m in measures if _words(m) == _words(measure)]
        for limit in _limits(same, constraints):
            panel.axhline(size * limit, color="black", linewidth=0.9, linestyle="--", label="limit")
        everything = np.concatenate([size * sizes for _, sizes, *_ in drawn])
        _wide(panel, everything[everything > 1e-9 * everything.max()])
        if panel.get_yscale() == "linear":
            panel.set_ylim(0.0, None)
        panel.set_xlim(measure.start / (2 * np.pi), measure.stop / (2 * np.pi))
        label(panel, "frequency, Hz", unit or "magnitude", f"{measure.output} per {measure.input}")
        legend(panel, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return axes[:, 0]


def _words(measure: ResponsePeaks) -> tuple:
    numbers = (measure.start, measure.stop, float(measure.speed), measure.at, measure.torsion)
    return (measure.input, measure.output, *numbers)


def _size(measure: ResponsePeaks, machine: Machine, along: np.ndarray) -> np.ndarray:
    G = transfer(
        machine, measure.input, measure.output, measure.speed, measure.at, measure.torsion
    )  # fmt: skip
    # one after the other: batched LAPACK calls side by side can deadlock (docs/solving.md)
    return np.asarray(jnp.exp(jax.lax.map(lambda w: level(G, w), jnp.asarray(along))))


def _shown(unit: str) -> str:
    return unit.replace("**2", "²").replace("(rad)²", "rad²").replace("*", "·")


def _prefixed(unit: str, top: float) -> tuple[float, str]:
    """A factor, and the unit with the prefix that suits it."""
    shown = _shown(unit)
    if not shown or top <= 0 or not shown.lstrip("(")[:1].isalpha():
        return 1.0, shown
    _, size, prefix = next((p for p in _PREFIXED if 0 < p[0] <= top), _PREFIXED[-1])
    opened = len(shown) - len(shown.lstrip("("))
    return size, f"{'(' * opened}{prefix}{shown[opened:]}"
