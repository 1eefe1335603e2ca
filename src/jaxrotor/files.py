"""Results are written whole or not at all: beside their place first, then moved there."""

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .errors import InputError

# What tells a folder of ours from one that holds something else; the summary is moved in last.
MARKERS = ("response.nc", "sweep.zarr", "summary.json")


@contextmanager
def written_whole(target: Path) -> Iterator[Path]:
    """A path to write to; it becomes `target` when the block ends well, and vanishes otherwise."""
    if target.is_dir():
        raise InputError(f"`{target}`: is a folder: name a file in it")
    target.parent.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
    try:
        part = folder / target.name
        yield part
        os.replace(part, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def save_json(path: Path, summary: dict[str, Any]) -> None:
    with written_whole(path) as file:
        file.write_text(json.dumps(summary, indent=2) + "\n")


@contextmanager
def folder_written_whole(target: Path, force: bool = False) -> Iterator[Path]:
    """A new folder to write to; its files are in `target` when the block ends well.

    An earlier run's files of the same names are replaced, one whole file after the other; what else
    lies there stays. A folder that no run wrote is refused unless `force` is set.
    """
    check_folder(target, force)
    parent = target.resolve().parent
    parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=parent))
    part.chmod(0o777 & ~_umask())  # mkdtemp makes it the user's alone
    try:
        yield part
        if not target.exists():
            os.replace(part, target)
        else:
            for file in sorted(part.iterdir(), key=lambda f: (f.name == MARKERS[-1], f.name)):
                os.replace(file, target / file.name)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def check_folder(target: Path, force: bool) -> None:
    """Refuses a place that is a file, or a folder of other things."""
    if target.exists() and not target.is_dir():
        raise InputError(f"`{target}`: is a file: choose another folder with --out")
    if target.is_dir() and not force:
        names = [p.name for p in target.iterdir()]
        if names and not set(names) & set(MARKERS):
            raise InputError(
                f"`{target}`: holds files that no run wrote (`{sorted(names)[0]}`): choose another "
                "folder with --out, or add --force to write among them"
            )


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
