"""The machine in motion: its line seen from the side and a little from above, whirl exaggerated."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..machine.machine import Machine
from ..plot.labels import number
from ..plot.lanes import positions
from .charts import BLUE, GREY, ORANGE, plain, translucent
from .page import Interactive

# Frames of the whole run; turns that a point of the shaft makes on the screen meanwhile; points of an orbit.
_FRAMES, _TURNS, _POINTS = 120, 10, 24
# The largest displacement on the screen, as part of the machine's length.
_REACH = 0.13
# How x, which points at the viewer, is drawn: along z and along y.
_OBLIQUE = (0.42, 0.28)
# m, of a machine that stands still.
_STILL = 1e-12


@dataclass(frozen=True)
class Course:
    """`t` (nt,), s; `xy` (nt, stations, 2), m; `speed` (nt,) of the station that is watched, rad/s."""

    t: np.ndarray
    xy: np.ndarray
    speed: np.ndarray


def fine(t: np.ndarray, values: np.ndarray, first: float, last: float, points: int) -> np.ndarray:
    """A part of sampled paths by a cubic spline, (points, ...): a turn has few samples at high speed, and a
    polygon is not what the rotor drew."""
    from scipy.interpolate import CubicSpline

    inside = np.linspace(max(first, t[0]), min(last, t[-1]), points)
    a, b = np.searchsorted(t, [inside[0], inside[-1]])
    a, b = max(0, int(a) - 4), min(len(t), int(b) + 5)
    return CubicSpline(t[a:b], values[a:b], axis=0)(inside)


def animated(machine: Machine, names: Sequence[str], course: Course) -> Interactive | None:
    """With a slider and a button; `None` for what does not move, or is not finite."""
    where = positions(machine)
    if not np.all(np.isfinite(course.xy)) or any(n not in where for n in names):
        return None
    peak = float(np.hypot(*np.moveaxis(course.xy, -1, 0)).max())
    place = np.array([where[n][0] for n in names])
    length = float(np.ptp(place)) or 1.0
    if peak < _STILL:
        return None
    size = _REACH * length / peak
    lanes = np.array([where[n][1] for n in names])
    base = -lanes * 4.5 * _REACH * length
    pairs = _pairs(machine, names, place, lanes)
    frames, labels = [], []
    times = np.linspace(course.t[0], course.t[-1], _FRAMES)
    for k, t in enumerate(times):
        speed = float(np.interp(t, course.t, course.speed))
        orbit, now = _seen(course, t, speed, k * _TURNS / _FRAMES % 1.0)
        data = [
            _orbits(orbit, place, base, size),
            _line(now, place, base, size, pairs),
            _stations(now, place, base, size),
        ]
        label = f"{t:.3g} s, {30 / np.pi * speed:.4g} rpm"
        labels.append(label)
        frames.append({"name": str(k), "traces": [1, 2, 3], "data": data})
    # what stands on paper, and before it is played, is the largest whirl
    radii = np.hypot(*np.moveaxis(course.xy, -1, 0)).max(axis=1)
    start = int(np.argmin(np.abs(times - course.t[np.argmax(radii)])))
    first = frames[start]["data"]
    rest = _line(np.zeros((len(names), 2)), place, base, 0.0, pairs)
    looks = (
        {"mode": "lines", "line": {"color": translucent(GREY, 0.8), "width": 1, "dash": "dash"}},
        {"mode": "lines", "line": {"color": translucent(BLUE, 0.55), "width": 1.2}},
        {"mode": "lines", "line": {"color": BLUE, "width": 4}},
        {
            "mode": "markers+text",
            "marker": {"color": ORANGE, "size": 9},
            "text": list(names),
            "textposition": _beside(place),
            "cliponaxis": False,
        },
    )
    more = {"type": "scatter", "hoverinfo": "skip", "showlegend": False}
    data = [{**more, **one, **look} for one, look in zip((rest, *first), looks)]
    reach = 1.5 * _REACH * length
    layout = {
        "height": 430 + 90 * int(lanes.max()),
        "margin": {"l": 20, "r": 20, "t": 20, "b": 130},
        "showlegend": False,
        "xaxis": {
            "range": [place.min() - 0.09 * length, place.max() + 0.09 * length],
            "visible": False,
            "fixedrange": True,
        },
        "yaxis": {
            "range": [float(base.min()) - reach, reach],
            "visible": False,
            "fixedrange": True,
            "scaleanchor": "x",
        },
        **_controls(labels, start),
    }
    words = (
        f"The run in slow motion, displacements {number(size)} times as large; thin: the orbit of the turn, "
        "dashed: the axis. Each picture is an instant of the run, taken a little later in the turn than the "
        "one before, as by a stroboscope"
    )
    return Interactive(words, {"data": data, "layout": layout, "frames": frames})


def _seen(course: Course, t: float, speed: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
    """The orbits of the turn about `t`, (points, stations, 2), and all at one instant of it."""
    whole = float(course.t[-1] - course.t[0])
    turn = min(2 * np.pi / max(abs(speed), 1e-9), 0.02 * whole)
    first = min(max(t - turn / 2, course.t[0]), course.t[-1] - turn)
    orbit = fine(course.t, course.xy, first, first + turn, _POINTS + 1)
    at = phase * _POINTS
    low = int(at)
    return orbit, orbit[low] + (at - low) * (orbit[min(low + 1, _POINTS)] - orbit[low])


def _beside(place: np.ndarray) -> list[str]:
    """Names above and below in turn, from left to right: neighbours do not run into each other."""
    rank = np.argsort(np.argsort(place, kind="stable"), kind="stable")
    return ["bottom center" if k % 2 else "top center" for k in rank]


def _projected(
    xy: np.ndarray, place: np.ndarray, base: np.ndarray, size: float
) -> tuple[np.ndarray, np.ndarray]:
    along, up = _OBLIQUE
    return place - along * size * xy[..., 0], base + size * (xy[..., 1] - up * xy[..., 0])


def _orbits(orbit: np.ndarray, place: np.ndarray, base: np.ndarray, size: float) -> dict[str, Any]:
    x, y = _projected(orbit, place, base, size)
    gap = np.full((1, x.shape[1]), np.nan)
    return {"x": _row(np.concatenate([x, gap]).T), "y": _row(np.concatenate([y, gap]).T)}


def _line(
    now: np.ndarray,
    place: np.ndarray,
    base: np.ndarray,
    size: float,
    pairs: list[tuple[int, int]],
) -> dict[str, Any]:
    x, y = _projected(now, place, base, size)
    ends = np.array(pairs)
    gap = np.full((len(pairs), 1), np.nan)
    return {
        "x": _row(np.concatenate([x[ends], gap], axis=1)),
        "y": _row(np.concatenate([y[ends], gap], axis=1)),
    }


def _stations(now: np.ndarray, place: np.ndarray, base: np.ndarray, size: float) -> dict[str, Any]:
    x, y = _projected(now, place, base, size)
    return {"x": _row(x), "y": _row(y)}


def _row(values: np.ndarray) -> list[Any]:
    return plain(values.ravel(), 4)


def _pairs(
    machine: Machine, names: Sequence[str], place: np.ndarray, lanes: np.ndarray
) -> list[tuple[int, int]]:
    """Neighbours along each lane, and what joins lanes."""
    out = []
    for lane in np.unique(lanes):
        own = np.flatnonzero(lanes == lane)
        own = own[np.argsort(place[own], kind="stable")]
        out += list(zip(own.tolist(), own[1:].tolist()))
    number_of = {name: k for k, name in enumerate(names)}
    for ends in machine.connections().values():
        known = [number_of[e] for e in (x.partition(".")[0] for x in ends) if e in number_of]
        if len(known) == 2 and lanes[known[0]] != lanes[known[1]]:
            out.append((known[0], known[1]))
    return out or [(0, 0)]


def _controls(labels: list[str], start: int) -> dict[str, Any]:
    at_once = {"frame": {"duration": 0, "redraw": False}, "transition": {"duration": 0}}
    play = {**at_once, "frame": {"duration": 70, "redraw": False}, "mode": "immediate"}
    stop = {**at_once, "mode": "immediate"}
    steps = [
        {"method": "animate", "label": words, "args": [[str(k)], stop]}
        for k, words in enumerate(labels)
    ]
    buttons = [
        {"method": "animate", "label": "play", "args": [None, play]},
        {"method": "animate", "label": "pause", "args": [[None], stop]},
    ]
    return {
        "sliders": [
            {
                "steps": steps,
                "active": start,
                "x": 0.0,
                "len": 1.0,
                "y": -0.02,
                "yanchor": "top",
                "pad": {"t": 52},
                "currentvalue": {"xanchor": "right", "font": {"size": 13, "color": GREY}},
                "ticklen": 0,
                "minorticklen": 0,
                "tickwidth": 0,
                "font": {"size": 1, "color": "rgba(0,0,0,0)"},
            }
        ],
        "updatemenus": [
            {
                "type": "buttons",
                "direction": "left",
                "showactive": False,
                "buttons": buttons,
                "x": 0.0,
                "xanchor": "left",
                "y": -0.02,
                "yanchor": "top",
                "pad": {"t": 8},
            }
        ],
    }
