"""The store of a sweep: Zarr, written chunk by chunk, readable while it grows, resumed where it stopped."""

import errno
import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..errors import InputError

MARK = "jaxrotor_sweep"


def _zarr():
    try:
        import zarr
    except ImportError:
        raise InputError(
            'store: needs zarr, which is not installed: pip install "jaxrotor[sweep]", or leave `store` out'
        ) from None
    return zarr


class Store:
    """`path`: a folder. Rows stand in the order in which they are run; every chunk of rows is a chunk of each
    array, and `done` says of each whether it is whole: it is marked behind its data, so that a chunk that was being
    written when the program died is written again."""

    def __init__(self, path: Path):
        self.path = path
        self.group: Any = None

    def exists(self) -> bool:
        return (
            self.path.exists() and any(self.path.iterdir())
            if self.path.is_dir()
            else self.path.exists()
        )

    def open(self, fingerprint: dict[str, Any]) -> None:
        """An earlier one; refused where it is of something else."""
        told = self._attributes()
        if told.get(MARK) != json.dumps(fingerprint, sort_keys=True):
            before = json.loads(told[MARK])
            parts = [k for k in fingerprint if before.get(k) != fingerprint[k]]
            raise InputError(
                f"`{self.path}`: holds another sweep (its {', '.join(parts) or 'layout'} differ): choose another "
                "folder, or remove it"
            )
        self.group = self._guarded(lambda: _zarr().open_group(self.path, mode="r+"))

    def _attributes(self) -> dict[str, Any]:
        try:
            group = _zarr().open_group(self.path, mode="r")
            found = dict(group.attrs)
        except (OSError, ValueError, KeyError) as error:
            raise InputError(
                f"`{self.path}`: is no store of a sweep ({type(error).__name__}): choose another folder"
            ) from None
        if MARK not in found:
            raise InputError(f"`{self.path}`: is no store of a sweep: choose another folder")
        return found

    def create(self, layout: xr.Dataset, chunk: int, fingerprint: dict[str, Any]) -> None:
        """From a dataset of the right shapes, whose values do not matter (NaN until they are computed)."""
        zarr = _zarr()

        def make():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            encoding = {
                name: {"chunks": (chunk, *array.shape[1:])}
                for name, array in layout.data_vars.items()
                if array.dims and array.dims[0] == "case"
            }
            encoding["done"] = {"chunks": (1,)}
            layout.attrs[MARK] = json.dumps(fingerprint, sort_keys=True)
            layout.to_zarr(
                self.path, mode="w-", encoding=encoding, consolidated=False, zarr_format=3
            )
            return zarr.open_group(self.path, mode="r+")

        self.group = self._guarded(make)

    def missing(self) -> np.ndarray:
        return np.flatnonzero(np.asarray(self.group["done"]) == 0)

    def write(self, number: int, rows: slice, values: dict[str, np.ndarray]) -> None:
        def put():
            for name, value in values.items():
                self.group[name][rows] = value
            self.group["done"][number] = 1

        self._guarded(put)

    def dataset(self) -> xr.Dataset:
        """Everything that is there, read when it is looked at."""
        return xr.open_zarr(self.path, consolidated=False, chunks=None)

    def _guarded(self, act):
        try:
            return act()
        except OSError as error:
            words = {
                errno.ENOSPC: "the disk is full: make room, then resume",
                errno.EDQUOT: "the quota is used up: make room, then resume",
                errno.EACCES: "it may not be written to: choose another folder, or change its permissions",
                errno.EROFS: "it lies on a read-only disk: choose another folder",
            }.get(error.errno or 0)
            if words is None:
                raise
            raise InputError(f"`{self.path}`: {words}; what was written before is whole") from None


class Kept:
    """The same in memory."""

    def __init__(self, layout: xr.Dataset):
        self.layout = layout

    def missing(self) -> np.ndarray:
        return np.arange(self.layout.sizes["chunk"])

    def write(self, number: int, rows: slice, values: dict[str, np.ndarray]) -> None:
        for name, value in values.items():
            self.layout[name].values[rows] = value

    def dataset(self) -> xr.Dataset:
        return self.layout
