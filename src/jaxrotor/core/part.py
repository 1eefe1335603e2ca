"""What a user builds: modules whose constructors say in a sentence what was given wrongly."""

import dataclasses
import functools
import inspect
import typing
from typing import Any

import equinox as eqx

from .arguments import Check
from .errors import InputError
from .gate import bound, by_hint
from .readable import one_line


def option(
    check: Check | None = None, metadata: dict[str, Any] | None = None, **kwargs: Any
) -> Any:
    """A field that is a choice, not a physical parameter: a count, a name, true or false. Another value of
    it is another program. `check`: what it must be (left out: what its type hint says)."""
    return eqx.field(static=True, metadata=dict(check=check) | (metadata or {}), **kwargs)


def as_tuple(value: Any) -> Any:
    """Several parts as a tuple; what is no list stays as it is, to be refused by name."""
    return tuple(value) if isinstance(value, list) else value


@functools.cache
def option_checks(cls: type) -> dict[str, tuple[Check, bool]]:
    """Of each field that is no part of the pytree: (its check, whether it may be `None`)."""
    try:
        hints = typing.get_type_hints(cls)
    except NameError:  # of a user's class: names that only a type checker sees
        hints = {}
    found = {}
    for field in dataclasses.fields(cls):
        hint = hints.get(field.name)
        check = field.metadata.get("check")
        if check is None and field.metadata.get("static"):
            check = by_hint(hint)
        if check is not None:
            none = type(None) in typing.get_args(hint) or field.default is None
            found[field.name] = (check, none)
    return found


@functools.cache
def _signature(cls: type) -> inspect.Signature:
    return inspect.signature(cls)


def _told(field: dataclasses.Field) -> str:
    """A parameter with its unit and, where it is no single number, its shape."""
    facts = field.metadata
    unit = ", ".join(facts["units"]) or facts["unit"] or "pure number"
    shapes = [shape for shape in facts["shapes"] if shape]
    sizes = " or ".join("x".join("n" if k is None else str(k) for k in shape) for shape in shapes)
    return f"`{field.name}` [{unit}]" + (f" ({sizes})" if sizes else "")


class _Gated(type(eqx.Module)):
    def __init__(cls, *args: Any, **kwargs: Any):  # noqa: N805
        """`help` tells the units of all physical parameters: they stand in their declarations."""
        super().__init__(*args, **kwargs)
        kind: Any = cls
        declared = dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()
        told = [_told(field) for field in declared if "unit" in field.metadata]
        if told and cls.__doc__:
            cls.__doc__ = f"{inspect.cleandoc(cls.__doc__)}\n\nParameters, SI: {', '.join(told)}."

    def __call__(cls, *args: Any, **kwargs: Any) -> Any:  # noqa: N805
        if inspect.isabstract(cls):
            return super().__call__(*args, **kwargs)  # which refuses it
        kind: Any = cls  # a class, which pyright does not take for hashable
        given = bound(cls.__name__, _signature(kind), args, kwargs)
        for name, (check, optional) in option_checks(kind).items():
            if name in given.arguments and not (given.arguments[name] is None and optional):
                try:
                    given.arguments[name] = check(given.arguments[name], name)
                except InputError as error:
                    raise InputError(*(f"`{cls.__name__}`: {p}" for p in error.problems)) from None
        return super().__call__(*given.args, **given.kwargs)


class Part(eqx.Module, metaclass=_Gated):
    """A module that a user builds: an element of a machine, a profile, a law, a sensor, a measure."""

    def __repr__(self) -> str:
        return one_line(self)
