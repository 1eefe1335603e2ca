"""Bearing and seal coefficients from tables, as other programs and test rigs write them."""

import os
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core.arguments import path as a_path
from ..core.errors import InputError, MissingExtraError
from ..core.gate import takes
from ..core.kinematics import COORDINATES
from ..core.parameter import as_float64
from ..core.units import factor, known_unit
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..elements.bearings.whirl_dependent import WhirlDependentSupport
from ..sensors.formats.spelling import told_unit, unit_in
from ..sensors.formats.text import HowWritten, as_numbers, read_text_table

_AXES = "x|y|z|psi|theta"
_NAME = re.compile(rf"([kcm])_?({_AXES})_?({_AXES})")
_KINDS = {"k": "stiffness", "c": "damping", "m": "mass"}
_SPEED, _WHIRL = ("speed", "rpm"), ("frequency", "whirl")
# By how many tilts a coefficient is about: force over length, over angle, moment over angle.
_UNITS = {
    "k": ("N/m", "N/rad", "N*m/rad"),
    "c": ("N*s/m", "N*s/rad", "N*m*s/rad"),
    "m": ("kg", "kg*m/rad", "kg*m^2/rad"),
}


class _Column(NamedTuple):
    title: str
    name: str
    unit: str
    values: np.ndarray


@takes(path=a_path)
def read_coefficients(
    path: str | os.PathLike[str], units: dict[str, str] | None = None
) -> LinearSupport | SpeedDependentSupport | WhirlDependentSupport:
    """A support from a table of coefficients: .csv, .txt, .tsv (any separator, decimal sign, encoding), or
    the first sheet of an .xlsx.

    Columns, in any order and case: `speed`, `frequency` (of the whirl), and coefficients `kxx, kxy, kyx, kyy,
    kzz, cxx, ..., mxx, ...`, for tilts `kpsipsi, kxtheta, ...`; what is left out is zero. The unit of each
    stands behind its name in brackets, `kxx [N/mm]`, in a line of units below the names, or in `units`:
    `{"k": "lbf/in", "c": "lbf*s/in", "speed": "rpm"}`, of a letter for all its coefficients. A frequency of
    1 Hz is 2 pi rad/s.

    One row alone is a `LinearSupport`; rows over the speed, in any order, a `SpeedDependentSupport`; over
    speed and frequency, each with each, a `WhirlDependentSupport`. One over the frequency alone is taken for
    one over the speed (synchronous whirl), as in other programs. Other columns are refused, so that nothing
    is left out unseen.

    Raises `InputError` for a file that is none, and with its row or column for what is missing, stands
    twice, has no unit or another's; `MissingExtraError` for an .xlsx without openpyxl.
    """
    file = Path(path)
    if not file.is_file():
        raise InputError(f"`{file}`: there is no such file")
    columns = _columns(file, dict(units or {}))
    if not columns[0].values.size:
        raise InputError(f"`{file}`: holds no row of numbers below the names of its columns")
    over = {c.name: c for c in columns if c.name in ("speed", "frequency")}
    tables = {c.name: c.values for c in columns if c.name not in over}
    if not any(name[0] == "k" for name in tables):
        raise InputError(f"`{file}`: no column of stiffness: name one kxx [N/m]")
    if len(over) == 2:
        return _over_both(file, over, tables)
    if not over:
        if len(columns[0].values) != 1:
            raise InputError(
                f"`{file}`: {len(columns[0].values)} rows, but no column of speed: add speed [rpm]"
            )
        return _constant(tables)
    (axis,) = over.values()
    order = np.argsort(axis.values, kind="stable")
    rows = axis.values[order]
    _refuse_twice(file, rows, axis)
    if len(rows) == 1:
        return _constant(tables)
    found = _matrices({name: values[order] for name, values in tables.items()})
    return SpeedDependentSupport(as_float64(rows), **found)


def _constant(tables: dict[str, np.ndarray]) -> LinearSupport:
    return LinearSupport(**{n: x if x is None else x[0] for n, x in _matrices(tables).items()})


def _over_both(file: Path, over: dict, tables: dict[str, np.ndarray]) -> WhirlDependentSupport:
    speeds, frequencies = (np.unique(over[name].values) for name in ("speed", "frequency"))
    places = (
        np.searchsorted(speeds, over["speed"].values),
        np.searchsorted(frequencies, over["frequency"].values),
    )
    flat = places[0] * frequencies.size + places[1]
    counts = np.bincount(flat, minlength=speeds.size * frequencies.size)
    if np.any(counts != 1):
        k, m = divmod(int(np.argmax(counts != 1)), frequencies.size)
        what = "no row" if counts[k * frequencies.size + m] == 0 else "several rows"
        raise InputError(
            f"`{file}`: {what} for {speeds[k]:g} rad/s and a whirl of {frequencies[m]:g} rad/s: each speed "
            "needs each frequency once"
        )
    order = np.argsort(flat)
    shape = speeds.size, frequencies.size
    found = _matrices({name: values[order] for name, values in tables.items()})
    found = {n: x if x is None else x.reshape(*shape, 6, 6) for n, x in found.items()}
    return WhirlDependentSupport(as_float64(speeds), as_float64(frequencies), **found)


