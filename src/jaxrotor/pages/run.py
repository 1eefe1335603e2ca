"""The page of a run: speed, vibration, orbits, waterfall, forces and torques, and the machine in motion."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .motion import Course, animated
from .page import Chapter, Part, Table, Words
from .parts import closing_chapters, machine_chapter, shown, warnings_of
from .result import Result
from .run_figures import RPM, cascade, loads, orbits, speeds, vibration
from .samples import Samples, read_samples
from .thin import STRETCHES

# Stations that figures show.
_MOST = 3


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
    found.append(Chapter("Speed", speeds(samples, first, _driven(samples, result, first))))
    if moving:
        found.append(Chapter("Vibration", vibration(samples, moving)))
        found.append(Chapter("Orbits", orbits(samples, moving)))
        found.append(Chapter("Waterfall", cascade(samples, moving[0])))
    if borne := loads(samples):
        found.append(Chapter("Forces and torques", borne))
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
