"""MATLAB's files before 7.3: variables by name, what a struct holds by its path (`run/acceleration`)."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from scipy.io.matlab import MatlabFunction, MatlabOpaque, mat_struct

from .table import Gathering, Table


def read_matlab(file: Path) -> Table:
    found = Gathering()
    held = scipy.io.loadmat(file, struct_as_record=False)
    for variable, thing in held.items():
        if variable.startswith("__"):  # the file's header
            continue
        for name, value in _unfolded(variable, thing):
            if words := _no_numbers(value):
                found.others[name] = words
            else:
                found.add(name, value.shape, lambda v=value: v)
    return found.table()


def _unfolded(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """A struct's fields, each; a struct comes as an array of one."""
    if isinstance(value, np.ndarray) and value.dtype == object and value.size == 1:
        inner = value.item()
        if isinstance(inner, mat_struct):
            for field in vars(inner)["_fieldnames"]:
                yield from _unfolded(f"{name}/{field}", getattr(inner, field))
            return
    yield name, value


def _no_numbers(value: Any) -> str:
    """What a variable is instead of numbers, or ""."""
    if isinstance(value, (MatlabFunction, MatlabOpaque)):
        return "an object, which only MATLAB reads: write its columns as arrays"
    if not isinstance(value, np.ndarray):
        return "a sparse matrix: write it as a full one"
    if value.size == 0:
        return "empty"
    if value.dtype == object:
        if isinstance(value.ravel()[0], mat_struct):
            return f"an array of {value.size} structs: write each as a variable"
        return "a cell array: write what is in it as a matrix"
    return "a text" if value.dtype.kind == "U" else ""
