"""What `jaxrotor run` does: simulate a study, write everything, say where it is."""

import json
import platform
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import SimulationFailed, SimulationInterrupted
from ..core.files import folder_written_whole
from ..core.interrupt import finishing, interrupted
from ..integrators.progress import Interrupted, interruptible
from ..study.settings import settings_of
from ..study.study import Study
from .made import made_of
from .options import study_name

DONE, FAILED = 0, 3
# Samples a turn below which figures show what is not there.
_SAMPLES = 5


def run_study(
    study: Study, out: Path | None = None, quiet: bool = False, force: bool = False
) -> int:
    """Returns the exit status: 0, or 3 where the simulation failed. What a run had that failed or was stopped
    is written; a stopped one then raises `KeyboardInterrupt`."""
    from .run_report import summary_table, write_report

    folder = out if out is not None else Path("results") / study.name
    failure: SimulationFailed | SimulationInterrupted | None = None
    began = time.perf_counter()
    with folder_written_whole(folder, force) as part:
        try:
            watched = not quiet and sys.stderr.isatty()
            if watched:
                print(f"{study.title or study.name}: compiling, then simulating", file=sys.stderr)
            shown = False if quiet else True if watched else None
            response = interruptible(lambda: study.run(progress=shown))
        except (SimulationFailed, SimulationInterrupted) as error:
            failure, response = error, error.response
        except Interrupted as stopped:
            if stopped.value is None:
                raise
            response = stopped.value
            failure = SimulationInterrupted(
                "the simulation was finished, not its figures", response
            )
        seconds = time.perf_counter() - began
        with finishing():
            response.save(part / "response.nc")
        if interrupted() and failure is None:
            failure = SimulationInterrupted("the figures are missing", response)
        extra = _extra(study, response, seconds, failure)
        trouble: Exception | None = None
        try:
            # who stops a run wants to go on, and a batch system gives it half a minute
            draw = not isinstance(failure, SimulationInterrupted)
            write_report(study, response, part, extra, draw=draw)
        except KeyboardInterrupt:
            failure = failure or SimulationInterrupted("the figures are missing", response)
            with finishing():
                extra = _extra(study, response, seconds, failure)
                write_report(study, response, part, extra, draw=False)
        except Exception as error:
            # The data are what counts, and took the time: they are kept, whatever a figure lacks.
            trouble = error
            extra["figures"] = f"not drawn: {type(error).__name__}: {error}"
            (part / "summary.json").write_text(json.dumps(extra, indent=2, default=str) + "\n")
        names = sorted(p.name for p in part.iterdir())
    if failure is not None:
        if trouble is not None:
            print(f"No figures of the failed run: {trouble}", file=sys.stderr)
        kept = f"What was computed before is in {folder}/response.nc"
        if isinstance(failure, SimulationInterrupted):
            raise KeyboardInterrupt(f"{failure}. {kept}")
        print(f"{failure}\n{kept}", file=sys.stderr)
        return FAILED
    if trouble is not None:
        print(f"The figures failed, but the data are in {folder}/response.nc", file=sys.stderr)
        raise trouble
    if not quiet:
        print(summary_table(response))
        print(f"\n{folder}/: {', '.join(names)}   ({seconds:.1f} s)")
        if words := _too_coarse(study.machine.wiring.stations, response):
            print(f"! {words}", file=sys.stderr)
    return DONE


def _too_coarse(stations: Iterable[str], response: Any) -> str | None:
    """What to say where a turn has too few samples to be seen."""
    speeds = [np.abs(np.asarray(response[s].speed)) for s in stations]
    top = max((float(np.nanmax(speed)) for speed in speeds), default=0.0)
    rate = 1 / float(response.t[1] - response.t[0])
    turns = top / (2 * np.pi)
    if turns == 0 or rate / turns >= _SAMPLES:
        return None
    return (
        f"{rate:g} Hz are {rate / turns:.1f} samples a turn at {top:.4g} rad/s: paths and spectra in the "
        f'figures mislead; take sample_rate = "{np.ceil(_SAMPLES * turns):.0f} Hz" or more'
    )


def _extra(study: Study, response: Any, seconds: float, failure: BaseException | None) -> dict:
    """What the summary says of the run beside its physics."""
    from ..simulation.export import versions

    return {
        "study": study_name(study),
        "title": study.title,
        "source": study.source,
        "made": made_of(study),
        "settings": settings_of(study.settings),
        "versions": {"python": platform.python_version(), **versions()},
        "timings": {"simulation_s": round(seconds, 3)},  # compiling included
        "solver": response.stats,
        "interrupted": isinstance(failure, SimulationInterrupted),
        "failed": None if failure is None else str(failure),
    }
