"""The store of a sweep: Zarr, written chunk by chunk, readable while it grows, resumed where it stopped."""

import errno
import json
import shutil
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..core.errors import InputError, JaxrotorError, MissingExtraError, StoreError
from .planning import Steps

# Attributes: what the sweep is of, which arrays are its results, the checksum of all others.
MARK, RESULTS, ASKED = "jaxrotor_sweep", "jaxrotor_results", "jaxrotor_asked"

_WORDS = {
    errno.ENOSPC: "the disk is full: make room, then resume",
    errno.EDQUOT: "the quota is used up: make room, then resume",
    errno.EACCES: "it may not be written to: choose another folder, or change its permissions",
    errno.EPERM: "it may not be written to: choose another folder, or change its permissions",
    errno.EROFS: "it lies on a read-only disk: choose another folder",
}


def _zarr():
    try:
        import zarr
    except ImportError:
        raise MissingExtraError(
            'store: needs zarr, which is not installed: pip install "jaxrotor[sweep]", or leave `store` out'
        ) from None
    return zarr


class Store:
    """`path`: a folder. Rows stand in the order in which they are run; every chunk of rows is a chunk of each
    array, and `done` says of each whether it is whole: it is marked behind its data, so that a chunk that was
    being written when the program died is written again. `checksum` has a number for each chunk's values,
    and the attributes one for what was asked: a chunk that was damaged later is run again, and a store whose
    questions were is refused."""

    def __init__(self, path: Path):
        _zarr()
        self.path = path
        self.group: Any = None

    def exists(self) -> bool:
        def look():
            return any(self.path.iterdir()) if self.path.is_dir() else self.path.exists()

        return self._guarded(look)

    def open(self, fingerprint: dict[str, Any]) -> int:
        """An earlier one; refused where it is of something else. How many chunks were damaged: they are no
        longer marked as whole."""
        before = self._identity()
        if before != fingerprint:
            parts = [k for k in fingerprint if before.get(k) != fingerprint[k]]
            raise InputError(
                f"`{self.path}`: holds another sweep, of different {', '.join(parts) or 'layout'}: choose "
                "another folder, or remove it"
            )
        self.group = self._guarded(lambda: _zarr().open_group(self.path, mode="r+"))
        return self._sound(self._damaged)

    def _damaged(self) -> int:
        """Those of the chunks that are marked as whole and are not."""
        if dict(self.group.attrs).get(ASKED) != _checksum(self._asked()):
            raise ValueError("what was asked does not have its checksum")
        count = self.group["done"].shape[0]
        size = self.group["case"].shape[0] // count
        bad = [number for number in range(count) if not self._as_written(number, size)]
        for number in bad:
            self.group["done"][number] = 0
        return len(bad)

    def _as_written(self, number: int, size: int) -> bool:
        rows = slice(number * size, (number + 1) * size)
        try:
            if not int(self.group["done"][number]):
                return True  # nothing is claimed of it
            values = {name: np.asarray(self.group[name][rows]) for name in self._results()}
            return _checksum(values) == int(self.group["checksum"][number])
        except Exception:  # each codec has its own
            return False

    def _results(self) -> list[str]:
        return json.loads(str(dict(self.group.attrs)[RESULTS]))

    def _asked(self) -> dict[str, np.ndarray]:
        """All arrays but those that are written later."""
        later = {*self._results(), "done", "checksum"}
        return {name: np.asarray(array) for name, array in self.group.arrays() if name not in later}

    def _sound(self, act):
        """`act()`, with whatever a damaged file leads to said in words."""
        try:
            return act()
        except JaxrotorError:
            raise
        except Exception as error:
            raise _damage(self.path, error) from error

    def _identity(self) -> dict[str, str]:
        remedy = "choose another folder"
        try:
            found = dict(_zarr().open_group(self.path, mode="r").attrs)
            return dict(json.loads(str(found[MARK])))
        except PermissionError:
            raise StoreError(f"`{self.path}`: may not be read: {remedy}") from None
        except (OSError, ValueError, KeyError, TypeError):
            raise StoreError(f"`{self.path}`: is no store of a sweep: {remedy}") from None

    def steps(self) -> tuple[Steps, int]:
        """As they were planned when the store was made, and the size of its chunks."""
        return self._sound(self._steps)

    def _steps(self) -> tuple[Steps, int]:
        case, steps = (np.asarray(self.group[name]) for name in ("case", "steps_a_sample"))
        substeps = np.zeros(int(case.max()) + 1, int)
        substeps[case[case >= 0]] = steps[case >= 0]
        attrs = dict(self.group.attrs)
        size = case.size // self.group["done"].size
        return Steps(substeps, attrs["linearised_at"], attrs["no_step"]), size

    def create(
        self, layout: xr.Dataset, results: dict[str, xr.Variable], fingerprint: dict[str, Any]
    ) -> None:
        """Made under another name: what has this one is whole."""
        chunk = layout.sizes["case"] // layout.sizes["chunk"]
        beside = self.path.with_name(f".{self.path.name}.being_made")

        def make():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if beside.exists():  # its maker died
                shutil.rmtree(beside)
            encoding = {"done": {"chunks": (1,)}, "checksum": {"chunks": (1,)}}
            layout.attrs[MARK] = json.dumps(fingerprint, sort_keys=True)
            layout.attrs[RESULTS] = json.dumps(sorted(results))
            layout["checksum"] = ("chunk", np.zeros(layout.sizes["chunk"], np.int64))
            layout.to_zarr(beside, mode="w-", encoding=encoding, consolidated=False, zarr_format=3)
            group = _zarr().open_group(beside, mode="r+")
            for name, array in results.items():
                group.create_array(
                    name,
                    shape=array.shape,
                    dtype=array.dtype,
                    chunks=(chunk, *array.shape[1:]),
                    fill_value=np.nan,
                    dimension_names=[str(d) for d in array.dims],
                    attributes=array.attrs,
                )
            self.group = group
            group.attrs[ASKED] = _checksum(self._asked())
            self.group = None
            if self.path.is_dir():
                self.path.rmdir()  # empty, or it would be opened
            beside.rename(self.path)
            return _zarr().open_group(self.path, mode="r+")

        try:
            self.group = self._guarded(make)
        except BaseException:
            shutil.rmtree(beside, ignore_errors=True)
            raise

    def missing(self) -> np.ndarray:
        return np.flatnonzero(np.asarray(self.group["done"]) == 0)

    def write(self, number: int, rows: slice, values: dict[str, np.ndarray]) -> None:
        def put():
            written = {}
            for name in self._results():
                array = self.group[name]
                if name in values:
                    array[rows] = values[name]
                    written[name] = np.asarray(values[name], array.dtype)
                else:
                    written[name] = np.asarray(array[rows])
            self.group["checksum"][number] = _checksum(written)
            self.group["done"][number] = 1

        self._guarded(put)

    def dataset(self) -> xr.Dataset:
        """Everything that is there, read when it is looked at."""
        return self._sound(lambda: xr.open_zarr(self.path, consolidated=False, chunks=None))

    def _guarded(self, act):
        try:
            return act()
        except OSError as error:
            words = _WORDS.get(error.errno or 0)
            if words is None:
                words = f"{error.strerror or error}: choose another folder"
            begun = "; what was written before is whole" if self.group is not None else ""
            raise StoreError(f"`{self.path}`: {words}{begun}") from error


