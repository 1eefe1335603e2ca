"""Reads the value of one physical parameter: a quantity, or a list of them."""

import dataclasses
from typing import Any

from ..core.parameter import _faults as bounds, as_float64
from ..core.units import example, factor, known_unit, read, shown


def declared_units(cls: type, field: dataclasses.Field) -> tuple[str, ...]:
    """Units of the entries of a short list, where they differ."""
    return field.metadata.get("units", ())


def driven_unit(cls: type, field: dataclasses.Field) -> str | None:
    """The unit that a schedule in this field gives; None where the field holds no schedule."""
    return field.metadata.get("drives")


def read_parameter(
    field: dataclasses.Field,
    value: Any,
    unit: str,
    units: tuple[str, ...],
    place: str,
    path: str,
) -> tuple[Any, list[str]]:
    """(the numbers in SI, faults). Shapes and bounds are those that the field declares."""
    shapes = field.metadata["shapes"]
    faults: list[str] = []

    def fault(where: str, predicate: str) -> None:
        faults.append(f"`{place}`: {where} {predicate}")

    def entries(items: list, inner: str, where: str) -> list:
        return [
            entries(item, inner, f"{where}[{i}]")
            if isinstance(item, list)
            else number(item, inner, f"{where}[{i}]")
            for i, item in enumerate(items)
        ]

    def number(item: Any, inner: str, where: str) -> float:
        try:
            return read(item, inner)
        except ValueError as error:
            fault(where, str(error))
            return 1.0  # goes no further: there is a fault

    single = () in shapes
    if isinstance(value, dict):
        found = _table(value, unit, path, fault)
    elif isinstance(value, list):
        if all(shape == () for shape in shapes):
            fault(path, f"must be one quantity, but is {shown(value)}: write {example(unit)}")
            return None, faults
        if units and not any(isinstance(item, list) for item in value):
            if len(value) != len(units):
                listed = ", ".join(example(u) for u in units)
                fault(
                    path, f"must have {len(units)} entries, but has {len(value)}: write [{listed}]"
                )
                return None, faults
            found = [number(v, u, f"{path}[{i}]") for i, (v, u) in enumerate(zip(value, units))]
        else:  # a matrix of mixed units stays in bare SI numbers
            found = entries(value, unit, path)
    elif single:
        found = number(value, unit, path)
    else:
        listed = ", ".join(example(u) for u in units) or f"{example(unit)}, ..."
        fault(path, f"must be a list, but is {shown(value)}: write [{listed}]")
        return None, faults
    if not faults and not _even(found):
        assert isinstance(found, list)
        rows = ", ".join(str(len(row)) if isinstance(row, list) else "1" for row in found)
        fault(path, f"must have rows of one length, but they have {rows} entries: fill them up")
    if not faults:
        faults += bounds(field, as_float64(found), place, path, unit)
    return found, faults


def _even(found: Any) -> bool:
    """Whether nested lists make a full array."""
    if not isinstance(found, list):
        return True
    sizes = {len(row) if isinstance(row, list) else -1 for row in found}
    return len(sizes) <= 1 and all(_even(row) for row in found)


def _table(table: dict, unit: str, path: str, fault) -> Any:
    """`{ unit = "rpm", values = [0, 600, 1200] }`, for lists too long to repeat the unit."""
    given, values = table.get("unit"), table.get("values")
    if set(table) != {"unit", "values"} or not isinstance(values, list):
        fault(
            path,
            f"must be a quantity or a list, but is {shown(table)}: write "
            f'{example(unit)}, or {{ unit = "{unit}", values = [...] }}',
        )
        return None
    scale = factor(given, unit) if isinstance(given, str) and known_unit(given) else None
    if scale is None:
        fault(f"{path}.unit", f'must be in {unit}, but is {shown(given)}: write unit = "{unit}"')
        return None

    def scaled(items: list, where: str) -> list:
        numbers = []
        for i, item in enumerate(items):
            if isinstance(item, list):
                numbers.append(scaled(item, f"{where}[{i}]"))
                continue
            try:
                numbers.append(read(item, "") * scale)
            except ValueError as error:
                fault(f"{where}[{i}]", str(error))
        return numbers

    return scaled(values, f"{path}.values")