def _refuse_twice(file: Path, rows: np.ndarray, axis: _Column) -> None:
    again = np.flatnonzero(np.diff(rows) <= 0)
    if again.size:
        raise InputError(
            f"`{file}`: column `{axis.title}` has {rows[again[0]]:g} rad/s in several rows: keep one, or add "
            "a column `frequency`"
        )


def _matrices(tables: dict[str, np.ndarray]) -> dict[str, Any]:
    """stiffness, damping and mass (rows, 6, 6)."""
    rows = len(next(iter(tables.values())))
    out: dict[str, Any] = {}
    for letter, kind in _KINDS.items():
        named = {name: values for name, values in tables.items() if name[0] == letter}
        if letter == "m" and not named:
            out[kind] = None
            continue
        full = np.zeros((rows, 6, 6))
        for name, values in named.items():
            _, to, by = name.split("_")
            full[:, COORDINATES.index(to), COORDINATES.index(by)] = values
        out[kind] = as_float64(full)
    return out


def _columns(file: Path, units: dict[str, str]) -> list[_Column]:
    found: list[_Column] = []
    for title, told, values in _raw(file):
        unit = unit_in(title)
        bare = (title[: title.rindex(unit) - 1] if unit else title).strip().lower()
        name = _name(file, bare, title)
        unit = units.get(bare) or units.get(name[0] if "_" in name else name) or unit or told
        if any(c.name == name for c in found):
            raise InputError(f"`{file}`: column `{title}` stands twice: remove one")
        if not np.all(np.isfinite(values)):
            row = int(np.argmin(np.isfinite(values)))
            raise InputError(f"`{file}`: column `{title}`, row {row + 1}: is not a finite number")
        wanted = _wanted(name)
        scale = _scale(file, title, unit, wanted, name == "frequency")
        found.append(_Column(title, name, wanted, values * scale))
    for c in found:
        if c.name in ("speed", "frequency") and np.any(c.values < 0):
            raise InputError(f"`{file}`: column `{c.title}` must not be negative")
    return found


def _name(file: Path, bare: str, title: str) -> str:
    """`k_x_y`, `speed`, `frequency`."""
    if bare in _SPEED:
        return "speed"
    if bare in _WHIRL:
        return "frequency"
    match = _NAME.fullmatch(bare.replace(" ", ""))
    if match is None:
        raise InputError(
            f"`{file}`: column `{title}` is not known: name columns speed, frequency, kxx, kxy, cxx, mxx "
            "..., and remove the others"
        )
    return "_".join(match.groups())


def _wanted(name: str) -> str:
    if "_" not in name:
        return "rad/s"
    letter, *axes = name.split("_")
    return _UNITS[letter][sum(len(axis) > 1 for axis in axes)]


def _scale(file: Path, title: str, given: str, wanted: str, is_frequency: bool) -> float:
    unit = told_unit(given)[0] or given
    if not unit:
        raise InputError(
            f"`{file}`: column `{title}` has no unit: write `{title} [{wanted}]`, or give units={{...}}"
        )
    if is_frequency and known_unit(unit) and (scale := factor(unit, "Hz")) is not None:
        return 2 * np.pi * scale
    scale = factor(unit, wanted) if known_unit(unit) else None
    if scale is None:
        # N*m/rad and the like, whose angle may be left out
        raise InputError(
            f"`{file}`: column `{title}` must be in {wanted} or alike, but is in {unit}"
        )
    return scale


def _raw(file: Path) -> list[tuple[str, str, np.ndarray]]:
    """Title, unit told below it, and values of each column."""
    if file.suffix.lower() in (".xlsx", ".xlsm"):
        return _sheet(file)
    table = read_text_table(
        file, HowWritten(), frozenset(("speed", "frequency", "kxx")), recorded=False
    )
    out = []
    for title, column in table.columns.items():
        values = as_numbers(column.read())
        if isinstance(values, int):
            line = column.lines[values]
            raise InputError(f"`{file}`: column `{title}`, line {line}: is not a number")
        out.append((title, column.unit, values))
    return out


def _sheet(file: Path) -> list[tuple[str, str, np.ndarray]]:
    import pandas

    try:
        frame = pandas.read_excel(file, header=None)
    except ImportError as error:
        raise MissingExtraError(
            f"`{file}`: cannot be read ({error}): pip install 'jaxrotor[excel]'"
        ) from None
    except Exception as error:  # of whatever kind openpyxl and zip files raise
        raise InputError(f"`{file}`: cannot be read as an Excel sheet: {error}") from None
    frame = frame.dropna(how="all").dropna(axis=1, how="all")
    if len(frame) < 2:
        raise InputError(f"`{file}`: holds no names of columns with numbers below them")
    titles = [str(x).strip() for x in frame.iloc[0]]
    below = [str(x).strip() for x in frame.iloc[1]]
    has_units = all(known_unit(x.strip("[]()")) or told_unit(x)[0] for x in below)
    told = [x.strip("[]()") for x in below] if has_units else [""] * len(titles)
    out = []
    for k, title in enumerate(titles):
        try:
            values = frame.iloc[1 + has_units :, k].to_numpy(float)
        except (TypeError, ValueError):
            raise InputError(f"`{file}`: column `{title}` must hold numbers alone") from None
        out.append((title, told[k], values))
    return out
