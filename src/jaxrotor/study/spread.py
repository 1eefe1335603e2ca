"""The parameters of [sweep]: how each scatters, or which values it takes."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import stats

from ..core.arguments import whole
from ..core.errors import InputError
from ..core.units import shown
from ..search.instrumented import Instrumented
from .mistakes import Faults, guess
from .unknowns import read_also, read_quantity

_KEYS = ("path", "distribution", "values", "from", "to", "points", "also")
_RANGE = ("from", "to", "points")


@dataclasses.dataclass(frozen=True)
class Swept:
    """One [[sweep.parameters]] table: a frozen `distribution`, or `values`; SI."""

    path: str
    place: str
    unit: str
    distribution: Any = None
    values: np.ndarray | None = None
    also: dict[str, float] = dataclasses.field(default_factory=dict)


def _normal(mean: float, std: float, low: float = -np.inf, high: float = np.inf) -> Any:
    if np.isinf(low) and np.isinf(high):
        return stats.norm(mean, std)
    return stats.truncnorm((low - mean) / std, (high - mean) / std, mean, std)


def _triangular(low: float, mode: float, high: float) -> Any:
    return stats.triang((mode - low) / (high - low), low, high - low)


# Kind -> what it needs, what it may have, how it is made.
_KINDS: dict[str, tuple[tuple[str, ...], tuple[str, ...], Callable]] = {
    "uniform": (("low", "high"), (), lambda low, high: stats.uniform(low, high - low)),
    "normal": (("mean", "std"), ("low", "high"), _normal),
    "lognormal": (
        ("median", "sigma"),
        (),
        lambda median, sigma: stats.lognorm(s=sigma, scale=median),
    ),
    "triangular": (("low", "mode", "high"), (), _triangular),
}
_PURE = ("sigma",)
_POSITIVE = ("std", "sigma", "median")


def read_swept(table: Any, place: str, bench: Instrumented, faults: Faults) -> Swept | None:
    if not isinstance(table, dict) or not isinstance(table.get("path"), str):
        faults.add(place, 'needs a path, such as path = "main.unbalance.eccentricity"')
        return None
    before, path = len(faults.sentences), table["path"]
    meant = faults.unknown_keys(place, table, _KEYS)
    unit = unit_of(path, place, bench, faults)
    also = read_also(table, place, faults)
    for other in also:
        unit_of(other, f"{place}: also", bench, faults)
    if unit is None:
        return None
    given = [key for key in ("distribution", "values") if key in table]
    given += ["from, to and points"] if any(key in table for key in _RANGE) else []
    if len(given) != 1:
        what = f"{' and '.join(given)} are" if given else "none is"
        if given or not meant:
            faults.add(
                place,
                f"needs one of distribution, values, and from, to and points, but {what} given",
            )
        return None
    distribution = values = None
    if "distribution" in table:
        distribution = _distribution(table["distribution"], unit, place, faults)
    elif "values" in table:
        values = _values(table["values"], unit, place, faults)
    else:
        values = read_range({k: table[k] for k in _RANGE if k in table}, unit, place, faults)
    if len(faults.sentences) > before:
        return None
    return Swept(path, place, unit, distribution, values, also)


def unit_of(path: str, place: str, bench: Instrumented, faults: Faults) -> str | None:
    """Of the number at a path; None where there is no such number."""
    try:
        bench.get(path)
        return bench.unit(path)
    except InputError as error:
        faults.sentences += [f"`{place}`: {p}" for p in error.problems]
        return None


def _distribution(table: Any, unit: str, place: str, faults: Faults) -> Any:
    if not isinstance(table, dict) or "kind" not in table:
        what = (
            "has no kind" if isinstance(table, dict) else f"must be a table, but is {shown(table)}"
        )
        faults.add(
            place,
            f'distribution {what}: write {{ kind = "uniform", low = ..., high = ... }}, or one of '
            + ", ".join(_KINDS),
        )
        return None
    kind = table["kind"]
    if kind not in _KINDS:
        faults.add(place, f"distribution.kind {shown(kind)} is unknown{guess(kind, _KINDS)}")
        return None
    needed, more, make = _KINDS[kind]
    own = {k: v for k, v in table.items() if k != "kind"}
    before = len(faults.sentences)
    meant = faults.unknown_keys(place, own, (*needed, *more), "distribution.")
    found = {}
    for key in (*needed, *more):
        where = f"{place}: distribution.{key}"
        if key in own:
            found[key] = read_quantity(own[key], "" if key in _PURE else unit, where, faults)
        elif key in needed and key not in meant:
            faults.add(
                place, f"distribution.{key} is missing: a {kind} one has {', '.join(needed)}"
            )
    if len(faults.sentences) > before:
        return None
    for key in _POSITIVE:
        if key in found and not found[key] > 0:
            faults.add(
                place, f"distribution.{key} must be positive, but is {own[key]!r}: correct it"
            )
    rising = [key for key in ("low", "mode", "high") if key in found]
    for a, b in zip(rising, rising[1:]):
        level = found[a] == found[b] and "mode" in (a, b) and found["low"] < found["high"]
        if found[a] >= found[b] and not level:
            faults.add(
                place,
                f"distribution.{a} must lie below {b}, but they are {shown(own[a])} and {shown(own[b])}",
            )
    return None if len(faults.sentences) > before else make(**found)


def _values(given: Any, unit: str, place: str, faults: Faults) -> np.ndarray | None:
    if not isinstance(given, list) or not given:
        faults.add(place, f"values must be a list of quantities, but is {shown(given)}")
        return None
    numbers = [read_quantity(x, unit, f"{place}: values[{i}]", faults) for i, x in enumerate(given)]
    return np.array(numbers)


def read_range(
    table: dict, unit: str, place: str, faults: Faults, prefix: str = ""
) -> np.ndarray | None:
    """`from`, `to` and `points`: evenly between them, both included."""
    before = len(faults.sentences)
    for key in _RANGE:
        if key not in table:
            faults.add(place, f"{prefix}{key} is missing: {prefix}from, to and points go together")
    ends = [
        read_quantity(table[key], unit, f"{place}: {prefix}{key}", faults)
        for key in ("from", "to")
        if key in table
    ]
    points = table.get("points", 2)
    try:
        whole(2)(points, f"{prefix}points")
    except InputError as error:
        faults.add(place, f"{error}: correct it")
    return None if len(faults.sentences) > before else np.linspace(ends[0], ends[1], points)
