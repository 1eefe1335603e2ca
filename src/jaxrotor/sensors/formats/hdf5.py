"""Data sets of HDF5 files by their paths, and MATLAB's files since 7.3, which are HDF5 inside."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from .table import Gathering, Table

_UNITS = ("units", "unit", "Units", "Unit", "unit_string", "UNITS")


def is_netcdf(file: Path) -> bool:
    """Whether its data sets have dimensions, as xarray and netCDF write them."""
    with h5py.File(file) as opened:
        sets = [thing for _, thing in _walked(opened) if isinstance(thing, h5py.Dataset)]
        return "_NCProperties" in opened.attrs or any(
            "DIMENSION_LIST" in thing.attrs or thing.is_scale for thing in sets
        )


def read_hdf5(file: Path) -> Table:
    """Names are paths: `group/signal`; of a table, `table/field`. Values are read when they are asked for."""
    found = Gathering()
    with h5py.File(file) as opened:
        for name, thing in _walked(opened):
            if words := _no_numbers(thing):
                found.others[name] = words
            elif isinstance(thing, h5py.Dataset):
                of_matlab = "MATLAB_class" in thing.attrs  # its columns come first
                for key, field in _fields(name, thing.dtype):
                    inner = () if field is None else thing.dtype[field].shape
                    shape = thing.shape[::-1] if of_matlab else (*thing.shape, *inner)
                    found.add(key, shape, _reader(file, name, field, of_matlab), _unit(thing))
    return found.table()


def _walked(group: h5py.Group) -> Iterator[tuple[str, Any]]:
    """Everything in a file, in its own order, without what MATLAB keeps for itself; a link that leads nowhere
    is passed over, and so is one to a group that was there already."""
    root: Any = group["/"]
    waiting, seen = [("", root)], set()
    while waiting:
        path, inside = waiting.pop()
        if inside in seen:
            continue
        seen.add(inside)
        deeper = []
        for name in inside:
            try:
                thing = inside[name]
            except (KeyError, OSError):
                continue
            if path == "" and name in ("#refs#", "#subsystem#"):
                continue
            yield f"{path}{name}", thing
            if isinstance(thing, h5py.Group):
                deeper.append((f"{path}{name}/", thing))
        waiting += reversed(deeper)


def _no_numbers(thing: Any) -> str:
    """What a thing is instead of numbers, or ""."""
    kind = _text(thing.attrs.get("MATLAB_class", b""))
    if not isinstance(thing, h5py.Dataset):  # a group, a named type
        return ""
    if "MATLAB_empty" in thing.attrs:
        return "empty"
    if kind == "cell":
        return "a cell array: write what is in it as a matrix"
    if kind == "char":
        return "a text"
    if "MATLAB_object_decode" in thing.attrs:
        return f"a {kind}, which only MATLAB reads: write its columns as arrays"
    if thing.dtype.kind == "O":
        if h5py.check_string_dtype(thing.dtype):
            return "a text"
        vlen = h5py.check_vlen_dtype(thing.dtype)
        return "rows of different lengths: write them as one matrix" if vlen else "references"
    if thing.dtype.kind in "SU":
        return "a text" if thing.size == 1 else "texts"
    if thing.shape is None:
        return "empty"
    return ""


def _fields(name: str, dtype: np.dtype) -> list[tuple[str, str | None]]:
    """(name, field): a table's columns, each; anything else has none, MATLAB's complex numbers neither."""
    if dtype.names is None or dtype.names == ("real", "imag"):
        return [(name, None)]
    return [(f"{name}/{field}", field) for field in dtype.names]


def _reader(file: Path, name: str, field: str | None, transposed: bool) -> Any:
    def read() -> np.ndarray:
        with h5py.File(file) as opened:
            thing: Any = opened[name]
            values = thing[()] if field is None else thing.fields(field)[()]
        if values.dtype.names:
            values = values["real"] + 1j * values["imag"]
        return values.T if transposed else values

    return read


def _unit(thing: Any) -> str:
    for key in _UNITS:
        if key in thing.attrs:
            return _text(thing.attrs[key])
    return ""


def _text(given: Any) -> str:
    one = np.ravel(given)[0] if np.size(given) else b""
    return one.decode("utf-8", "replace") if isinstance(one, bytes) else str(one)
