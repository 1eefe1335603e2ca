"""Builds elements from tables, by looking at their fields: each field's declaration says what may
stand there and in which unit, so an element needs nothing more to be known to study files."""

import dataclasses
import inspect
import typing
from dataclasses import dataclass, replace
from pathlib import Path
from types import NoneType
from typing import Any

import equinox as eqx

from ..core.declared import Within
from ..core.errors import InputError
from ..core.parameter import problems
from ..core.part import option_checks
from ..core.units import example, read, shown
from .kinds import find_kind, public_constants, public_kinds
from .mistakes import Faults, guess
from .values import declared_units, driven_unit, read_parameter

FAILED: Any = object()  # what could not be built; its faults have been noted


@dataclass(frozen=True)
class Context:
    """Where in the file something is read. `driven`: unit of what a schedule gives. `length`:
    motions are in m where a displacement is prescribed, not in rad. `straight`: laws are in m and N
    where they act along a line, not in rad and N·m."""

    faults: Faults
    place: str
    folder: Path | None = None
    prefix: str = ""
    driven: str = ""
    length: bool = False
    straight: bool = False

    def fault(self, key: str, predicate: str) -> Any:
        self.faults.add(self.place, f"{self.prefix}{key} {predicate}")
        return FAILED

    def below(self, key: str, driven: str = "") -> "Context":
        return replace(self, prefix=f"{self.prefix}{key}.", driven=driven)

    def unit(self, field: dataclasses.Field) -> str:
        return Within(self.driven, self.length, self.straight).unit(field)


def build_element(cls: type, table: dict, context: Context) -> Any:
    """The element with every check that it can make of itself, or FAILED."""
    element = build(cls, table, context)
    if element is FAILED:
        return FAILED
    found = list(problems(element, context.place))
    context.faults.sentences += found
    return FAILED if found else element


def build(cls: type, table: dict, context: Context) -> Any:
    """An instance of `cls` (any equinox module) from its table, or FAILED."""
    fields = {f.name: f for f in dataclasses.fields(cls) if f.init}
    before = len(context.faults.sentences)
    meant = context.faults.unknown_keys(context.place, table, fields, context.prefix)
    values, hints = {}, hints_of(cls)
    for name, field in fields.items():
        if name in table:
            values[name] = _read(cls, field, hints[name], table[name], context)
        elif name not in meant and field.default is field.default_factory is dataclasses.MISSING:
            context.fault(name, f"is missing: write {name} = {_example(cls, field, context)}")
    if len(context.faults.sentences) > before:
        return FAILED
    try:
        return cls(**values)
    except InputError as error:
        context.faults.sentences += [f"`{context.place}`: {p}" for p in error.problems]
    except (TypeError, ValueError) as error:
        context.faults.add(context.place, f"a {cls.__name__} cannot be made of this: {error}")
    return FAILED


def build_nested(base: type, field: str, table: dict, context: Context, driven: str = "") -> Any:
    """A module that stands as a table inside another: `base` itself, or the kind it names."""
    below = context.below(field, driven)
    table = dict(table)
    kind = table.pop("kind", None)
    cls: type | None = base
    if kind is not None:
        cls = find_kind(kind, base, context.place, context.faults, context.folder, below.prefix)
    elif inspect.isabstract(base):
        known = ", ".join(public_kinds(base))
        return below.fault("kind", f'is missing: write kind = "...", one of {known}')
    return FAILED if cls is None else build(cls, table, below)


def _read(cls: type, field: dataclasses.Field, hint: Any, value: Any, context: Context) -> Any:
    if "unit" in field.metadata:
        units = declared_units(cls, field)
        found, sentences = read_parameter(
            field, value, context.unit(field), units, context.place, context.prefix + field.name
        )
        context.faults.sentences += sentences
        return FAILED if sentences else found
    options = [a for a in flat(hint) if a is not NoneType]
    literal = [c for a in options if typing.get_origin(a) is typing.Literal for c in a.__args__]
    if literal and not (int in options and isinstance(value, int)):
        if value in literal and not isinstance(value, bool):
            return value
        known = [str(c) for c in literal]
        return context.fault(
            field.name,
            f"must be one of those known, but is {shown(value)}{guess(value, known)}",
        )
    modules = [a for a in options if isinstance(a, type) and issubclass(a, eqx.Module)]
    members = typing.get_args(hint)[:1] if typing.get_origin(hint) is tuple else ()
    if members and isinstance(members[0], type) and issubclass(members[0], eqx.Module):
        return _read_modules(field, members[0], value, context)
    if modules:
        return _read_module(cls, field, _meant(modules, value), value, context)
    if float in options:
        return _read_number(field, value, context)
    for kind, words in ((bool, "true or false"), (int, "a whole number"), (str, "a text")):
        if kind in options:
            if isinstance(value, kind) and (kind is bool or not isinstance(value, bool)):
                return _within(cls, field, value, context)
            return context.fault(field.name, f"must be {words}, but is {shown(value)}: correct it")
    return context.fault(
        field.name, "cannot be given in a study file: leave it out, or build the machine in Python"
    )


