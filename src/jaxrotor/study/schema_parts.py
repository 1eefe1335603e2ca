"""The JSON Schema of what machines are made of, from the parts' own declarations."""

import dataclasses
import inspect
import re
import typing
from collections.abc import Iterable
from types import NoneType
from typing import Any

import equinox as eqx

from ..core.declared import ALONE, Within, default_of
from ..core.units import example
from .build import flat, hints_of
from .kinds import public_constants, public_kinds

# A number with its unit, as it is written; which unit fits a reader tells.
QUANTITY = r"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*\S"
# A user's own class.
_OWN = r"^[\w.]+:\w+$"
Schema = dict[str, Any]


def quantity(unit: str, words: str = "") -> Schema:
    """`words`: what it is, ahead of its unit."""
    told = f"in {unit} or the like, such as {example(unit)}" if unit else "a number without a unit"
    told = f"{words}, {told}" if words else told
    if not unit:
        return {"type": ["number", "string"], "description": told}
    return {"type": "string", "pattern": QUANTITY, "description": told}


def listed(items: Schema, least: int = 0) -> Schema:
    return {"type": "array", "items": items, "minItems": least}


def closed(properties: Schema, required: Iterable[str] = (), words: str = "") -> Schema:
    """A table that has no other keys."""
    found: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    if needed := list(required):
        found["required"] = needed
    return found | ({"description": words} if words else {})


class Definitions:
    """The schemas of classes, each made once and referred to."""

    def __init__(self) -> None:
        self.found: dict[str, Schema] = {}

    def kinds(
        self,
        bases: type | tuple[type, ...],
        more: Schema | None = None,
        needed: Iterable[str] = (),
        without: Iterable[type] = (),
    ) -> Schema:
        """A table with the `kind` of one of them, or of a user's own; `more`: keys beside its own."""
        choices = [
            self._table(cls, ALONE, name, more or {}, needed)
            for name, cls in public_kinds(bases).items()
            if not issubclass(cls, tuple(without))
        ]
        return {"anyOf": [*choices, _own(more or {}, needed)]}

    def properties(self, cls: type) -> Schema:
        """What may stand in its table, key by key."""
        return self._fields(cls, ALONE)[0]

    def _table(
        self, cls: type, within: Within, kind: str | None, more: Schema, needed: Iterable[str]
    ) -> Schema:
        properties, required = self._fields(cls, within)
        if kind is not None:
            properties = {"kind": {"const": kind, "description": words_of(cls)}, **properties}
        required = [*(["kind"] if kind is not None else []), *needed, *required]
        return closed({**more, **properties}, required, words_of(cls))

    def nested(self, base: type, within: Within) -> Schema:
        """What stands in a field of this class: a table, with a kind where there are several."""
        name = "-".join(
            re.sub(r"\W+", "_", part)
            for part in (
                base.__name__,
                within.driven,
                "m" * within.length,
                "straight" * within.straight,
            )
            if part
        )
        if name not in self.found:
            self.found[name] = {}  # for what holds itself
            tables = [
                self._table(cls, within, kind, {}, ()) for kind, cls in public_kinds(base).items()
            ]
            if not inspect.isabstract(base):
                tables.append(self._table(base, within, None, {}, ()))
            self.found[name] = {"anyOf": [*tables, _own({}, ())]}
        return {"$ref": f"#/$defs/{name}"}

    def _fields(self, cls: type, within: Within) -> tuple[Schema, list[str]]:
        properties: Schema = {}
        required = []
        hints = hints_of(cls)
        for field in dataclasses.fields(cls):
            if not field.init:
                continue
            found = self._field(field, hints[field.name], within)
            if found is None:
                continue
            properties[field.name] = found
            if field.default is field.default_factory is dataclasses.MISSING:
                required.append(field.name)
        return properties, required

    def _field(self, field: dataclasses.Field, hint: Any, within: Within) -> Schema | None:
        if "unit" in field.metadata:
            return _parameter(field, within)
        options = [a for a in flat(hint) if a is not NoneType]
        literal = [c for a in options if typing.get_origin(a) is typing.Literal for c in a.__args__]
        members = typing.get_args(hint)[:1] if typing.get_origin(hint) is tuple else ()
        below = within.below(field)
        if members and _is_module(members[0]):
            return listed(self.nested(members[0], below))
        modules = [a for a in options if _is_module(a)]
        if modules:
            return self._module(field, modules, below)
        simple = [
            _quantity_of(field) if kind is float else {"type": name}
            for kind, name in ((bool, "boolean"), (int, "integer"), (str, "string"), (float, ""))
            if kind in options
        ]
        choices = ([{"enum": literal}] if literal else []) + simple
        if not choices:
            return None  # cannot be given in a study
        return choices[0] if len(choices) == 1 else {"anyOf": choices}

    def _module(self, field: dataclasses.Field, bases: list[type], below: Within) -> Schema:
        base, *others = bases
        found = self.nested(base, below)
        if others:
            found = {"anyOf": [found, *(self.nested(other, below) for other in others)]}
        unit = field.metadata.get("drives")
        if unit is not None:  # a schedule, or one quantity for all times
            return {"anyOf": [quantity(unit), found]}
        convert = field.metadata.get("converter", lambda x: x)
        names = [n for n, c in public_constants().items() if isinstance(convert(c), base)]
        if field.metadata.get("named"):  # in capitals or not
            known = ", ".join(field.metadata["named"])
            return {
                "anyOf": [{"type": "string", "description": f"{', '.join(names)}, {known}"}, found]
            }
        return {"anyOf": [{"enum": names}, found]} if names else found


