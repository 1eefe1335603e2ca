"""Parameters by their path: `"main.unbalance.eccentricity"`."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import equinox as eqx

from ..core.declared import Within
from ..core.errors import InputError
from ..core.parameter import nested, parameter_fields
from .wiring import unknown


def walk(module: eqx.Module, prefix: str) -> Iterator[tuple[str, Any]]:
    """Every parameter below `module` with its path; what is absent (`None`) is passed over."""
    for field, value in parameter_fields(module):
        if value is not None:
            yield f"{prefix}.{field.name}", value
    names = {field.name for field, _ in parameter_fields(module)}
    for field in dataclasses.fields(module):  # pyright: ignore[reportArgumentType]
        value = getattr(module, field.name)
        if field.name not in names:
            for name, part in nested(field, value):
                yield from walk(part, f"{prefix}.{name}")


def resolve(module: Any, steps: list[str], path: str) -> Any:
    """Follows `steps` through the fields of `module`; a number is a place in a tuple of parts."""
    for step in steps:
        if isinstance(module, eqx.Module):
            below = {f.name: getattr(module, f.name) for f in dataclasses.fields(module)}  # pyright: ignore
        elif isinstance(module, tuple):
            below = {str(i): part for i, part in enumerate(module)}
        else:
            below = {}
        if step not in below:
            raise InputError(f"`{path}`: {unknown('parameter', step, list(below))}")
        module = below[step]
    return module


def field_of(module: Any, step: str) -> dataclasses.Field | None:
    for field in dataclasses.fields(module) if isinstance(module, eqx.Module) else ():
        if field.name == step:
            return field
    return None


def place_of(root: Any, steps: list[str], path: str, length: bool = False) -> Within:
    """Where the parameter behind `steps` stands. `length`: `root` is the motion of a displacement."""
    found = Within(length=length)
    for i, step in enumerate(steps[:-1]):
        field = field_of(resolve(root, steps[:i], path), step)
        if field is not None:  # else a place in a tuple of parts
            found = found.below(field)
    return found
