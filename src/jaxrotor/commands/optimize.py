"""What `jaxrotor optimize` does with the [optimize] section of a study."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.files import check_folder, folder_written_whole, save_json
from ..machine.paths import split_entry
from ..objectives.criterion import Constraint
from ..objectives.machine_measures import ResponsePeaks, unit_on
from ..objectives.measure import AbstractSignalMeasure
from ..optimization.experiment import SimulatedRun
from ..optimization.optimize import optimize
from ..optimization.optimum import Optimum
from ..study.study import Study
from .made import made_of
from .options import study_name
from .output import save_figure, save_table


def optimize_study(study: Study, progress: bool | None = None) -> Optimum:
    """Runs the optimisation that the study asks for."""
    if study.optimize is None:
        raise InputError(
            f"`{study_name(study)}`: has no [optimize] section: give it unknowns and an objective"
        )
    asked = study.optimize
    found = optimize(
        study.machine,
        asked.unknowns,
        asked.objective,
        asked.constraints,
        starts=asked.starts,
        progress=progress,
        **asked.options,
    )
    units = {unit_on(measure, study.machine) for _, _, measure, _ in asked.objective.terms}
    return dataclasses.replace(found, unit=units.pop() if len(units) == 1 else "")


def run_optimize(study: Study, out: Path | None, quiet: bool, force: bool) -> int:
    """The optimum, figures, a machine-readable result, and the study with the best values."""
    from .save_study import save_study

    folder = out if out is not None else Path("results") / f"{study.name}_optimize"
    check_folder(folder, force)  # before the search, which may take long
    found = optimize_study(study, progress=False if quiet else None)
    asked = study.optimize
    named = [path for one in asked.unknowns for path in (one.path, *one.also)]
    changed = tuple(dict.fromkeys(split_entry(path)[0] for path in named))
    with folder_written_whole(folder, force) as part:
        for name, figure in _figures(found, asked.constraints).items():
            save_figure(figure, part / f"{name}.png")
        save_study(study, found.machine, changed, part / f"{study.name}_optimized.toml")
        _save_history(found, part / "history.csv")
        summary = {"study": study_name(study), "made": made_of(study), **found.to_dict()}
        save_json(part / "summary.json", summary)
    if not quiet:
        print(found)
    if found.interrupted:
        raise KeyboardInterrupt(f"the best design so far, unfinished, is in {folder}/")
    print(f"{folder}/: {', '.join(sorted(path.name for path in folder.iterdir()))}")
    return 0


def _save_history(found: Optimum, path: Path) -> None:
    from ..plot.design import search_steps

    header = ["evaluation", "search", f"objective, {found.unit}".rstrip(", "), "bounds missed by"]
    rows = [
        [str(k), str(search), f"{value:.10g}", f"{missed:.4g}"]
        for k, (search, value, missed) in enumerate(zip(*search_steps(found)), 1)
    ]
    save_table(path, header, rows)


def _figures(found: Optimum, constraints: Sequence[Constraint]) -> dict[str, Any]:
    from ..plot.design import before_after, peaks_before_after, search_history

    figures = {"history": search_history(found)}
    peaks: list[Any] = []
    for experiment, measures in zip(found.problem.experiments, found.problem.measures):
        peaks += [m for m in measures if isinstance(m, ResponsePeaks)]
        watched = [m for m in measures if isinstance(m, AbstractSignalMeasure)]
        if isinstance(experiment, SimulatedRun) and watched:
            before, after = (experiment.outcome(m) for m in (found.before, found.machine))
            figures["before_after"] = before_after(watched, before, after, constraints)
    if peaks:
        figures["response"] = peaks_before_after(peaks, found.before, found.machine, constraints)
    return figures
