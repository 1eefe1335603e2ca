"""The gate of every public function and class: is each argument what it must be?

A *check* takes a value and the words that name it, and returns the value as it is used from there on (a
`np.float32` as a float, a `np.int64` as an int), or raises `InputError`. What `jit`, `vmap` or `grad` trace
passes where it is a number.
"""

import difflib
import functools
import inspect
import os
import reprlib
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from typing import Any, ParamSpec, TypeVar

import jax
import numpy as np
from jax.core import Tracer
from jaxtyping import AbstractArray

from .errors import InputError

P, R = ParamSpec("P"), TypeVar("R")
Check = Callable[[Any, str], Any]

# No list of so many points, cases or draws is meant: it would not fit into memory.
MANY = 10_000_000


def short(value: Any) -> str:
    """`value` as Python would write it, on one line, cut where it is long."""
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 200:
        return f"an integer of {int(value.bit_length() * 0.30103) + 1} digits"
    text = reprlib.Repr().repr(value) if isinstance(value, (list, tuple, dict)) else repr(value)
    text = " ".join(text.split())
    return text if len(text) <= 90 else text[:87] + "..."


def nearest(value: Any, known: Iterable[str]) -> str:
    """': did you mean ...?', or nothing."""
    close = difflib.get_close_matches(str(value), list(known), n=1, cutoff=0.5)
    return f": did you mean {close[0]!r}?" if close else ""


def is_number(value: Any) -> bool:
    """One real number: no truth value, no text, no date, no complex one."""
    if isinstance(value, (bool, str, bytes)) or value is None:
        return False
    if isinstance(value, (int, float)):
        return True
    shape, dtype = getattr(value, "shape", None), getattr(value, "dtype", None)
    if shape is None or dtype is None:
        return hasattr(value, "__float__")  # a Fraction, a Decimal
    return shape == () and getattr(dtype, "kind", "") in "iuf"


def number(
    unit: str = "",
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    most: float | None = None,
) -> Check:
    """One finite number in `unit`, within these bounds."""
    inside = f" in {unit}" if unit else ""
    words = {
        (0.0, None, None, None): "positive and finite",
        (None, 0.0, None, None): "zero or positive, and finite",
    }.get((above, least, below, most))
    if words is None:
        low = f"above {above:g}" if above is not None else ""
        low = f"{least:g} at least" if least is not None else low
        high = f"below {below:g}" if below is not None else ""
        high = f"{most:g} at most" if most is not None else high
        words = " and ".join(x for x in (low, high) if x) or "finite"

    def check(value: Any, place: str) -> Any:
        if isinstance(value, Tracer):
            if value.shape != ():
                raise InputError(f"{place} must be one number{inside}, but has shape {value.shape}")
            found = jax.lax.stop_gradient(value)
            if isinstance(found, Tracer):
                return value
        else:
            found = value
        if not is_number(found):
            raise InputError(f"{place} must be a number{inside}, but is {short(value)}")
        try:
            found = float(found)
        except (OverflowError, ValueError, TypeError):
            found = float("inf")
        good = (
            np.isfinite(found)
            and (above is None or found > above)
            and (least is None or found >= least)
            and (below is None or found < below)
            and (most is None or found <= most)
        )
        if not good:
            unit_too = f" {unit}" if unit else ""
            raise InputError(f"{place} must be {words}, but is {found:g}{unit_too}")
        if not isinstance(value, jax.Array):
            return found
        return value if value.dtype == np.float64 else value.astype(np.float64)

    return check


def positive(unit: str = "") -> Check:
    return number(unit, above=0.0)


def numbers(
    unit: str = "",
    *,
    least: float | None = None,
    above: float | None = None,
    fewest: int = 1,
    rising: bool = False,
) -> Check:
    """A row of finite numbers (n,), or one number alone; `rising`: each above the one before."""
    inside = f" in {unit}" if unit else ""
    words = f"a {'rising ' if rising else ''}list of {fewest} number{'s' * (fewest > 1)} at least"
    words = (words if fewest > 1 else f"a {'rising ' * rising}list of numbers") + inside

    def check(value: Any, place: str) -> Any:
        found = jax.lax.stop_gradient(value) if isinstance(value, Tracer) else value
        if isinstance(found, Tracer) or any(isinstance(x, Tracer) for x in jax.tree.leaves(found)):
            return value
        found = real_array(found)
        if found is None:
            raise InputError(f"{place} must be {words}, but is {short(value)}")
        if found.ndim > 1 or found.size < fewest:
            raise InputError(f"{place} must be {words}, but has shape {found.shape}")
        row = np.atleast_1d(found)
        bad = ~np.isfinite(row)
        if least is not None:
            bad |= ~(row >= least)
        if above is not None:
            bad |= ~(row > above)
        if bad.any():
            bound = f" and {least:g} at least" if least is not None else ""
            bound = f" and above {above:g}" if above is not None else bound
            raise InputError(f"{place} must be finite{bound}, but holds {row[bad][0]:g}")
        if rising and not np.all(np.diff(row) > 0):
            raise InputError(f"{place} must be {words}, but {short(value)} does not rise")
        return value if isinstance(value, jax.Array) else found

    return check


