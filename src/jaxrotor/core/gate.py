"""Every argument of a call against its check: of public functions, dataclasses and constructors."""

import functools
import inspect
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from jaxtyping import AbstractArray

from .arguments import (
    LARGEST,
    Check,
    choice,
    flag,
    mapping,
    nearest,
    number,
    short,
    some_text,
    whole,
)
from .errors import InputError

# A class or a function: what goes in comes out.
Gated = TypeVar("Gated")

_PLAIN: dict[Any, Check] = {bool: flag, int: whole(0, LARGEST), float: number(), str: some_text}


def _any_of(kinds: Iterable[type]) -> str:
    names = [kind.__name__ for kind in kinds]
    return " or ".join(f"an {n}" if n[0] in "AEIOU" else f"a {n}" for n in names)


def either(kinds: type | tuple[type, ...], other: Check) -> Check:
    """One of these objects, or what the `other` check takes."""
    kinds = kinds if isinstance(kinds, tuple) else (kinds,)
    words = _any_of(kinds)

    def check(value: Any, place: str) -> Any:
        if isinstance(value, kinds):
            return value
        try:
            return other(value, place)
        except InputError as error:
            raise InputError(str(error).replace(" must be ", f" must be {words} or ", 1)) from None

    return check


def by_hint(hint: Any) -> Check | None:
    """The check that a type hint asks for; `None` where it says nothing."""
    members = typing.get_args(hint) if typing.get_origin(hint) in _UNIONS else (hint,)
    plain: list[Check] = []
    classes: list[type] = []
    for one in members:
        if one is type(None):
            continue
        if one is Any:
            return None
        if isinstance(one, type) and issubclass(one, AbstractArray):
            continue  # stands beside `float`, or says nothing that could be checked here
        if typing.get_origin(one) is typing.Literal:
            plain.append(choice(*typing.get_args(one)))
        elif one in _PLAIN:
            plain.append(_PLAIN[one])
        elif typing.get_origin(one) in (Mapping, dict, _MAPPING):
            plain.append(mapping)
        elif isinstance(one, type) and typing.get_origin(one) is None and one is not object:
            classes.append(one)
        else:
            return None
    if not plain and not classes:
        return None

    wanted = _any_of(classes)
    if plain and classes:
        return either(tuple(classes), plain[0])

    def check(value: Any, place: str) -> Any:
        if plain:
            return plain[0](value, place)
        if isinstance(value, tuple(classes)):
            return value
        given = value.__name__ if isinstance(value, type) else short(value)
        raise InputError(f"{place} must be {wanted}, but is {given} ({type(value).__name__})")

    return check


_UNIONS = (typing.Union, types.UnionType)
_MAPPING = typing.get_origin(typing.Mapping[str, Any])


def bound(place: str, signature: inspect.Signature, args: tuple, kwargs: dict):
    """What a call gives to each parameter; raises `InputError` for a name that is none of them, for one
    that is missing, and for too many."""
    try:
        return signature.bind(*args, **kwargs)
    except TypeError as error:
        known = [name for name in signature.parameters if name not in ("self", "cls")]
        for name in kwargs:
            if name not in known:
                guess = nearest(name, known) or f"; known: {', '.join(known) or 'none'}"
                raise InputError(f"`{place}`: there is no argument {name!r}{guess}") from None
        required = [n for n, p in signature.parameters.items() if p.default is p.empty]
        missing = [n for n in required[len(args) :] if n not in kwargs and n in known]
        words = f"{' and '.join(missing)} must be given" if missing else str(error)
        raise InputError(f"`{place}`: {words}: write {place}({', '.join(known)})") from None


def takes(**checks: Check | None) -> Callable[[Gated], Gated]:
    """A public function (or dataclass) whose arguments are checked before anything runs: each by its entry
    here (`None`: the function itself looks at it), else by its type hint. `None` passes where it is the
    default."""

    def gate(function: Any) -> Any:
        if isinstance(function, type):
            function.__init__ = gate(function.__init__)
            return function
        place = function.__qualname__.removesuffix(".__init__")
        signature = inspect.signature(function)

        @functools.cache
        def by_name() -> dict[str, Check]:
            hints = typing.get_type_hints(function)
            found = {name: by_hint(hints.get(name)) for name in signature.parameters}
            return {name: c for name, c in (found | checks).items() if c is not None}

        @functools.wraps(function)
        def gated(*args: Any, **kwargs: Any) -> Any:
            given = bound(place, signature, args, kwargs)
            known = by_name()
            for name, value in given.arguments.items():
                kind = signature.parameters[name].kind
                if name not in known or kind in (kind.VAR_KEYWORD, kind.VAR_POSITIONAL):
                    continue
                if value is None and signature.parameters[name].default is None:
                    continue
                given.arguments[name] = known[name](value, name)
            return function(*given.args, **given.kwargs)

        return gated

    return gate
