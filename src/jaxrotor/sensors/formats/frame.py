"""Tables from Parquet files."""

from collections import Counter
from pathlib import Path

import numpy as np
import pandas

from ...core.errors import InputError
from .table import Column, Table


def read_parquet(file: Path) -> Table:
    frame = pandas.read_parquet(file)
    names = [str(name) for name in frame.columns]
    for name, count in Counter(names).items():
        if count > 1:
            raise InputError(f"`{file}`: {count} columns are named `{name}`: rename all but one")

    def column(i: int) -> Column:
        return Column(lambda: np.asarray(frame.iloc[:, i]))

    return Table({name: column(i) for i, name in enumerate(names)})
