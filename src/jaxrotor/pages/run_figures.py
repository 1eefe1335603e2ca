"""Figures of a run: speed, vibration, orbits, waterfall, forces and torques."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.errors import JaxrotorError
from ..diagnostics.waterfall import waterfall
from ..plot.labels import readable
from .charts import (
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    OF_AXIS,
    ORANGE,
    PURPLE,
    Curve,
    Panel,
    plain,
    squares,
    stacked,
)
from .motion import fine
from .page import Interactive, Part, Words
from .samples import Samples

RPM = 30 / np.pi
# Bearings that are drawn; twice as many shafts.
_MOST = 3
# Points across a map, and how far below its highest its colours reach, in tens.
_LINES, _FEWEST, _DECADES = 320, 40, 4


def speeds(samples: Samples, names: list[str], drive: str | None) -> list[Part]:
    every = {n: RPM * samples.speed(n) for n in samples.stations}
    reference = drive or names[0]
    ratio = _ratio(every, reference)
    shown = [(reference, GREY)]
    # lines that lie on each other tell nothing: those that gears make turn otherwise
    shown += [(n, c) for n, c in zip(names, COLOURS) if abs(ratio[n] - 1) > 0.05]
    curves = [Curve(n, samples.t, every[n], c) for n, c in shown]
    panels = [Panel("Speed" if len(shown) > 1 else f"Speed of {reference}", "speed, rpm", curves)]
    less = [
        Curve(n, samples.t, every[n] - ratio[n] * every[reference], c)
        for n, c in zip(names, COLOURS)
        if n != reference and drive is not None
    ]
    if less and max(float(np.nanmax(np.abs(c.y))) for c in less) > 1e-9:
        times = "" if len(shown) == 1 else ", times what the gears make of it"
        panels.append(Panel(f"Speed less that of {reference}{times}", "speed, rpm", less))
    words = "Speed, and by how much the rotors run ahead" if len(panels) > 1 else "Speed"
    return [Interactive(words, stacked(panels, "time, s", _whole(samples)))]


def _ratio(every: Mapping[str, np.ndarray], reference: str) -> dict[str, float]:
    """How many times as fast as the reference each turns on the whole: gears."""
    own = every[reference]
    size = float(np.nansum(own * own))
    exact = {n: float(np.nansum(w * own)) / size if size else 1.0 for n, w in every.items()}
    return {n: 1.0 if abs(r - 1) < 0.05 else r for n, r in exact.items()}


def _whole(samples: Samples) -> dict[str, Any]:
    return {"range": [float(samples.t[0]), float(samples.t[-1])]}


def vibration(samples: Samples, names: list[str]) -> list[Part]:
    size, unit = readable("m", [np.nanmax(np.abs(samples.xy(n))) for n in names])
    panels = [
        Panel(
            f"{n}: displacement across the axis",
            unit,
            [
                Curve(c, samples.t, size * samples.xy(n)[:, k], OF_AXIS[c])
                for k, c in enumerate("xy")
            ],
        )
        for n in names
    ]
    speeds = {n: RPM * np.abs(samples.speed(n)) for n in names}
    radial = [
        Panel(
            f"{n}: distance over its speed",
            unit,
            [Curve("distance", speeds[n], size * np.hypot(*samples.xy(n).T), PURPLE)],
        )
        for n in names
    ]
    tops = [float(w.max()) for w in speeds.values()]
    # gears make speeds differ: over one axis half of a panel would be empty
    together = [radial] if max(tops) <= 1.05 * min(tops) else [[one] for one in radial]
    return [
        Interactive("Displacements over time", stacked(panels, "time, s", _whole(samples))),
        *(
            Interactive("Distance from the axis over speed", stacked(own, "speed, rpm"))
            for own in together
        ),
    ]


def orbits(samples: Samples, names: list[str]) -> list[Part]:
    size, unit = readable("m", [np.nanmax(np.abs(samples.xy(n))) for n in names])
    t, panels = samples.t, []
    for name in names:
        xy, speed = size * samples.xy(name), np.abs(samples.speed(name))
        curves = []
        peak = int(np.nanargmax(np.hypot(*xy.T)))
        for k, words, colour in (
            (peak, "at its largest", BLUE),
            (len(t) - 1, "at the end", ORANGE),
        ):
            turn = 2 * np.pi / max(float(speed[k]), 1e-9)
            around = 3 * turn if k == peak else 6 * turn
            path = fine(t, xy, t[k] - around, t[k] + (around if k == peak else 0.0), 400)
            curves.append(Curve(words, path[:, 0], path[:, 1], colour))
        panels.append((name, curves))
    words = "Orbits: three turns to either side of the largest displacement, and the last six turns"
    return [Interactive(words, squares(panels, unit))]


def cascade(samples: Samples, name: str) -> list[Part]:
    t, speed = samples.t, samples.speed(name)
    rate = 1 / float(t[1] - t[0])
    signal = samples.xy(name)[:, 0]
    try:
        found = waterfall(signal - signal.mean(), speed, rate)
    except JaxrotorError as error:
        return [Words(f"Not drawn: {error}.")]
    top = float(np.max(np.abs(speed))) / (2 * np.pi)
    wanted = max(4.5 * top, _FEWEST * found.frequency[1]) if top > 0 else np.inf
    reach = min(float(found.frequency[-1]), wanted)
    inside = found.frequency <= reach
    step = max(1, -(-int(inside.sum()) // _LINES))
    frequency, amplitude = found.frequency[inside], found.amplitude[:, inside]
    whole = frequency.size // step * step
    frequency = frequency[:whole:step] + 0.5 * (step - 1) * frequency[1]
    amplitude = amplitude[:, :whole].reshape(len(amplitude), -1, step).max(axis=2)
    size, unit = readable("m", [amplitude.max()])
    height = float(size * amplitude.max()) or 1.0
    decades = np.log10(np.maximum(size * amplitude, height * 10.0**-_DECADES))
    ticks = np.arange(np.ceil(np.log10(height) - _DECADES), np.log10(height) + 0.01)
    spec: dict[str, Any] = {
        "data": [
            {
                "type": "heatmap",
                "x": plain(frequency),
                "y": plain(found.time + t[0]),
                "z": plain(decades, 3),
                "customdata": [[c] * len(frequency) for c in plain(RPM * found.speed, 4)],
                "hovertemplate": "%{x:.4g} Hz, %{y:.4g} s<br>%{customdata} rpm<extra></extra>",
                "colorscale": "Viridis",
                "colorbar": {
                    "title": {"text": f"amplitude, {unit}", "side": "right"},
                    "tickvals": ticks.tolist(),
                    "ticktext": [f"{10.0**k:.3g}" for k in ticks],
                    "thickness": 14,
                    "outlinewidth": 0,
                },
            },
            *_orders(found, t[0], reach),
        ],
        "layout": {
            "height": 440,
            "margin": {"l": 70, "r": 20, "t": 30, "b": 56},
            "xaxis": {"title": {"text": "frequency, Hz"}, "range": [0.0, reach]},
            "yaxis": {"title": {"text": "time, s"}},
            "showlegend": False,
        },
    }
    return [Interactive(f"Spectra of x of {name} over time; dotted: once and twice a turn", spec)]


def _orders(found: Any, start: float, reach: float) -> list[dict[str, Any]]:
    lines = []
    for order in (1, 2):
        at = order * np.abs(found.speed) / (2 * np.pi)
        if np.min(at) <= reach:
            lines.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": plain(np.where(at <= reach, at, np.nan)),
                    "y": plain(found.time + start),
                    "line": {"color": "#ffffff", "width": 1, "dash": "dot"},
                    "hoverinfo": "skip",
                }
            )
    return lines


def loads(samples: Samples) -> list[Part]:
    """Of bearings what they bear, of shafts their torques; each in a panel of its own: lines that lie on top
    of each other tell nothing."""
    panels: list[Panel] = []
    forces = samples.signals("bearing_force")
    for name, values in list(forces.items())[:_MOST]:
        size, unit = readable("N", values)
        curves = [
            Curve(f"F{c}", samples.t, size * values[:, k], OF_AXIS[c]) for k, c in enumerate("xy")
        ]
        panels.append(Panel(f"{name}: force on the base", unit, curves))
    parts: list[Part] = []
    if panels:
        parts.append(Interactive("Bearing forces", stacked(panels, "time, s", _whole(samples))))
    torques = {n: v for n, v in samples.signals("torque").items() if v.ndim == 1}
    largest = sorted(torques, key=lambda n: -float(np.nanmax(np.abs(torques[n]), initial=0.0)))
    kept = [n for n in torques if n in largest[: 2 * _MOST]]
    if kept and np.nanmax(np.abs(torques[largest[0]]), initial=0.0) > 0:
        rows = []
        for name in kept:
            size, unit = readable("N*m", torques[name])
            rows.append(Panel(name, unit, [Curve(name, samples.t, size * torques[name], GREEN)]))
        more = f", the {len(kept)} largest of {len(torques)}" if len(kept) < len(torques) else ""
        spec = stacked(rows, "time, s", _whole(samples))
        spec["layout"]["margin"]["r"], spec["layout"]["showlegend"] = 24, False
        parts.append(Interactive(f"Torques{more}", spec))
    return parts