def _checksum(arrays: dict[str, np.ndarray]) -> int:
    """Of values and names, in any order."""
    total = 0
    for name in sorted(arrays):
        total = zlib.crc32(name.encode(), total)
        total = zlib.crc32(np.ascontiguousarray(arrays[name]).tobytes(), total)
    return total


def _damage(path: Path, error: Exception) -> StoreError:
    first = (str(error).strip().splitlines() or [type(error).__name__])[0]
    return StoreError(
        f"`{path}`: is a damaged store of a sweep ({first[:120]}): restore it from a copy, or remove it and "
        "begin anew"
    )


def state_of(path: Path) -> tuple[int, int] | None:
    """How many chunks of a store are done, and of how many; `None` where no sweep was begun. Raises
    `StoreError` where it is damaged."""
    if not (path / "zarr.json").is_file():
        return None
    try:
        group: Any = _zarr().open_group(path, mode="r")
        if MARK not in group.attrs or "done" not in group:
            return None
        done = np.asarray(group["done"][:])
    except JaxrotorError:
        raise
    except Exception as error:
        raise _damage(path, error) from error
    return int((done != 0).sum()), done.size


class Kept:
    """The same in memory."""

    def __init__(self, layout: xr.Dataset, results: dict[str, xr.Variable]):
        self.layout = layout.assign(
            {name: array.copy(deep=True) for name, array in results.items()}
        )

    def missing(self) -> np.ndarray:
        return np.flatnonzero(self.layout["done"].values == 0)

    def write(self, number: int, rows: slice, values: dict[str, np.ndarray]) -> None:
        for name, value in values.items():
            self.layout[name].values[rows] = value
        self.layout["done"].values[number] = 1

    def dataset(self) -> xr.Dataset:
        return self.layout
