"""Reads the values of a section's table: what is wrong is told with place, value and remedy."""

from typing import Any

from ..core.units import read, shown
from .mistakes import Faults, guess


class Reader:
    """Values of one table; what is wrong is added to the faults."""

    def __init__(self, table: dict, place: str, faults: Faults):
        self.table, self.place, self.faults = table, place, faults

    def quantity(self, key: str, unit: str, default: Any = None) -> Any:
        if key not in self.table:
            return default
        try:
            return float(read(self.table[key], unit))
        except ValueError as error:
            self.faults.add(self.place, f"{key} {error}")
            return None

    def positive(self, key: str, unit: str, default: Any = None) -> Any:
        value = self.quantity(key, unit, default)
        if value is not None and not value > 0:
            self.faults.add(self.place, f"{key} must be positive, but is {shown(self.table[key])}")
        return value

    def row(self, key: str, unit: str, size: int | None = None) -> tuple[float, ...] | None:
        if key not in self.table:
            return None
        given = self.table[key]
        if not isinstance(given, list) or not given or size not in (None, len(given)):
            many = "a list" if size is None else f"{size} quantities"
            self.faults.add(self.place, f"{key} must be {many}, but is {shown(given)}")
            return None
        try:
            return tuple(float(read(one, unit)) for one in given)
        except ValueError as error:
            self.faults.add(self.place, f"{key} {error}")
            return None

    def flag(self, key: str, default: bool) -> bool:
        given = self.table.get(key, default)
        if not isinstance(given, bool):
            self.faults.add(self.place, f"{key} must be true or false, but is {shown(given)}")
        return bool(given)

    def count(self, key: str) -> int | None:
        given = self.table.get(key)
        if given is not None and (type(given) is not int or given < 1):
            self.faults.add(
                self.place, f"{key} must be a whole number above 0, but is {shown(given)}"
            )
            return None
        return given

    def name(self, key: str, known: tuple[str, ...] | None = None) -> str | None:
        given = self.table.get(key)
        if not isinstance(given, str):
            what = "is missing" if given is None else f"must be a text, but is {shown(given)}"
            self.faults.add(self.place, f'{key} {what}: write {key} = "..."')
            return None
        if known is not None and given not in known:
            self.faults.add(self.place, f'{key} names no such part "{given}"{guess(given, known)}')
            return None
        return given

    def choice(self, key: str, known: tuple[str, ...], default: str) -> Any:
        given = self.table.get(key, default)
        if given not in known:
            self.faults.add(self.place, f"{key} is {shown(given)}{guess(given, known)}")
            return default
        return given

    def names(self, key: str, known: tuple[str, ...]) -> tuple[str, ...] | None:
        given = self.table.get(key)
        if given is None:
            return None
        if not isinstance(given, list) or not all(isinstance(x, str) for x in given):
            self.faults.add(
                self.place, f'{key} must be a list of names, but is {shown(given)}: write ["..."]'
            )
            return None
        for name in given:
            if name not in known:
                self.faults.add(
                    self.place, f'{key} names no such part "{name}"{guess(name, known)}'
                )
        return tuple(given)

    def mapping(self, key: str, known: tuple[str, ...]) -> dict[str, Any]:
        """Name -> what is given; of known names alone."""
        given = self.table.get(key, {})
        if not isinstance(given, dict):
            self.faults.add(
                self.place, f"{key} must be a table, but is {shown(given)}: write {{ name = ... }}"
            )
            return {}
        for name in given:
            if name not in known:
                self.faults.add(
                    self.place, f'{key} names no such part "{name}"{guess(name, known)}'
                )
        return {name: value for name, value in given.items() if name in known}

    def numbers(self, key: str, known: tuple[str, ...]) -> dict[str, float]:
        """Name -> a number above 0."""
        found = {}
        for name, value in self.mapping(key, known).items():
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
                self.faults.add(
                    self.place, f'{key} of "{name}" must be a number above 0, but is {shown(value)}'
                )
            else:
                found[name] = float(value)
        return found


def tables_of(table: dict, section: str, key: str, faults: Faults) -> list[tuple[str, dict]]:
    """Place and table of each entry of `[[section.key]]`."""
    given = table.get(key, [])
    if not isinstance(given, list) or not all(isinstance(one, dict) for one in given):
        faults.add(
            section, f"{key} must be tables, but is {shown(given)}: write [[{section}.{key}]]"
        )
        return []
    return [(f"{section}.{key}, entry {i + 1}", one) for i, one in enumerate(given)]
