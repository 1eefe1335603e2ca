"""What `jaxrotor torsional` does: modes with torques, separation, forced response, and the start."""

import sys
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, SimulationFailed
from ..core.files import folder_written_whole, save_json, written_whole
from ..linear.torsion import TorsionalMode, holzer_table, torsional_modes
from ..standards.finding import Assessment, Finding
from ..standards.torsional import (
    TorsionalExcitation,
    excitation_bands,
    torsional_separation,
)
from ..study.study import Study
from ..study.torsional import Torsional
from ..study.torsional_checks import excitations_of, lives
from .made import made_of
from .options import RPM, study_name
from .output import save_figure, save_table
from .torsional_response import Forced, forced_response
from .torsional_start import Start, start_of

DONE, FAILED = 0, 3


def run_torsional(study: Study, out: Path | None, force: bool, run: bool, quiet: bool) -> int:
    """Writes figures, tables and summary.json; prints what counts. Returns the exit status: 0, or 3 where the
    simulation failed, and the start is missing."""
    from ..plot.torsional import (
        start_transient,
        torque_over_speed,
        torsional_interference,
        torsional_shapes,
    )

    machine = study.machine
    asked = study.torsional if study.torsional is not None else Torsional()
    speeds = asked.speeds or _speed_of_drive(study)
    excitations = excitations_of(machine, asked, speeds)
    found = torsional_separation(
        machine, speeds, excitations, margin=asked.margin, count=asked.modes, each=True
    )
    bands = np.asarray(excitation_bands(machine, excitations, speeds))
    middle = 0.5 * (speeds[0] + speeds[1])
    modes = torsional_modes(
        machine, middle, max(1, len(found.findings) // max(1, len(bands))), "undeformed"
    )
    forced = forced_response(machine, asked, modes, speeds)
    life = Assessment(tuple(one for one, _ in lives(machine, asked, len(modes), speeds)))
    start = failure = None
    try:
        start = start_of(study, asked, modes, quiet) if run else None
    except SimulationFailed as error:  # the rest needs no run, and is written
        failure = error
    folder = out if out is not None else Path("results") / f"{study.name}_torsional"
    with folder_written_whole(folder, force) as part:
        with written_whole(part / "holzer.txt") as file:
            Path(file).write_text("\n\n".join(map(holzer_table, modes)) + "\n")
        save_figure(torsional_shapes(modes), part / "modes.png")
        drawn = torsional_interference(machine, speeds, excitations, None, asked.margin, len(modes))
        save_figure(drawn, part / "interference.png")
        if forced is not None:
            drawn = torque_over_speed(
                forced.speeds, forced.values, speeds, forced.limits, forced.units
            )
            save_figure(drawn, part / "response.png")
            save_table(part / "response.csv", *_columns(forced))
        if start is not None:
            drawn = start_transient(
                start.t, start.torques, start.speed, start.passages, start.station
            )
            save_figure(drawn, part / "start.png")
        summary = {
            "study": study_name(study),
            "made": made_of(study),
            "speeds_rad_s": list(speeds),
            "modes": [_told(mode) for mode in modes],
            "excitations": [
                {"name": one.name, "lowest_rad_s": float(a), "highest_rad_s": float(b)}
                for one, (a, b) in zip(excitations, bands)
            ],
            "findings": [_plain(f) for f in (found + life + _of(start)).findings],
            "passages_rad_s": {} if start is None else start.passages,
        }
        save_json(part / "summary.json", summary)
        names = sorted(p.name for p in part.iterdir())
    _print(study, modes, found, life, start, excitations, speeds)
    print(f"{folder}/: {', '.join(names)}")
    if failure is not None:
        print(f"{failure}\nThe start is missing for it", file=sys.stderr)
        return FAILED
    return DONE


def _speed_of_drive(study: Study) -> tuple[float, float]:
    from ..simulation.prescribed import top_speed

    top = 0.0
    if study.simulation is not None:
        top = top_speed(study.machine, study.settings.t_end, study.settings.speed)[1]
    if not top > 0:
        raise InputError(
            "`torsional`: speeds are missing, and this study's drive gives none: write [torsional] with "
            'speeds = ["1450 rpm", "1500 rpm"]'
        )
    return top, top


def _of(start: Start | None) -> Assessment:
    return Assessment(()) if start is None else start.found


def _columns(forced: Forced) -> tuple[list[str], list[list[str]]]:
    pairs = [(part, name) for part, lines in forced.values.items() for name in lines]
    header = ["speed, rad/s"]
    header += [f"{part} by {name}, {forced.units[part]}" for part, name in pairs]
    rows = np.stack([forced.speeds, *(forced.values[p][n] for p, n in pairs)], axis=1)
    return header, [[f"{x:.10g}" for x in row] for row in rows]


def _told(mode: TorsionalMode) -> dict[str, Any]:
    return {
        "name": mode.name,
        "frequency_rad_s": mode.frequency,
        "damping_ratio": mode.damping_ratio,
        "angles_rad": {k: v.real for k, v in mode.angles.items()},
        "torques_N_m": {k: v.real for k, v in mode.torques.items()},
        "tooth_forces_N": {k: v.real for k, v in mode.tooth_forces.items()},
    }


def _plain(one: Finding) -> dict[str, Any]:
    value, limit = float(one.value), float(one.limit)
    return {
        "check": one.check,
        "place": one.place,
        "value": value if np.isfinite(value) else str(value),
        "limit": None if np.isnan(limit) else limit,
        "sense": one.sense,
        "unit": one.unit,
        "met": None if one.sense == "for information" else bool(one.met),
        "source": one.source,
    }


def _print(
    study: Study,
    modes: list[TorsionalMode],
    found: Assessment,
    life: Assessment,
    start: Start | None,
    excitations: tuple[TorsionalExcitation, ...],
    speeds: tuple[float, float],
) -> None:
    low, high = (RPM * speed for speed in speeds)
    at = f"{low:.6g} rpm" if low == high else f"{low:.6g} to {high:.6g} rpm"
    print(f"{study.title or study.name}: torsion at {at}")
    many = len(excitations)
    for k, mode in enumerate(modes):
        mine = found.findings[k * many : (k + 1) * many]
        near = min(mine, key=lambda f: float(f.value), default=None)
        line = f"  {mode.name}: {mode.frequency / (2 * np.pi):.4g} Hz, damping {mode.damping_ratio:.2%}"
        if near is not None:
            verdict = "met" if bool(near.met) else "NOT met"
            cause = near.place.partition(", ")[2]
            line += f"; nearest {cause}, separation {100 * float(near.value):.1f} % ({verdict})"
        print(line)
        for other in mine:
            if other is not near and not bool(other.met):
                cause = other.place.partition(", ")[2]
                print(f"    {cause}: separation {100 * float(other.value):.1f} % (NOT met)")
    if life.findings:
        print(life)
    if start is not None:
        for name, speed in start.passages.items():
            print(f"  in the start {name} is met at {RPM * speed:.5g} rpm")
        print(start.found)
        for words in start.notes:
            print(f"! {words}")
