"""Parameters by their path: `"main.unbalance.eccentricity"`; of a row an entry, `"bearing.stiffness[0]"`."""

import dataclasses
import re
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..core.declared import Within
from ..core.errors import InputError
from ..core.parameter import nested, parameter_fields
from .wiring import unknown

_ENTRY = re.compile(r"(.+?)\[(\d+)\]")


def split_entry(path: str) -> tuple[str, int | None]:
    """`"bearing.stiffness[0]"` -> its path and the entry's number."""
    match = _ENTRY.fullmatch(path)
    return (match[1], int(match[2])) if match else (path, None)


def entry_of(value: Any, entry: int, path: str) -> Any:
    """Raises `InputError` where the value has no such entry."""
    if np.ndim(value) != 1 or entry >= np.shape(value)[0]:
        raise InputError(f"`{path}`: there is no such entry: the shape is {np.shape(value)}")
    return value[entry]


def with_entry(value: Any, entry: int, one: Any, path: str) -> Any:
    """The row with another entry. Raises `InputError` where it has no such entry, or `one` is no number."""
    entry_of(value, entry, path)
    if np.ndim(one):
        raise InputError(f"`{path}`: must be one number, but has the shape {np.shape(one)}")
    return jnp.asarray(value).at[entry].set(one)


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
