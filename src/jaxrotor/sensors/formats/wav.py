"""WAV files: the channels are "1", "2" ..., whole numbers are scaled to a full scale of 1."""

import warnings
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from ...core.errors import InputError
from .table import Column, Table, even


def read_wav(file: Path) -> Table:
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        rate, values = wavfile.read(file)
    if not values.size or any("prematurely" in str(one.message) for one in said):
        raise InputError(
            f"`{file}`: is cut off: it ends before its header says: copy it again, or repair it with an "
            "audio program"
        )
    values = values.reshape(len(values), -1)
    notes, unit = (), ""
    if values.dtype.kind in "iu":
        info = np.iinfo(values.dtype)
        half = 2.0 ** (info.bits - 1)
        middle = half if values.dtype.kind == "u" else 0.0
        notes = ("whole numbers are scaled: the full scale is 1",)
        values, unit = (values - middle) / half, "1"

    def column(k: int) -> Column:
        return Column(lambda: values[:, k], unit, even(0.0, 1.0 / rate, len(values)))

    names = {str(k + 1): column(k) for k in range(values.shape[1])}
    return Table(names, notes)
