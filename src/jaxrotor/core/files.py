"""Results are written whole or not at all: beside their place first, then moved there."""

import glob
import json
import os
import shutil
import socket
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
    folder = _beside(target)
    try:
        part = folder / target.name
        yield part
        os.replace(part, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _beside(target: Path) -> Path:
    """A new hidden folder beside `target`, named after this process; those of processes that died are
    removed."""
    ours = f".{target.name}.{socket.gethostname()}-"
    for left in target.parent.glob(f"{glob.escape(ours)}*-*"):
        process = left.name[len(ours) :].partition("-")[0]
        if process.isdigit() and not _alive(int(process)):
            shutil.rmtree(left, ignore_errors=True)
    return Path(tempfile.mkdtemp(prefix=f"{ours}{os.getpid()}-", dir=target.parent))


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # somebody else's
        return True
    return True


def save_json(path: Path, summary: dict[str, Any]) -> None:
    with written_whole(path) as file:
        file.write_text(json.dumps(summary, indent=2) + "\n")


@contextmanager
def folder_written_whole(target: Path, force: bool = False) -> Iterator[Path]:
    """A new folder to write to; its files are in `target` when the block ends well.

    An earlier run's files of the same names are replaced; what else lies there stays. At every instant the
    earlier results or the new ones are whole in `target`, or both in folders beside it, where the next
    writer finds them. Raises `InputError`, before the block, for a folder that no run wrote (unless `force`
    is set) and for one that cannot be written to. Where it can no longer be written to at the end, the new
    results stay in the folder beside it, and the error says so.
    """
    check_folder(target, force)
    target = target.resolve()
    target.parent.mkdir(parents=True, exist_ok=True)
    _put_back(target)
    _try_to_write(target)
    part = _beside(target)
    part.chmod(0o777 & ~_umask())  # mkdtemp makes it the user's alone
    try:
        yield part
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
    try:
        _exchange(part, target)
    except OSError as error:
        raise InputError(
            f"`{target}`: could not be written ({error.strerror or error}); the results are whole in "
            f"`{part}`"
        ) from error


def _earlier(target: Path) -> Path:
    """Where the earlier folder stands while the new one takes its place."""
    return target.with_name(f".{target.name}.earlier")


def _exchange(part: Path, target: Path) -> None:
    earlier = _earlier(target)
    if target.exists():
        try:
            os.replace(target, earlier)
        except OSError:  # a mounted folder, say, which cannot be renamed
            return _moved_in(part, target)
    os.replace(part, target)
    _put_back(target)


def _moved_in(part: Path, target: Path) -> None:
    """One file after the other; the earlier summary goes first, and the new one comes last: a folder without
    it was left half-way."""
    (target / MARKERS[-1]).unlink(missing_ok=True)
    for file in sorted(part.iterdir(), key=lambda f: (f.name == MARKERS[-1], f.name)):
        os.replace(file, target / file.name)
    part.rmdir()


def _put_back(target: Path) -> None:
    """Ends an exchange, perhaps one that was killed half-way: what the new folder does not hold goes back."""
    earlier = _earlier(target)
    if not earlier.is_dir():
        return
    if not target.exists():
        os.replace(earlier, target)
        return
    for file in earlier.iterdir():
        if not (target / file.name).exists():
            os.replace(file, target / file.name)
    shutil.rmtree(earlier)


def _try_to_write(target: Path) -> None:
    """Permissions alone do not tell: the disk may be read-only."""
    for folder in (target.parent, target):
        try:
            if folder.is_dir():
                os.rmdir(_beside(folder / "try"))
        except OSError as error:
            raise InputError(
                f"`{folder}`: cannot be written to ({error.strerror}): choose another folder with --out, or "
                "change its permissions"
            ) from None


def check_folder(target: Path, force: bool) -> None:
    """Refuses a place that is a file, or a folder of other things (hidden ones do not count)."""
    if target.exists() and not target.is_dir():
        raise InputError(f"`{target}`: is a file: choose another folder with --out")
    if target.is_dir() and not force:
        names = [p.name for p in target.iterdir() if not p.name.startswith(".")]
        if names and not set(names) & set(MARKERS):
            raise InputError(
                f"`{target}`: holds files that no run wrote (`{sorted(names)[0]}`): choose another "
                "folder with --out, or add --force to write among them"
            )


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
