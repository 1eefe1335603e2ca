"""The coordinates of stations that are not free: `fixed` and `prescribed`."""

from pathlib import Path
from typing import Any

from ..core.kinematics import COORDINATES
from ..core.units import shown
from ..profiles.motion import AbstractMotion
from .build import Context, build_nested
from .mistakes import Faults, guess


def read_fixed(given: Any, stations: list[str], faults: Faults) -> dict[str, list[str]]:
    """`fixed = { station = ["z"] }`: coordinates that stay zero."""
    found = {}
    for station, names in _stations("fixed", given, stations, '{ station = ["z"] }', faults):
        if not isinstance(names, list):
            faults.add("fixed", f'"{station}" must be a list, but is {shown(names)}: write ["z"]')
            continue
        found[station] = [n for n in names if _coordinate("fixed", station, n, faults)]
    return found


def read_prescribed(
    given: Any, stations: list[str], faults: Faults, folder: Path | None
) -> dict[str, dict[str, Any]]:
    """`prescribed = { station = { phi = { kind = "CosineRamp", ... } } }`: given motions."""
    form = '{ phi = { kind = "CosineRamp", ... } }'
    found: dict[str, dict[str, Any]] = {}
    for station, motions in _stations(
        "prescribed", given, stations, f"{{ station = {form} }}", faults
    ):
        if not isinstance(motions, dict):
            faults.add(
                "prescribed", f'"{station}" must be a table, but is {shown(motions)}: write {form}'
            )
            continue
        for name, table in motions.items():
            if not _coordinate("prescribed", station, name, faults):
                continue
            # a ramp to 1 m/s of a displacement, to 1 rad/s of an angle
            context = Context(faults, f'prescribed "{station}"', folder, length=name in "xyz")
            if not isinstance(table, dict):
                context.fault(name, f"must be a table, but is {shown(table)}: give it a kind")
                continue
            motion = build_nested(AbstractMotion, name, table, context)
            found.setdefault(station, {})[name] = motion
    return found


def _stations(section: str, given: Any, stations: list[str], remedy: str, faults: Faults):
    """The entries for stations that exist; the others are refused."""
    if not isinstance(given, dict):
        faults.add("machine", f"{section} must be a table, but is {shown(given)}: write {remedy}")
        return
    for station, value in given.items():
        if station in stations:
            yield station, value
        else:
            faults.add(section, f'there is no station "{station}"{guess(station, stations)}')


def _coordinate(section: str, station: str, name: Any, faults: Faults) -> bool:
    if name in COORDINATES:
        return True
    faults.add(section, f'"{station}" has no coordinate {shown(name)}{guess(name, COORDINATES)}')
    return False
