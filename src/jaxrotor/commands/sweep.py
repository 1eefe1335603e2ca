"""What `jaxrotor sweep` does with the [sweep] section of a study."""

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import xarray as xr

from ..core.errors import InputError, JaxrotorError, MissingExtraError
from ..core.files import check_folder, save_json
from ..integrators.progress import interruptible
from ..study.study import Study
from ..study.sweep import Sweep
from ..sweeps.store import state_of
from ..sweeps.sweep import asked, sweep
from .options import study_name
from .output import save_figure
from .sweep_figures import figures_of
from .sweep_summary import summary_of, table_of

STORE = "sweep.zarr"


def sweep_study(
    study: Study, store: Path | None = None, progress: bool | None = None, resume: bool = True
) -> xr.Dataset:
    """Runs the sweep that the study asks for; `store`, `resume` and `progress` as in `jaxrotor.sweep`."""
    asked = _asked(study)
    found = sweep(
        study.machine,
        asked.cases,
        asked.outputs,
        study.settings,
        store=store,
        resume=resume,
        chunk=asked.chunk,
        progress=progress,
    )
    for name, unit in asked.units.items():
        if name in found:
            found[name].attrs["units"] = unit
    return found


def check_sweep(study: Study) -> None:
    """Raises `InputError` with what `sweep` refuses before it runs anything."""
    _check_zarr()
    told = _asked(study)
    asked(study.machine, told.cases, told.outputs, study.settings)


def _check_zarr() -> None:
    if find_spec("zarr") is None:
        raise MissingExtraError(
            'sweep: needs zarr, which is not installed: pip install "jaxrotor[sweep]"'
        )


def _asked(study: Study) -> Sweep:
    if study.sweep is None:
        raise InputError(
            f"`{study_name(study)}`: has no [sweep] section: give it parameters and outputs"
        )
    return study.sweep


def run_sweep(
    study: Study, out: Path | None, resume: bool = False, quiet: bool = False, force: bool = False
) -> int:
    """The store, percentiles, shares within limits, figures."""
    asked = _asked(study)
    _check_zarr()
    folder = out if out is not None else Path("results") / f"{study.name}_sweep"
    check_folder(folder, force)
    store = folder / STORE
    _refuse_unfinished(store, resume, force)
    watched = not quiet and sys.stderr.isatty()
    if watched:
        words = f"{len(asked.cases)} cases"
        print(f"{study.title or study.name}: compiling, then {words}", file=sys.stderr)
    with _replaced(folder, store, resume):
        try:
            found = interruptible(
                lambda: sweep_study(study, store, progress=watched, resume=resume)
            )
        except KeyboardInterrupt:
            raise KeyboardInterrupt(_kept(store, _aside(store))) from None
    told = summary_of(study, found)
    trouble: Exception | None = None
    try:
        for name, figure in figures_of(study, found):
            save_figure(figure, folder / f"{name}.png")
    except Exception as error:
        # The data are what counts, and took the time: they are kept, whatever a figure lacks.
        trouble = error
        told["figures"] = f"not drawn: {type(error).__name__}: {error}"
    save_json(folder / "summary.json", told)
    if trouble is not None:
        print(f"The figures failed, but the data are in {store}", file=sys.stderr)
        raise trouble
    if not quiet:
        print(table_of(study, told))
    print(f"{folder}/: {', '.join(sorted(path.name for path in folder.iterdir()))}")
    return 0


def _refuse_unfinished(store: Path, resume: bool, force: bool) -> None:
    state = None if resume or force else state_of(store)
    if state is None or state[0] == state[1]:
        return
    raise InputError(
        f"`{store}`: holds a sweep that was stopped, {state[0]} of {state[1]} chunks are done: add --resume "
        "to go on with it, or --force to begin anew"
    )


@contextmanager
def _replaced(folder: Path, store: Path, resume: bool) -> Iterator[None]:
    """An earlier sweep stands aside, with its summary and figures, and goes when the new one is whole: at
    every instant one of them is, whenever the program is killed."""
    aside = _aside(store)
    if aside.is_dir() and not store.exists():  # killed before the new one was begun
        _back(folder, aside)
    if store.exists() and not resume:
        if (
            aside.is_dir()
        ):  # for a sweep that was stopped, or for one that was killed at its very end
            whole = state_of(store)
            shutil.rmtree(aside if whole and whole[0] == whole[1] else store)
        if store.exists():
            aside.mkdir()
            os.replace(store, aside / STORE)
    try:
        yield
    except BaseException:
        if aside.is_dir() and not store.exists():
            _back(folder, aside)
        raise
    finally:
        if aside.is_dir() and store.exists():
            # of the run before: they would pass for this one's, if it was stopped
            for old in [folder / "summary.json", *folder.glob("*.png")]:
                if old.exists():
                    os.replace(old, aside / old.name)
    shutil.rmtree(aside, ignore_errors=True)


def _aside(store: Path) -> Path:
    """Where an earlier sweep waits for the new one to be whole."""
    return store.with_name(f".{store.name}.before")


def _back(folder: Path, aside: Path) -> None:
    # the store last: while it is missing, this is done again
    for file in sorted(aside.iterdir(), key=lambda f: f.name == STORE):
        os.replace(file, folder / file.name)
    aside.rmdir()


def _kept(store: Path, aside: Path) -> str:
    try:
        state = state_of(store)
    except JaxrotorError as error:
        return str(error)
    if state is None or not state[1]:
        return "nothing was written"
    earlier = f"; the earlier sweep is in {aside}" if aside.is_dir() else ""
    return f"{state[0]} of {state[1]} chunks are kept in {store}: go on with --resume{earlier}"
