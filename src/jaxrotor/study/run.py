"""What `jaxrotor run` does: simulate a study, write everything, say where it is."""

import json
import platform
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import SimulationFailed
from ..protocol import AbstractStation
from .files import folder_written_whole
from .study import Study

DONE, FAILED = 0, 3


def run_study(
    study: Study, out: Path | None = None, quiet: bool = False, force: bool = False
) -> int:
    """Returns the exit status: 0, or 3 where the simulation failed (what it had is written)."""
    from ..report import write_report

    folder = out if out is not None else Path("results") / study.name
    failure: SimulationFailed | None = None
    began = time.perf_counter()
    with folder_written_whole(folder, force) as part:
        try:
            response = study.run(progress=False if quiet else None)
        except SimulationFailed as error:
            failure, response = error, error.response
        seconds = time.perf_counter() - began
        extra = _extra(study, response, seconds, failure)
        response.save(part / "response.nc")
        try:
            write_report(study, response, part, extra)
        except Exception as error:
            if failure is None:
                raise
            # Half a run need not make whole figures: the data are what counts.
            print(f"No figures of the failed run: {error}", file=sys.stderr)
            (part / "summary.json").write_text(json.dumps(extra, indent=2, default=str) + "\n")
        names = sorted(p.name for p in part.iterdir())
    if failure is not None:
        print(f"{failure}\nWhat was computed before is in {folder}/response.nc", file=sys.stderr)
        return FAILED
    if not quiet:
        print(table(study, response))
        print(f"\n{folder}/: {', '.join(names)}   ({seconds:.1f} s)")
    return DONE


def _extra(study: Study, response: Any, seconds: float, failure: Exception | None) -> dict:
    """What the summary says of the run beside its physics."""
    from ..solve.export import versions

    return {
        "study": str(study.path) if study.path is not None else study.name,
        "title": study.title,
        "source": study.source,
        "settings": study.settings.model_dump(exclude_none=True),
        "versions": {"python": platform.python_version(), **versions()},
        "timings": {"simulation_s": round(seconds, 3)},  # compiling included
        "solver": response.stats,
        "failed": None if failure is None else str(failure),
    }


def table(study: Study, response: Any) -> str:
    """Peaks of every station, with the speed and time at which they occur."""
    rows = [("station", "lateral peak", "at speed", "at time", "bearing force")]
    t = np.asarray(response.t)
    for name, element in study.machine.elements().items():
        if not isinstance(element, AbstractStation):
            continue
        station = response[name]
        lateral = np.hypot(np.asarray(station.x), np.asarray(station.y))
        k = int(np.argmax(lateral))
        force = "-"
        if "bearing_force" in getattr(element, "signals", {}):
            force = f"{np.linalg.norm(np.asarray(station.bearing_force), axis=-1).max():.4g} N"
        if lateral[k] == 0.0:
            rows.append((name, "0 mm", "-", "-", force))
            continue
        speed = float(np.asarray(station.speed)[k])
        rows.append(
            (name, f"{1e3 * lateral[k]:.4g} mm", f"{speed:.4g} rad/s", f"{t[k]:.4g} s", force)
        )
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths)).rstrip() for row in rows]
    return "\n".join([lines[0], "-" * max(map(len, lines)), *lines[1:]])
