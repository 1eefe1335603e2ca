"""[machine.profile]: a shaft as its drawing tells it, between the stations of [[machine.line]]."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.units import factor, read, shown
from ..elements.shafts.finite import FiniteElementShaft
from ..elements.shafts.profile import read_profile
from ..elements.shafts.profile_line import line_from_profile
from .build import FAILED, Context, build
from .mistakes import Faults

PLACE = "profile"
# What a profile tells; all other fields of a FiniteElementShaft are options beside it.
DIMENSIONS = ("length", "diameter", "inner_diameter", "end_diameter", "end_inner_diameter")
OWN = ("name", "file", "rows", "unit", "between", "longest")
OPTIONS = tuple(f.name for f in dataclasses.fields(FiniteElementShaft) if f.name not in DIMENSIONS)


def read_position(table: dict[str, Any], place: str, faults: Faults) -> float | None:
    """Takes `position` out of a station's table, m."""
    if "position" not in table:
        return None
    try:
        return read(table.pop("position"), "m")
    except ValueError as error:
        faults.add(place, f"position {error}")
        return 0.0


def profile_name(table: Any) -> Any:
    """Of its pieces of shaft."""
    return table.get("name", "shaft") if isinstance(table, dict) else "shaft"


def profile_line(
    table: Any, stations: dict[str, tuple[float, Any]], faults: Faults, folder: Path | None
) -> dict[str, Any] | None:
    """The line's elements; `None` where something is wrong, which is noted."""
    if not isinstance(table, dict):
        faults.add(
            "machine", f"profile must be a table, but is {shown(table)}: write [machine.profile]"
        )
        return None
    before = len(faults.sentences)
    faults.unknown_keys(PLACE, table, (*OWN, *OPTIONS))
    rows = _rows(table, faults, folder)
    name = profile_name(table)
    if not isinstance(name, str) or not name.strip() or "." in name:
        faults.add(PLACE, f"name must be a text without a dot, but is {shown(name)}")
    longest = None
    if "longest" in table:
        try:
            longest = read(table["longest"], "m")
        except ValueError as error:
            faults.add(PLACE, f"longest {error}")
    options = _options(table, faults, folder)
    if len(faults.sentences) > before or rows is None or options is None:
        return None
    between = table.get("between", "cones")
    try:
        return line_from_profile(rows, stations, name, between, longest, **options)
    except InputError as error:
        faults.sentences += [f"`{PLACE}`: {p.removeprefix('profile, ')}" for p in error.problems]
    return None


def _rows(table: dict[str, Any], faults: Faults, folder: Path | None) -> Any:
    if ("file" in table) == ("rows" in table):
        given = "both are" if "file" in table else "neither is"
        faults.add(PLACE, f"needs either a file or rows, but {given} given")
        return None
    unit = table.get("unit")
    if unit is not None and (not isinstance(unit, str) or factor(unit, "m") is None):
        faults.add(PLACE, f'unit must be one of length, but is {shown(unit)}: write unit = "mm"')
        return None
    if "file" in table:
        if not isinstance(table["file"], str):
            faults.add(PLACE, f"file must be a text, but is {shown(table['file'])}: quote it")
            return None
        file = Path(table["file"])
        try:
            return read_profile(file if folder is None else folder / file, unit)
        except InputError as error:
            faults.sentences += [f"`{PLACE}`: {p}" for p in error.problems]
            return None
    rows = table["rows"]
    if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        faults.add(
            PLACE,
            f"rows must be a list of [position, diameter, bore], but is {shown(rows)}: write rows = "
            '[[0, 40, 0], [200, 40, 0]] with unit = "mm"',
        )
        return None
    found, size = [], 1.0 if unit is None else factor(unit, "m") or 1.0
    for k, row in enumerate(rows):
        numbers = []
        for value in row:
            try:
                bare = isinstance(value, (int, float)) and not isinstance(value, bool)
                if bare and unit is None:
                    raise ValueError(
                        f'is a bare number ({value}): give unit = "mm" beside the rows'
                    )
                numbers.append(value * size if bare else read(value, "m"))
            except ValueError as error:
                faults.add(PLACE, f"rows[{k}] {error}")
                return None
        found.append(tuple(numbers))
    return found


def _options(table: dict[str, Any], faults: Faults, folder: Path | None) -> dict[str, Any] | None:
    """Checked by a shaft that has them."""
    given = {key: value for key, value in table.items() if key in OPTIONS}
    made = build(
        FiniteElementShaft,
        {"length": "1 m", "diameter": "1 m", "elements": 1} | given,
        Context(faults, PLACE, folder),
    )
    if made is FAILED:
        return None
    options = {key: getattr(made, key) for key in given}
    if "elements" in given:  # "auto" was told for that shaft alone
        options["elements"] = given["elements"]
    for key in ("axial_force", "torque"):
        if np.ndim(options.get(key, 0.0)):
            faults.add(PLACE, f"{key} must be one quantity for all of the profile, but is a list")
            return None
    return options
