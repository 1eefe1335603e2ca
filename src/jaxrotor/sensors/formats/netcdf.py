"""netCDF, and HDF5 files that are written like it: variables over dimensions."""

from pathlib import Path

import numpy as np
import xarray

from .table import Column, Table, signals


def read_netcdf(file: Path, classic: bool = False) -> Table:
    """`classic`: netCDF 3, which is no HDF5."""
    columns: dict[str, Column] = {}
    notes: list[str] = []
    others: dict[str, str] = {}
    with xarray.open_dataset(file, engine="scipy" if classic else "h5netcdf") as opened:
        data = opened.load()
    for key, variable in data.variables.items():
        name, unit = str(key), str(variable.attrs.get("units", ""))
        found, words = signals(name, variable.shape, lambda v=variable: np.asarray(v), unit)
        columns |= found
        if words and found:
            notes.append(words)
        elif words:
            others[name] = words
    return Table(columns, tuple(notes), others)
