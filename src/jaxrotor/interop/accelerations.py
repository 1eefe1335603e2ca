"""Records of the ground's acceleration from files, as seismic data bases and test rigs write them."""

import os
import re
from pathlib import Path

import numpy as np

from ..core.arguments import path as a_path
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import as_float64
from ..core.units import factor
from ..profiles.ground import AccelerationRecord
from ..sensors.formats.spelling import told_unit, unit_in
from ..sensors.formats.text import HowWritten, as_numbers, read_text_table

_GRAVITY = 9.80665  # m/s², the standard one
_POINTS = re.compile(r"NPTS\s*=?\s*(\d+)", re.IGNORECASE)
_STEP = re.compile(r"DT\s*=?\s*(\d*\.\d+|\d+)", re.IGNORECASE)


@takes(path=a_path)
def read_accelerations(
    path: str | os.PathLike[str], column: str | None = None, unit: str | None = None
) -> AccelerationRecord:
    """A record of acceleration from a table (.csv, .txt, .tsv: any separator, decimal sign, encoding), or
    from a PEER file (.at2: `NPTS= 4000, DT= .0050 SEC` in its fourth line, then numbers in g).

    A table has a column `time` and one or more of accelerations: `column` names which, where there are
    several. The unit of each stands behind its name in brackets, `north [cm/s^2]`, or in a line of units
    below the names; a time without one is in s. `g` and `gal` are the standard gravity and 1 cm/s². `unit`:
    of accelerations that name none. One in rad/s² is about an axis.

    Raises `InputError` for a file that is none, that has no such column or unit, or a number missing.
    """
    file = Path(path)
    if not file.is_file():
        raise InputError(f"`{file}`: there is no such file")
    if file.suffix.lower() == ".at2":
        times, values = _peer(file, unit or "g")
    else:
        times, values = _table(file, column, unit)
    if len(times) < 2 or not np.all(np.diff(times) > 0):
        raise InputError(f"`{file}`: needs two rows at least, whose times increase")
    return AccelerationRecord(as_float64(times), as_float64(values))


def _peer(file: Path, unit: str) -> tuple[np.ndarray, np.ndarray]:
    lines = file.read_text(encoding="latin-1").splitlines()
    head = " ".join(lines[:4])
    points, step = _POINTS.search(head), _STEP.search(head)
    if points is None or step is None:
        raise InputError(
            f"`{file}`: its fourth line must tell `NPTS= ..., DT= ... SEC`, as PEER's files do, but is "
            f"`{lines[3].strip() if len(lines) > 3 else ''}`"
        )
    try:
        values = np.array(" ".join(lines[4:]).split(), float)
    except ValueError as error:
        raise InputError(f"`{file}`: holds what is no number below its head: {error}") from None
    if len(values) != int(points[1]):
        raise InputError(f"`{file}`: tells {points[1]} points, but holds {len(values)}")
    return np.arange(len(values)) * float(step[1]), values * _scale(file, "values", unit)


def _table(file: Path, column: str | None, unit: str | None) -> tuple[np.ndarray, np.ndarray]:
    wanted: frozenset[str] = frozenset({"time", *([column] if column else [])})
    table = read_text_table(file, HowWritten(), wanted, recorded=False)
    found = {_name(title): (title, each) for title, each in table.columns.items()}
    time = next((name for name in found if name.lower() in ("time", "t")), None)
    if time is None:
        raise InputError(f"`{file}`: has no column `time`: its columns are {', '.join(found)}")
    others = [name for name in found if name != time]
    if column is None and len(others) != 1:
        raise InputError(
            f"`{file}`: say which column is meant: column={others[0]!r} or another of {', '.join(others)}"
        )
    name = others[0] if column is None else column
    if name not in others:
        raise InputError(f"`{file}`: has no column `{name}`: known are {', '.join(others)}")
    out = []
    for each in (time, name):
        title, told = found[each]
        values = as_numbers(told.read())
        if isinstance(values, int):
            raise InputError(
                f"`{file}`: column `{title}`, line {told.lines[values]}: is not a number"
            )
        own = unit_in(title) or told.unit.strip("[]() ")
        if each == time:
            spelled = told_unit(own)[0]
            scale = factor(spelled, "s") if spelled else None if own else 1.0
            if scale is None:
                raise InputError(f"`{file}`: column `{title}` must be in s or alike")
        else:
            scale = _scale(file, title, own or unit)
        out.append(values * scale)
    return out[0], out[1]


def _name(title: str) -> str:
    return re.sub(r"\s*[\[(][^\])]*[\])]\s*$", "", title).strip()


def _scale(file: Path, title: str, unit: str | None) -> float:
    if not unit:
        raise InputError(
            f"`{file}`: column `{title}` has no unit: write `{title} [m/s^2]`, or give unit=..."
        )
    if unit.strip() in ("g", "G", "g0"):
        return _GRAVITY
    if unit.strip().lower() in ("gal", "gals"):
        return 0.01
    spelled = told_unit(unit)[0]
    for wanted in ("m/s^2", "rad/s^2"):
        scale = factor(spelled, wanted) if spelled else None
        if scale is not None:
            return scale
    raise InputError(f"`{file}`: column `{title}` must be in m/s^2, g or alike, but is in {unit}")
