"""Parameters that a study asks to find: tables with a path, where it starts and what it may be."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.units import read, shown
from ..machine.paths import split_entry
from ..search.instrumented import Instrumented
from ..search.space import Space
from ..search.unknown import Unknown, as_unknowns
from .mistakes import Faults

_KEYS = ("path", "start", "positive", "bounds", "circular", "prior", "scale", "also")


def read_unknown(
    table: Any,
    place: str,
    bench: Instrumented,
    faults: Faults,
    lists: bool = False,
    prior: bool = True,
) -> Unknown:
    """One [[....unknowns]] table. `lists`: whether a path may name a list of numbers, all of which are
    looked for; `prior`: whether one may be known beforehand."""
    nothing = Unknown("")
    if not isinstance(table, dict) or not isinstance(table.get("path"), str):
        faults.add(place, 'needs a path, such as path = "main.unbalance.eccentricity"')
        return nothing
    faults.unknown_keys(place, table, [key for key in _KEYS if prior or key != "prior"])
    path = table["path"]
    try:
        unit = _unit(path, bench, lists)
    except InputError as error:
        faults.sentences += [f"`{place}`: {p}" for p in error.problems]
        return nothing
    values: dict[str, Any] = {}
    for key in ("start", "scale"):
        if key in table:
            values[key] = read_quantity(table[key], unit, f"{place}: {key}", faults)
    for key in ("bounds", "prior"):
        if key in table:
            pair = table[key]
            if not isinstance(pair, list) or len(pair) != 2:
                faults.add(place, f"{key} must be two quantities, but is {shown(pair)}")
                continue
            values[key] = tuple(read_quantity(x, unit, f"{place}: {key}", faults) for x in pair)
    also = read_also(table, place, faults)
    for key in ("positive", "circular"):
        if not isinstance(table.get(key, False), bool):
            faults.add(place, f"{key} must be true or false, but is {shown(table[key])}")
    return Unknown(
        path,
        positive=table.get("positive", False) is True,
        circular=table.get("circular", False) is True,
        also=also,
        **values,
    )


def space_of(
    bench: Instrumented,
    unknowns: tuple[Unknown, ...],
    place: str,
    faults: Faults,
    unfold: Callable[..., tuple[Unknown, ...]] = as_unknowns,
) -> Space | None:
    """Where the search moves, with all that the unknowns and their starts say of each other; None where they
    do not fit, or their starts are no machine."""
    try:
        space = Space.of(bench, unfold(unknowns))
        space.set(bench, space.starts)
    except InputError as error:
        faults.sentences += [f"`{place}`: {p}" for p in error.problems]
        return None
    return space


def read_also(table: dict, place: str, faults: Faults) -> dict[str, float]:
    """Path -> factor of the parameters that follow one."""
    also = table.get("also", {})
    numbers = isinstance(also, dict) and all(
        isinstance(x, (int, float)) and not isinstance(x, bool) for x in also.values()
    )
    if not numbers:
        faults.add(
            place,
            f'also must be a table such as {{ "right.stiffness" = 1.0 }}, but is {shown(also)}',
        )
        return {}
    return {path: float(factor) for path, factor in also.items()}


def _unit(path: str, bench: Instrumented, lists: bool) -> str:
    """Of a number, or of all in a list; raises `InputError` where there is none."""
    if lists and split_entry(path)[1] is None and path.split(".")[0] in bench.machine.wiring.order:
        value, units = bench.machine.get(path), set(bench.machine.units(path))
        if np.ndim(value) == 1 and len(units) == 1:
            return units.pop()
    bench.get(path)
    return bench.unit(path)


def read_quantity(value: Any, unit: str, place: str, faults: Faults) -> float:
    try:
        return float(read(value, unit))
    except ValueError as error:
        faults.sentences.append(f"`{place}` {error}")
        return 1.0  # goes no further: there is a fault
