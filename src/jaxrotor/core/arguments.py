"""What an argument may be: counts, times, choices, names. `gate` asks this of every public call.

A *check* takes a value and the words that name it, and returns the value as it is used from there on (a
`np.float32` as a float, a `np.int64` as an int), or raises `InputError`. What `jit`, `vmap` or `grad` trace
passes where it is a number.
"""

import difflib
import os
import reprlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import jax
import numpy as np
from jax.core import Tracer

from .errors import InputError

Check = Callable[[Any, str], Any]

# No list of so many points, cases or draws is meant: it would not fit into memory.
MANY = 10_000_000
# Of what costs nothing, such as a seed.
LARGEST = 2**62


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
            one = "one" if isinstance(found, (list, tuple, np.ndarray)) else "a"
            raise InputError(f"{place} must be {one} number{inside}, but is {short(value)}")
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
    size: int | None = None,
    rising: bool = False,
) -> Check:
    """A row of finite numbers (n,), or one number alone. `fewest`, or `size`: how many. `rising`: each above
    the one before."""
    inside = f" in {unit}" if unit else ""
    order = "rising " * rising
    words = (
        f"a {order}list of {fewest} numbers at least" if fewest > 1 else f"a {order}list of numbers"
    )
    words = (words if size is None else f"{size} {order}numbers") + inside

    def check(value: Any, place: str) -> Any:
        found = jax.lax.stop_gradient(value) if isinstance(value, Tracer) else value
        if isinstance(found, Tracer) or any(isinstance(x, Tracer) for x in jax.tree.leaves(found)):
            return value
        found = real_array(found)
        if found is None:
            raise InputError(f"{place} must be {words}, but is {short(value)}")
        if found.ndim > 1 or found.size < fewest or size not in (None, found.size):
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
        if isinstance(
            value, (list, tuple)
        ):  # plain numbers: options must hash, and have a truth value
            return tuple(found.tolist())
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


def complex_array(value: Any, place: str, ndim: int = 1) -> np.ndarray:
    """Finite complex numbers, (n,) or (m, n)."""
    try:
        found = np.asarray(value, complex) if not isinstance(value, str) else None
    except (TypeError, ValueError, OverflowError):
        found = None
    if found is None or np.asarray(value).dtype.kind not in "iufc":
        raise InputError(f"{place} must be complex numbers, but is {short(value)}")
    found = (np.atleast_1d, np.atleast_2d)[ndim - 1](found)
    if found.ndim != ndim or not found.size:
        raise InputError(
            f"{place} must be a {('row', 'matrix')[ndim - 1]}, but has shape {found.shape}"
        )
    if not np.isfinite(found).all():
        raise InputError(f"{place} must be finite, but holds {found[~np.isfinite(found)][0]:g}")
    return found


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
        number = isinstance(value, (int, np.integer)) and not isinstance(value, (bool, np.bool_))
        words = f"a whole number from {least} to {most}"
        if most >= MANY:
            high = number and value > most
            words = f"a whole number, {f'{most} at most' if high else f'{least} at least'}"
        if not number or not least <= value <= most:
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
        raise InputError(f"{place} must be a mapping, but is {short(value)}")
    for key in value:
        if not isinstance(key, str):
            raise InputError(
                f"{place} must be a mapping of names, but one is {short(key)}: quote it"
            )
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
