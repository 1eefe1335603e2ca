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


def option(check: Check | None = None, metadata: dict | None = None, **kwargs: Any) -> Any:
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


class _Gated(type(eqx.Module)):
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
