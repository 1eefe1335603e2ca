"""Numbers and parts as an engineer writes them: `60 mm`, `3000 rpm`, `Rotor(mass=6.08 kg, ...)`.

For eyes alone: six digits, units with prefixes that suit the size. What is not known shows its shape in
place of numbers: what `jit` and `vmap` trace, batches, `ShapeDtypeStruct`s.
"""

import dataclasses
import itertools
from typing import Any

import equinox as eqx
import numpy as np
from jax import Array, ShapeDtypeStruct

from .arguments import short
from .declared import ALONE, Within, is_default
from .parameter import known

# Of units that take no plain prefix: (from this size on, factor, unit).
_CHOSEN = {
    "m": ((1.0, 1.0, "m"), (1e-4, 1e3, "mm"), (0.0, 1e6, "um")),
    "rad": ((0.0, 180 / np.pi, "deg"),),
    "rad/s": ((0.0, 30 / np.pi, "rpm"),),
    "rad/s as Hz": ((0.0, 0.5 / np.pi, "Hz"),),
    "s": ((0.1, 1.0, "s"), (1e-4, 1e3, "ms"), (0.0, 1e6, "us")),
    "H": ((1.0, 1.0, "H"), (0.0, 1e3, "mH")),
}
_PREFIXES = ((1e9, 1e-9, "G"), (1e6, 1e-6, "M"), (1e3, 1e-3, "k"))
_PREFIXED = ("N", "Pa", "W", "V", "J", "Hz")
# Numbers of a list that are written out.
_FEW = 6


def amount(value: Any, unit: str = "", digits: int = 6) -> str:
    """Numbers of any shape with their unit, or what is known of them."""
    if value is None:
        return "None"
    found = known_numbers(value)
    if found is None:
        return _with(_shape(value), unit)
    if found.dtype.kind in "SU" or (found.dtype.kind == "b" and found.ndim):
        return _counted(found)
    factor, unit = _scale(found, unit)
    scaled = found if factor == 1.0 else found * factor
    if scaled.size <= _FEW:
        return _with(_written(scaled, digits), unit)
    return _span(scaled, unit, digits)


def each(values: Any, units: tuple[str, ...]) -> str:
    """A short list whose entries have units of their own, those of one unit together; `amount` where there is
    one unit."""
    found = known_numbers(values)
    if len(units) == 1 or found is None or found.shape != (len(units),):
        return amount(values, units[0] if len(units) == 1 else "")
    runs = itertools.groupby(range(len(units)), lambda i: units[i])
    rows = [found[list(run)] for _, run in runs]
    names = [unit for unit, _ in itertools.groupby(units)]
    alone = all(row.size == 1 for row in rows)
    texts = [amount(row[0] if alone else row, unit) for row, unit in zip(rows, names)]
    return f"[{', '.join(texts)}]" if alone else f"({', '.join(texts)})"


def one_line(part: Any, within: Within = ALONE) -> str:
    """A part with what was given it: names, numbers with units, parts inside. What is as by default is
    left out."""
    name = getattr(part, "shown_as", type(part).__name__)
    return f"{name}({', '.join(settings(part, within))})"


def settings(part: Any, within: Within = ALONE) -> list[str]:
    """What stands between the brackets of `one_line`."""
    found = []
    for field in dataclasses.fields(part):
        value = getattr(part, field.name, dataclasses.MISSING)  # none yet while it is being made
        if not field.repr or value is dataclasses.MISSING or _as_by_default(field, value):
            continue
        found.append(f"{field.name}={_value(field, value, within)}")
    return found


def _as_by_default(field: dataclasses.Field, value: Any) -> bool:
    try:
        return is_default(field, value)
    except Exception:  # a default that cannot be made here, numbers that were deleted: shown, then
        return False


def parameter_text(field: dataclasses.Field, value: Any, within: Within = ALONE) -> str:
    """A parameter's value; the shape of a batch of them."""
    if not _is_numbers(value):
        return short(value)
    if not _fits(np.shape(value), field.metadata["shapes"]):
        return _with(_shape(value), within.units(field)[0])
    return each(value, within.units(field))


