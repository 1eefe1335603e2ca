"""netCDF, and HDF5 files that are written like it: variables over dimensions."""

from pathlib import Path

import numpy as np
import xarray

from .table import Gathering, Table


def read_netcdf(file: Path, classic: bool = False) -> Table:
    """`classic`: netCDF 3, which is no HDF5."""
    found = Gathering()
    with xarray.open_dataset(file, engine="scipy" if classic else "h5netcdf") as opened:
        data = opened.load()
    for name, variable in data.variables.items():
        unit = str(variable.attrs.get("units", ""))
        found.add(str(name), variable.shape, lambda v=variable: np.asarray(v), unit)
    return found.table()