def _within(cls: type, field: dataclasses.Field, value: Any, context: Context) -> Any:
    """The option, where it lies within what the class allows."""
    check, _ = option_checks(cls).get(field.name, (None, False))
    if check is None:
        return value
    try:
        return check(value, field.name)
    except InputError as error:
        predicate = str(error).removeprefix(f"{field.name} ")
        return context.fault(field.name, f"{predicate}: correct it")


def _read_number(field: dataclasses.Field, value: Any, context: Context) -> Any:
    """A number that is no parameter. `quantity`: its unit; `also`: other units with their size in it."""
    for unit, size in field.metadata.get("also", {}).items():
        try:
            return size * read(value, unit)
        except ValueError:
            pass  # told for its own unit
    try:
        return read(value, field.metadata.get("quantity", ""))
    except ValueError as error:
        return context.fault(field.name, str(error))


def _read_modules(field: dataclasses.Field, base: type, value: Any, context: Context) -> Any:
    """A tuple of modules, from a list of tables."""
    if not isinstance(value, list) or not all(isinstance(table, dict) for table in value):
        return context.fault(
            field.name,
            f"must be a list of tables, but is {shown(value)}: write {field.name} = "
            '[{ kind = "...", ... }, ...]',
        )
    parts = [build_nested(base, f"{field.name}.{i}", t, context) for i, t in enumerate(value)]
    return FAILED if any(part is FAILED for part in parts) else tuple(parts)


def _meant(modules: list[type], value: Any) -> type:
    """Of several that may stand there, the one that has most of the table's keys."""

    def shared(module: Any) -> int:
        return len({*value} & {f.name for f in dataclasses.fields(module)})

    return max(modules, key=shared) if isinstance(value, dict) else modules[0]


def _read_module(
    cls: type, field: dataclasses.Field, base: type, value: Any, context: Context
) -> Any:
    driven = driven_unit(cls, field)
    if field.metadata.get("straight"):
        context = replace(context, straight=True)
    if isinstance(value, dict):
        return build_nested(base, field.name, value, context, driven or "")
    if driven is not None:
        return _steady(field, value, driven, context)
    if isinstance(value, str):
        convert = field.metadata.get("converter", lambda x: x)
        fitting = {n: c for n, c in public_constants().items() if isinstance(convert(c), base)}
        if value.strip().lower() in fitting:
            return fitting[value.strip().lower()]
        by_name = field.metadata.get("by_name")
        if by_name is not None:
            try:
                return by_name(value)
            except InputError:
                pass  # told with all names that may stand here
        names = [*fitting, *field.metadata.get("named", ())]
        if names:
            words = f"must be one of those known or a table, but is {shown(value)}"
            return context.fault(field.name, f"{words}{guess(value, names)}")
    inside = ", ".join(f.name for f in dataclasses.fields(base)) or 'kind = "..."'
    return context.fault(
        field.name,
        f"must be a table, but is {shown(value)}: write {field.name} = {{ ... }} with {inside}",
    )


def _steady(field: dataclasses.Field, value: Any, unit: str, context: Context) -> Any:
    """A schedule given as one quantity: the field's own converter makes it steady."""
    try:
        return read(value, unit)
    except ValueError as error:
        return context.fault(field.name, f'{error}, or a table such as {{ kind = "Step", ... }}')


def flat(hint: Any) -> list[Any]:
    """The members of a union, or the hint alone."""
    if typing.get_origin(hint) is typing.Literal or not _is_union(hint):
        return [hint]
    return [a for arg in typing.get_args(hint) for a in flat(arg)]


def _is_union(hint: Any) -> bool:
    import types

    return typing.get_origin(hint) in (typing.Union, types.UnionType)


def hints_of(cls: type) -> dict[str, Any]:
    try:
        return typing.get_type_hints(cls)
    except Exception:  # names that only a type checker sees
        return {f.name: f.type for f in dataclasses.fields(cls)}


def _example(cls: type, field: dataclasses.Field, context: Context) -> str:
    if "unit" not in field.metadata:
        if "quantity" in field.metadata:
            return example(field.metadata["quantity"])
        if str in flat(hints_of(cls)[field.name]):
            return '"..."'
        return f"{example(driven_unit(cls, field) or '')}" if driven_unit(cls, field) else "{ ... }"
    units = declared_units(cls, field)
    if units:
        return "[" + ", ".join(example(u) for u in units) + "]"
    one = example(context.unit(field))
    return one if () in field.metadata["shapes"] else f"[{one}, ...]"
