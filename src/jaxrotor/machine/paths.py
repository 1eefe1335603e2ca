"""Parameters by their path: `"main.unbalance.eccentricity"`."""

import dataclasses
from collections.abc import Iterator
from typing import Any

import equinox as eqx

from ..errors import InputError
from ..parameter import parameter_fields
from .wiring import unknown


def walk(module: eqx.Module, prefix: str) -> Iterator[tuple[str, Any]]:
    """Every parameter below `module` with its path; what is absent (`None`) is passed over."""
    for field, value in parameter_fields(module):
        if value is not None:
            yield f"{prefix}.{field.name}", value
    names = {field.name for field, _ in parameter_fields(module)}
    for field in dataclasses.fields(module):  # pyright: ignore[reportArgumentType]
        value = getattr(module, field.name)
        if field.name not in names and isinstance(value, eqx.Module):
            yield from walk(value, f"{prefix}.{field.name}")


def resolve(module: Any, steps: list[str], path: str) -> Any:
    """Follows `steps` through the fields of `module`."""
    for step in steps:
        fields = (
            [f.name for f in dataclasses.fields(module)]  # pyright: ignore
            if isinstance(module, eqx.Module)
            else []
        )
        if step not in fields:
            raise InputError(f"`{path}`: {unknown('parameter', step, fields)}")
        module = getattr(module, step)
    return module


def field_of(module: Any, step: str) -> dataclasses.Field | None:
    for field in dataclasses.fields(module):
        if field.name == step:
            return field
    return None