def matrix(value: Any, place: str) -> Any:
    """A full table of finite numbers (m, n)."""
    if isinstance(value, Tracer):
        return value
    found = real_array(value)
    if found is None or found.ndim != 2:
        given = short(value) if found is None else f"of shape {found.shape}"
        raise InputError(f"{place} must be a matrix of numbers, but is {given}")
    if not np.isfinite(found).all():
        raise InputError(f"{place} must be finite, but holds {found[~np.isfinite(found)][0]:g}")
    return value if isinstance(value, jax.Array) else found


def real_array(value: Any) -> np.ndarray | None:
    """float64, or `None` where there is anything but real numbers (a truth value, a text, a date)."""
    leaves = jax.tree.leaves(value) if isinstance(value, (list, tuple)) else [value]
    if isinstance(value, (str, bytes, dict)) or value is None:
        return None
    for leaf in leaves:
        if isinstance(leaf, (bool, str, bytes)):
            return None
        if not isinstance(leaf, (int, float)) and np.asarray(leaf).dtype.kind not in "iuf":
            if np.ndim(leaf) or not is_number(leaf):
                return None
    try:
        return np.asarray(value, float)
    except OverflowError:
        return np.asarray(np.inf)
    except (TypeError, ValueError):
        return None


def complex_number(value: Any, place: str) -> Any:
    """One finite number, real or complex."""
    if isinstance(value, Tracer):
        return value
    parts = (
        (value.real, value.imag) if isinstance(value, (complex, np.complexfloating)) else (value,)
    )
    if getattr(value, "dtype", None) == np.complex128 and np.shape(value) == ():
        parts = (float(value.real), float(value.imag))
    for part in parts:
        number()(part, place)
    return value


def whole(least: int = 0, most: int = MANY) -> Check:
    """A whole number from `least` to `most`."""

    def check(value: Any, place: str) -> int:
        words = f"a whole number from {least} to {most}"
        if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
            raise InputError(f"{place} must be {words}, but is {short(value)}")
        if not least <= value <= most:
            raise InputError(f"{place} must be {words}, but is {short(value)}")
        return int(value)

    return check


def choice(*options: Any) -> Check:
    """One of these (texts, or numbers)."""

    def check(value: Any, place: str) -> Any:
        if isinstance(value, (str, int)) and not isinstance(value, bool) and value in options:
            return value
        listed = " or ".join(map(repr, options))
        texts = [x for x in options if isinstance(x, str)]
        guess = nearest(value, texts) if isinstance(value, str) else ""
        raise InputError(f"{place} must be {listed}, but is {short(value)}{guess}")

    return check


def flag(value: Any, place: str) -> bool:
    """True or False, and nothing that merely counts as one."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise InputError(f"{place} must be True or False, but is {short(value)}")


def text(value: Any, place: str) -> str:
    if isinstance(value, str) and value.strip():
        return value
    raise InputError(f"{place} must be a text, but is {short(value)}")


def some_text(value: Any, place: str) -> str:
    """A text that may be empty."""
    if isinstance(value, str):
        return value
    raise InputError(f"{place} must be a text, but is {short(value)}")


def names(value: Any, place: str) -> Any:
    """One name, or several."""
    if isinstance(value, str) and value.strip():
        return value
    if isinstance(value, (list, tuple)) and value and all(isinstance(x, str) for x in value):
        return value
    raise InputError(f"{place} must be a name or a list of names, but is {short(value)}")


def mapping(value: Any, place: str) -> Any:
    """A dict whose keys are names."""
    if not isinstance(value, Mapping):
        raise InputError(f"{place} must be a dict, but is {short(value)}")
    for key in value:
        if not isinstance(key, str):
            raise InputError(f"{place} must be a dict of names, but one is {short(key)}: quote it")
    return value


def listed(value: Any, place: str) -> Any:
    """A list, a tuple or the like: no text, no dict, nothing that can be gone through but once."""
    if isinstance(value, (str, bytes, Mapping)) or not hasattr(value, "__len__"):
        raise InputError(f"{place} must be a list, but is {short(value)}")
    return value


def path(value: Any, place: str) -> Any:
    """Where a file lies."""
    if isinstance(value, os.PathLike) or (isinstance(value, str) and value.strip()):
        return value
    raise InputError(f"{place} must be the path of a file, but is {short(value)}")


_PLAIN: dict[Any, Check] = {bool: flag, int: whole(), float: number(), str: some_text}


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

    def check(value: Any, place: str) -> Any:
        if classes and isinstance(value, tuple(classes)):
            return value
        if plain:
            return plain[0](value, place)
        wanted = " or ".join(f"a {c.__name__}" for c in classes)
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
        known = [name for name in signature.parameters if name != "self"]
        for name in kwargs:
            if name not in known:
                guess = nearest(name, known) or f"; known: {', '.join(known) or 'none'}"
                raise InputError(f"`{place}`: there is no argument {name!r}{guess}") from None
        required = [n for n, p in signature.parameters.items() if p.default is p.empty]
        missing = [n for n in required[len(args) :] if n not in kwargs and n in known]
        words = f"{' and '.join(missing)} must be given" if missing else str(error)
        raise InputError(f"`{place}`: {words}: write {place}({', '.join(known)})") from None


def takes(**checks: Check | None) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A public function (or dataclass) whose arguments are checked before anything runs: each by its entry
    here (`None`: the function itself looks at it), else by its type hint. `None` passes where it is the
    default."""

    def gate(function: Callable[P, R]) -> Callable[P, R]:
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
        def gated(*args: P.args, **kwargs: P.kwargs) -> R:
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
