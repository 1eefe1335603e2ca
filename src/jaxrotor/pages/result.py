"""What a folder of results holds: found, read, and refused in a sentence."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.errors import InputError, JaxrotorError
from ..study.study import Study, load

SUMMARY, RUN, SWEEP = "summary.json", "response.nc", "sweep.zarr"
# Keys of a summary that only this command writes.
_KINDS: dict[str, tuple[str, ...]] = {
    "run": ("stations", "samples"),
    "sweep": ("outputs", "cases"),
    "identify": ("correlation", "parameters"),
    "optimize": ("objective", "evaluations"),
    "campbell": ("critical_modes", "modes"),
    "response": ("excitation", "peaks"),
    "modes": ("speed_rad_s", "modes"),
    "assess": ("findings",),
}
_REMEDY = "name the folder that `jaxrotor run` or another command wrote, or a file in it"


@dataclass(frozen=True)
class Result:
    """`kind`: which command wrote it; `folder`: where; `summary`: its numbers. `study`: read anew where that
    is possible, else `None`, and `told` says why. `run`: the file of samples, of a run."""

    kind: str
    folder: Path
    summary: Mapping[str, Any]
    study: Study | None = None
    told: tuple[str, ...] = ()
    run: Path | None = None
    made: Mapping[str, Any] = field(default_factory=dict)

    @property
    def lone(self) -> bool:
        """Whether it is a file by itself, in a folder of other things."""
        return self.run is not None and not (self.folder / SUMMARY).is_file()

    @property
    def page(self) -> Path:
        """Where its page stands, unless one says otherwise: beside it."""
        if self.lone and self.run is not None:
            return self.run.with_suffix(".html")
        whole = self.folder.resolve()
        return self.folder.parent / f"{self.folder.name or whole.name}.html"

    @property
    def title(self) -> str:
        own = self.summary.get("title") or (self.study.title if self.study else "")
        return str(own or Path(str(self.summary.get("study", self.folder.name))).stem)

    @property
    def text(self) -> str:
        """The study as it was written; empty where it is not known."""
        return str(self.made.get("study") or "")


def find_result(place: Path) -> Result:
    """The result in a folder, or that a file belongs to. Raises `InputError` where there is none, or where it
    is damaged."""
    if not place.exists():
        raise InputError(f"`{place}`: is not there: {_REMEDY}")
    lone = place.is_file() and place.suffix == ".nc" and not (place.parent / SUMMARY).is_file()
    if lone:  # `response.save` of a script
        return Result("run", place.parent, {"title": place.stem}, told=(_NO_STUDY,), run=place)
    inside = place.is_file() or place.name == SWEEP
    folder = place.parent if inside else place
    if inside and place.name not in (SUMMARY, RUN, SWEEP) and place.suffix not in (".png", ".csv"):
        raise InputError(f"`{place}`: is no result: {_REMEDY}")
    if not (folder / SUMMARY).is_file():
        if (folder / SWEEP).exists():
            raise InputError(
                f"`{folder}`: holds a sweep that was not finished: go on with it by "
                "jaxrotor sweep STUDY.toml --resume"
            )
        what = "is empty" if not any(folder.iterdir()) else f"holds no {SUMMARY}"
        raise InputError(f"`{folder}`: {what}: {_REMEDY}")
    summary = _read(folder / SUMMARY)
    kind = next((k for k, keys in _KINDS.items() if all(key in summary for key in keys)), None)
    if kind is None and "study" not in summary:
        raise InputError(f"`{folder / SUMMARY}`: was not written by jaxrotor: {_REMEDY}")
    run = folder / RUN if kind == "run" else None
    if run is not None and not run.is_file():
        raise InputError(f"`{folder}`: {RUN} is missing: run the study again")
    if kind == "sweep" and not (folder / SWEEP).is_dir():
        raise InputError(f"`{folder}`: {SWEEP} is missing: run the sweep again")
    made = summary.get("made")
    made = made if isinstance(made, dict) else {}
    study, told = _study(summary, made, folder)
    return Result(kind or "other", folder, summary, study, told, run, made)


_NO_STUDY = "The study is not known: neither its text nor a drawing of the machine is shown."


def _read(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        words = str(error).split(":")[0]
        raise InputError(f"`{path}`: is damaged ({words}): run the command again") from None
    if not isinstance(found, dict):
        raise InputError(f"`{path}`: was not written by jaxrotor: {_REMEDY}")
    return found


def _study(
    summary: Mapping[str, Any], made: Mapping[str, Any], folder: Path
) -> tuple[Study | None, tuple[str, ...]]:
    """The study of a result: its file, as long as that reads as it did then; else the text that was kept,
    written beside nothing, so that what it names beside itself is missing."""
    path, text = Path(str(summary.get("study", ""))), made.get("study")
    there = path.is_file()
    same = there and (not text or path.read_text(encoding="utf-8", errors="replace") == text)
    try:
        if same:
            changed = "" if text else f"Drawn from `{path}` as it is now: the result keeps no text."
            return load(path, run=False), (changed,) if changed else ()
        if text:
            return _from_text(str(text), path.name), ()
    except JaxrotorError as error:
        first = error.problems[0] if error.problems else str(error)
        return None, (f"The machine cannot be drawn: {first}",)
    return None, (_NO_STUDY,)


def _from_text(text: str, name: str) -> Study:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / (name or "study.toml")
        file.write_text(text, encoding="utf-8")
        return load(file, run=False)
