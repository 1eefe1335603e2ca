"""The page of a run: speed, vibration, orbits, waterfall, forces and torques, and the machine in motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..core.errors import InputError, JaxrotorError
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
from .motion import Course, animated, fine
from .page import Chapter, Interactive, Part, Table, Words
from .parts import closing_chapters, machine_chapter, shown, warnings_of
from .result import Result
from .thin import STRETCHES

RPM = 30 / np.pi
# Stations and parts that figures show.
_MOST = 3
# m, of a station that does not move across the axis.
_STILL = 1e-9
# Points across a map, and how far below its highest its colours reach, in tens.
_LINES, _FEWEST, _DECADES = 320, 40, 4
# Samples of a run.
_SHORTEST = 8


@dataclass(frozen=True)
class Samples:
    """What a run left in its file."""

    data: xr.Dataset

    @cached_property
    def t(self) -> np.ndarray:
        return self.data["time"].values

    @cached_property
    def stations(self) -> list[str]:
        return [str(s) for s in self.data["station"].values]

    @cached_property
    def position(self) -> np.ndarray:
        return self.data["position"].values

    def xy(self, name: str) -> np.ndarray:
        return self.position[:, self.stations.index(name), :2]

    def speed(self, name: str) -> np.ndarray:
        return self.data["speed"].values[:, self.stations.index(name)]

    def signals(self, quantity: str) -> dict[str, np.ndarray]:
        """Part -> values, of all that have it."""
        return {
            str(a.attrs["element"]): a.values
            for a in self.data.data_vars.values()
            if a.attrs.get("quantity") == quantity
        }

    @cached_property
    def swaying(self) -> list[str]:
        """Stations that move across the axis, what moves most first."""
        peaks = {n: float(np.nanmax(np.hypot(*self.xy(n).T), initial=0)) for n in self.stations}
        return sorted((n for n, p in peaks.items() if p > _STILL), key=lambda n: -peaks[n])


def read_samples(path: Path) -> Samples:
    """Raises `InputError` for a file that is damaged or no run of ours."""
    try:
        with xr.open_dataset(path, engine="h5netcdf") as found:
            data = found.load()
    except Exception as error:  # HDF5 has many of its own
        words = type(error).__name__
        raise InputError(f"`{path}`: cannot be read ({words}): run the study again") from None
    if not {"position", "speed", "time", "station"} <= {*data.variables}:
        raise InputError(f"`{path}`: is no run of jaxrotor: name the response.nc of one")
    # of a run that failed, what was computed before
    each = data["position"].values, data["speed"].values
    finite = np.logical_and(*(np.isfinite(x).reshape(len(x), -1).all(axis=1) for x in each))
    whole = finite.size if finite.all() else int(np.argmin(finite))
    if whole < _SHORTEST:
        raise InputError(
            f"`{path}`: holds {whole} samples, too few to be shown: run the study again"
        )
    return Samples(data.isel(time=slice(0, whole)))


def chapters(result: Result) -> list[Chapter]:
    assert result.run is not None
    samples = read_samples(result.run)
    asked = getattr(getattr(result.study, "report", None), "main", None)
    first = _shown(samples, result, asked)
    found = [Chapter("At a glance", _glance(samples, result)), machine_chapter(result)]
    moving = [n for n in first if n in samples.swaying]
    if result.study is not None and moving:
        course = Course(samples.t, samples.position[..., :2], samples.speed(first[0]))
        spec = animated(result.study.machine, samples.stations, course)
        if spec is not None:
            found.append(Chapter("In motion", [spec]))
    found.append(Chapter("Speed", _speeds(samples, first, _driven(samples, result, first))))
    if moving:
        found.append(Chapter("Vibration", _vibration(samples, moving)))
        found.append(Chapter("Orbits", _orbits(samples, moving)))
        found.append(Chapter("Waterfall", _waterfall(samples, moving[0])))
    if loads := _loads(samples):
        found.append(Chapter("Forces and torques", loads))
    tables = _peaks(result.summary)
    if tables:
        found.append(Chapter("Peaks", tables))
    own = [p.stem for p in result.folder.glob("[0-9][0-9]_*.png")]
    return [*found, *closing_chapters(result, own)]


def _shown(samples: Samples, result: Result, main: str | None) -> list[str]:
    """Stations in the foreground: rotors of the study, what moves most where none is known."""
    from ..plot import select

    usual = samples.swaying or samples.stations
    if result.study is not None:
        usual = [n for n in select.rotors(result.study.machine) if n in samples.stations] or usual
    if main in samples.stations:
        usual = [main, *(n for n in usual if n != main)]
    return usual[:_MOST]


def _glance(samples: Samples, result: Result) -> list[Part]:
    summary, attrs = result.summary, samples.data.attrs
    t, n = samples.t, len(samples.t)
    rows = [("simulated", f"{t[-1] - t[0]:.5g} s, {n} samples at {1 / (t[1] - t[0]):.5g} Hz")]
    top = max(samples.stations, key=lambda s: float(np.nanmax(np.abs(samples.speed(s)))))
    peak = float(np.nanmax(np.abs(samples.speed(top))))
    rows.append(("greatest speed", f"{RPM * peak:.5g} rpm ({peak:.5g} rad/s), of {top}"))
    if samples.swaying:
        name = samples.swaying[0]
        r = np.hypot(*samples.xy(name).T)
        k = int(np.nanargmax(r))
        at = f"at {t[k]:.4g} s and {RPM * samples.speed(name)[k]:.5g} rpm"
        rows.append(("largest displacement", f"{shown(r[k], 'm')}, of {name}, {at}"))
    solver = attrs.get("run_solver")
    if solver:
        order = f", order {attrs['run_order']}" if "run_order" in attrs else ""
        step = f", step {float(attrs['run_step']):.4g} s" if "run_step" in attrs else ""
        rows.append(("solver", f"{solver}{order}{step}"))
    error, tolerance = (attrs.get(f"run_{k}") for k in ("error", "tolerance"))
    if error is not None:
        asked = f"; {float(tolerance):.1g} was asked for" if tolerance else ""
        rows.append(("error, its own estimate", f"{float(error):.2g} of each peak{asked}"))
    coarse = ""
    if peak > 0 and (rate := 2 * np.pi / (peak * (t[1] - t[0]))) < 5:
        coarse = f"A turn has {rate:.1f} samples at the greatest speed: what happens within it is not seen."
    late = ""
    if error is not None and tolerance and float(error) > float(tolerance) > 0:
        late = (
            f"The run's own estimate of its error, {float(error):.1g} of a coordinate's peak, is above the "
            f"tolerance of {float(tolerance):.1g}."
        )
    failed = summary.get("failed")
    told = [f"The run did not end as it should: {failed}" if failed else "", late, coarse]
    parts: list[Part] = [*warnings_of(told), Table("The run", ("what", "value"), rows)]
    if n > 2 * STRETCHES + 2:
        parts.append(
            Words(
                f"Of each curve of {n} samples the least and the greatest value of each of {STRETCHES} "
                "stretches are drawn: every peak is there. Where an oscillation is too dense for a line its "
                "envelope is filled, until one zooms in. All samples are in response.nc."
            )
        )
    return parts


def _driven(samples: Samples, result: Result, names: list[str]) -> str | None:
    """The driven end, if there is one; where the study is not known the last station that none shown is."""
    from ..plot import select

    if result.study is not None:
        return select.drive(result.study.machine)
    return next((n for n in reversed(samples.stations) if n not in names), None)


def _speeds(samples: Samples, names: list[str], drive: str | None) -> list[Part]:
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


def _vibration(samples: Samples, names: list[str]) -> list[Part]:
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


def _orbits(samples: Samples, names: list[str]) -> list[Part]:
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


def _waterfall(samples: Samples, name: str) -> list[Part]:
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


def _loads(samples: Samples) -> list[Part]:
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


def _peaks(summary: Mapping[str, Any]) -> list[Part]:
    parts: list[Part] = []
    stations = summary.get("stations") or {}
    rows = []
    for name, one in stations.items():
        radial, tilt = one.get("radial_displacement_m", {}), one.get("tilt_rad", {})
        force = one.get("bearing_force_N", {})
        moved = (radial.get("peak") or 0) > 0
        rows.append(
            (
                name,
                f"{1e3 * radial['peak']:.4g}" if radial else "-",
                f"{radial['time_s']:.4g}" if moved else "-",
                f"{RPM * radial['speed_rad_s']:.5g}" if moved else "-",
                f"{1e3 * tilt['peak']:.3g}" if tilt else "-",
                f"{force['peak']:.4g}" if force else "-",
            )
        )
    if rows:
        header = (
            "station",
            "displacement, mm",
            "at, s",
            "at, rpm",
            "tilt, mrad",
            "bearing force, N",
        )
        parts.append(Table("Peaks of the stations", header, rows))
    rows = [
        (
            name,
            f"{one['torque_Nm']['peak']:.5g}",
            f"{one['torque_Nm']['time_s']:.4g}",
            f"{RPM * one['torque_Nm']['speed_rad_s']:.5g}",
        )
        for name, one in (summary.get("connectors") or {}).items()
    ]
    if rows:
        header = ("part", "torque, N·m", "at, s", "at, rpm of the drive")
        parts.append(Table("Peaks of the torques", header, rows))
    return parts