def _is_module(candidate: Any) -> bool:
    return isinstance(candidate, type) and issubclass(candidate, eqx.Module)


def _quantity_of(field: dataclasses.Field) -> Schema:
    found = quantity(field.metadata.get("quantity", ""))
    also = field.metadata.get("also", {})
    return {"anyOf": [found, *map(quantity, also)]} if also else found


def _parameter(field: dataclasses.Field, within: Within) -> Schema:
    """One quantity, a list of them, or a list with its unit, as the shapes allow."""
    unit, shapes = within.unit(field), field.metadata["shapes"]
    words = _parameter_words(field)
    one = quantity(unit, words)
    choices = [one] if () in shapes else []
    if any(shape != () for shape in shapes):
        # entries of a matrix of mixed units are bare numbers
        entry: Schema = {"anyOf": [{"type": ["number", "string"]}, listed({})]}
        units = field.metadata.get("units", ())
        listing = ", ".join(map(example, units)) or f"{example(unit)}, ..."
        choices.append(
            {**listed(entry), "description": f"{words}, a list: [{listing}]".lstrip(", ")}
        )
        long = {"unit": {"type": "string"}, "values": listed({})}
        choices.append(closed(long, ["unit", "values"], "a long list, with its unit once"))
    found = choices[0] if len(choices) == 1 else {"anyOf": choices}
    return {**found, "description": one["description"]} | _default(field)


def _parameter_words(field: dataclasses.Field) -> str:
    label = field.metadata.get("label") or field.name.replace("_", " ")
    bound = "positive" if field.metadata.get("positive") else ""
    bound = bound or ("not negative" if field.metadata.get("nonnegative") else "")
    return f"{label} ({bound})" if bound else label


def _default(field: dataclasses.Field) -> Schema:
    value = default_of(field)
    if value is dataclasses.MISSING or value is None or getattr(value, "ndim", 1) != 0:
        return {}
    return {"default": float(value)} if field.metadata["unit"] == "" else {}


def _own(more: Schema, needed: Iterable[str]) -> Schema:
    """A class of the user's own, of which nobody knows the keys."""
    return {
        "type": "object",
        "properties": {**more, "kind": {"type": "string", "pattern": _OWN}},
        "required": ["kind", *needed],
        "description": 'a class of your own, kind = "package.module:Class"',
    }


def words_of(cls: type) -> str:
    """The first sentence of its docstring."""
    text = " ".join((inspect.getdoc(cls) or "").split("\n\n")[0].split())
    return text.partition(". ")[0].rstrip(".")