def _value(field: dataclasses.Field, value: Any, within: Within) -> str:
    if "unit" in field.metadata and not isinstance(value, eqx.Module):
        return parameter_text(field, value, within)
    below = within.below(field)
    if isinstance(value, eqx.Module):
        return _nested(value, below)
    if isinstance(value, tuple) and any(isinstance(one, eqx.Module) for one in value):
        return (
            "("
            + ", ".join(_nested(one, below) for one in value)
            + ("," if len(value) == 1 else "")
            + ")"
        )
    if _is_numbers(value):
        return amount(value)
    if isinstance(value, float) and "quantity" in field.metadata:
        return amount(value, field.metadata["quantity"])
    if callable(value) and hasattr(value, "__name__"):
        return value.__name__
    return short(value)


def _nested(part: Any, within: Within) -> str:
    if not isinstance(part, eqx.Module):
        return short(part)
    own = dataclasses.fields(part)  # pyright: ignore[reportArgumentType]
    if (
        within.driven and len(own) == 1 and "unit" in own[0].metadata
    ):  # a steady schedule is its level
        return _value(own[0], getattr(part, own[0].name, None), within)
    return one_line(part, within)


def _is_numbers(value: Any) -> bool:
    return isinstance(value, (Array, np.ndarray, np.generic, ShapeDtypeStruct))


def _fits(shape: tuple[int, ...], allowed: Any) -> bool:
    return any(
        len(shape) == len(ok) and all(o is None or o == s for o, s in zip(ok, shape))
        for ok in allowed
    )


def known_numbers(value: Any) -> np.ndarray | None:
    """`None` where they are not known: traced, only a shape, deleted (donated to a computation), absent."""
    if value is None or isinstance(value, ShapeDtypeStruct):
        return None
    try:
        found = known(value)
    except Exception:
        return None
    return None if found is None or found.dtype.kind == "O" else found


def _shape(value: Any) -> str:
    kind = str(getattr(value, "dtype", "?")).replace("float", "f").replace("complex", "c")
    return f"{kind.replace('int', 'i')}[{','.join(map(str, np.shape(value)))}]"


def _with(text: str, unit: str) -> str:
    return f"{text} {unit}" if unit else text


def _written(found: np.ndarray, digits: int) -> str:
    if found.ndim:
        return "[" + ", ".join(_written(one, digits) for one in found) + "]"
    if found.dtype.kind == "c":
        return f"{complex(found):.{digits}g}"
    return f"{found.item():.{digits}g}" if found.dtype.kind == "f" else str(found.item())


def _span(found: np.ndarray, unit: str, digits: int) -> str:
    """How many, from where to where."""
    words = f"{' x '.join(map(str, found.shape))} values"
    good = found[np.isfinite(found)]
    if found.dtype.kind == "c":
        words += _with(f" up to {np.abs(good).max(initial=0.0):.{digits}g}", unit)
    elif good.size:
        low, high = (_written(x, digits) for x in (good.min(), good.max()))
        words += _with(f" of {low}" if low == high else f" from {low} to {high}", unit)
    missing = found.size - good.size
    return f"{words}, {missing} of them not finite" if missing else words


def _counted(found: np.ndarray) -> str:
    if found.dtype.kind == "b":
        return f"{' x '.join(map(str, found.shape))} values, {int(found.sum())} true"
    return f"{found.size} texts" if found.size > _FEW else short(found.tolist())


def _scale(found: np.ndarray, unit: str) -> tuple[float, str]:
    """By what to multiply SI numbers, and the unit that they are in then: that of the largest."""
    if found.dtype.kind not in "fc":
        return 1.0, unit
    size = float(np.abs(found[np.isfinite(found)]).max(initial=0.0))
    if unit in _CHOSEN:
        chosen = _CHOSEN[unit]
        least, factor, shown = chosen[0] if size == 0 else next(c for c in chosen if size >= c[0])
        return factor, shown
    first = "".join(itertools.takewhile(str.isalpha, unit))
    if first in _PREFIXED and "^" not in unit[: len(first) + 1]:
        for least, factor, prefix in _PREFIXES:
            if size >= least:
                return factor, prefix + unit
    return 1.0, unit
