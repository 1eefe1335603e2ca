"""What `jaxrotor identify` does with the [identify] section of a study."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.files import check_folder, folder_written_whole, save_json
from ..identification.identification import Identification
from ..identification.identify import asked, identify
from ..identification.measured_run import MeasuredRun
from ..identification.profile import LikelihoodProfile, likelihood_profiles
from ..identification.read_response import read_response
from ..identification.trials import Trial
from ..sensors.read import read_record
from ..study.study import Study
from .made import made_of
from .options import study_name
from .output import save_figure, save_table


def identify_study(study: Study, progress: bool | None = None) -> Identification:
    """Runs the identification that the study asks for. What was found out about the files is said, unless
    `progress` is `False`."""
    given = _arguments(study)
    for trial in given["data"] if progress is not False else ():
        for note in trial.record.notes if isinstance(trial, MeasuredRun) else ():
            print(f"! {note}", file=sys.stderr)
    return identify(**given, progress=progress)


def check_identify(study: Study) -> None:
    """Raises `InputError` with what `identify` refuses before it runs anything, its records among it."""
    asked(**_arguments(study))


def _arguments(study: Study) -> dict[str, Any]:
    """Those of `identify`."""
    if study.identify is None:
        raise InputError(
            f"`{study_name(study)}`: has no [identify] section: give it records, sensors and unknowns"
        )
    told = study.identify
    reading: list[Callable[[], Trial]] = [
        lambda f=file, c=conditions: MeasuredRun(read_record(f), study.settings, c)
        for file, conditions in told.records
    ]
    reading += [lambda f=file: read_response(f, study.machine) for file in told.responses]
    trials, problems = [], []
    for read in reading:
        try:
            trials.append(read())
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(*problems)
    return dict(
        machine=study.machine,
        parameters=told.unknowns,
        sensors=told.sensors,
        data=trials,
        stages=told.stages,
        loss=told.loss,
        shaft=told.shaft,
    )


def run_identify(study: Study, out: Path | None, quiet: bool, force: bool) -> int:
    """Estimates, figures, a machine-readable result, and the study with the identified values."""
    folder = out if out is not None else Path("results") / f"{study.name}_identify"
    check_folder(folder, force)  # before the search, which may take long
    found = identify_study(study, progress=False if quiet else None)
    assert study.identify is not None
    curves: dict[str, LikelihoodProfile] = {}
    by_profile = _write(study, found, curves, folder, force)
    if not quiet:
        print(found, flush=True)  # profiles take longer than all before
    if study.identify.profile and not found.interrupted:
        blind = {path for direction in found.blind for path in direction}
        seen = [path for path in found.paths if path not in blind]
        try:
            curves = likelihood_profiles(found, seen, progress=False if quiet else None)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"the estimates are in {folder}/, without profiles") from None
        by_profile = _write(study, found, curves, folder, True)
    if found.interrupted:
        raise KeyboardInterrupt(f"the estimates so far, unfinished, are in {folder}/")
    if by_profile and not quiet:
        print("95 % intervals by profile, which are right where they differ from those above:")
        for (path, (low, high)), curve in zip(by_profile.items(), curves.values()):
            print(
                f"{path:{max(map(len, by_profile))}}  {low:.6g} to {high:.6g} {curve.unit}".rstrip()
            )
    print(f"{folder}/: {', '.join(sorted(path.name for path in folder.iterdir()))}")
    return 0


def _write(
    study: Study,
    found: Identification,
    curves: dict[str, LikelihoodProfile],
    folder: Path,
    force: bool,
) -> dict[str, tuple[float, float]]:
    """Everything that is known so far, into the folder; returns the intervals by profile."""
    from ..plot.identification import channel_fits, correlations, costs, profile_curves
    from .save_study import save_study

    reach = found.knowledge.quantile(0.95)
    by_profile = {path: curve.interval(reach) for path, curve in curves.items()}
    with folder_written_whole(folder, force) as part:
        for name, draw in (("fit", channel_fits), ("correlation", correlations), ("cost", costs)):
            save_figure(draw(found), part / f"{name}.png")
        if curves:
            save_figure(profile_curves(found, curves), part / "profile.png")
        save_study(study, found.machine, found.changed, part / f"{study.name}_identified.toml")
        _save_fits(found, part / "fit.csv")
        costs_told = {name: [float(x) for x in cost] for name, cost in found.histories.items()}
        summary = {"study": study_name(study), "made": made_of(study), **found.to_dict()}
        summary["costs"] = costs_told
        for path, ends in by_profile.items():
            finite = [x if np.isfinite(x) else None for x in ends]
            summary["parameters"][path]["interval_95_by_profile"] = finite
        save_json(part / "summary.json", summary)
    return by_profile


def _save_fits(found: Identification, path: Path) -> None:
    """What was measured and what is identified, channel after channel; the imaginary parts are those of
    vectors."""
    header = ["run", "channel", "unit", "over", "at, SI", "measured", "identified"]
    header += ["measured, imaginary", "identified, imaginary"]
    rows = []
    for fit in found.channels:
        own = [fit.run, fit.channel, fit.unit, fit.over]
        vectors = np.iscomplexobj(fit.measured)
        for t, seen, told in zip(fit.t, fit.measured, fit.simulated):
            values = [t, np.real(seen), np.real(told)]
            values += [np.imag(seen), np.imag(told)] if vectors else []
            rows.append([*own, *(f"{x:.8g}" for x in values), *[""] * (5 - len(values))])
    save_table(path, header, rows)
