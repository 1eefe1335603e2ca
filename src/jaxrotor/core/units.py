"""Quantities with their units, as people write them: `"60 mm"`, `"3000 rpm"`, `"1 deg"`.

Units live at the edges of the program alone; inside everything is SI. The angle is a dimension of
its own here: a speed in Hz, which would be taken for rad/s and 6.28 times too slow, is refused.
"""

import difflib
import functools
import math
import re
from typing import Any

from .errors import InputError

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?![\d.,])\s*(.*?)\s*")
# Units as they are written, before their letters are looked at: "ft-lb" is a product, and a pound that
# turns is a force. What follows a power is a small plain number; towers of powers would take for ever.
_SPOKEN = {
    "ft-lb": "ft*lbf", "ft-lbf": "ft*lbf", "lb-ft": "lbf*ft", "lbf-ft": "lbf*ft", "in-lb": "inch*lbf",
    "in-lbf": "inch*lbf", "lb-in": "lbf*inch", "lbf-in": "lbf*inch", "oz-in": "ozf*inch", "N-m": "N*m",
    "lb/in": "lbf/inch", "lbf/in": "lbf/inch",
}  # fmt: skip
_POWER = re.compile(r"(\*\*|\^)\s*(\(?\s*[+-]?\d{1,2}(\.\d{1,4})?(\s*/\s*\d{1,2})?\s*\)?)?")
_LONGEST = 80
# Levels, not numbers of anything: their values do not add.
_LEVELS = ("dB", "dBm", "dBu", "Np", "neper", "decibel", "bel", "B")
# Scales of temperature that begin elsewhere: their degree in K, and what is to be added first.
_FROM_ZERO = {
    **dict.fromkeys(("degC", "°C", "celsius"), (1.0, 273.15)),
    **dict.fromkeys(("degF", "°F", "fahrenheit"), (5 / 9, 459.67)),
}
_SIGNS = str.maketrans({"·": "*", "⋅": "*", "×": "*", "−": "-", "μ": "µ"})

# Candidates for "did you mean": what the units of machines are usually written in.
_COMMON = (
    "m mm cm um in s ms min h kg g t N kN N*m N*mm kN*m Pa kPa MPa GPa Hz kHz rad mrad deg rpm "
    "rad/s deg/s 1/s N/m N/mm kN/m N*s/m N*m/rad N*m*s/rad m/s m/s^2 kg*m^2 kg/m^3 W kW J V A ohm"
).split()


@functools.cache
def _registry():
    import pint

    registry = pint.UnitRegistry(on_redefinition="ignore")
    registry.define("radian = [angle] = rad")
    registry.define("revolution_short = turn = rev")
    registry.define("thou = 2.54e-5 * meter")
    registry.define("lbm = pound")
    registry.define("cpm = 1 / minute")
    registry.define("cps = 1 / second")
    return registry


@functools.cache
def _base(unit: str) -> tuple[float, dict[str, float]]:
    """SI value of `unit` and its dimensions; `ValueError` where there is no such unit."""
    registry: Any = _registry()
    text = unit.translate(_SIGNS).strip()
    if text in ("", "1"):
        return 1.0, {}
    if not _sound(text):
        raise ValueError(unit)
    text = _SPOKEN.get(text, text)
    text = re.sub(r"\bmils?\b", "thou", text)  # pint's own mil is an angle, a machinist's a length
    if text.startswith("/"):  # "0.002/s"
        text = "1" + text
    try:
        size, base = registry.get_base_units(registry.parse_units(text))
    except Exception:  # pint raises a dozen kinds, its tokenizer's among them
        raise ValueError(unit) from None
    dimensions: Any = base._units
    return float(size), {str(name): float(power) for name, power in dimensions.items()}


def _sound(text: str) -> bool:
    """Whether a unit is short, its powers are small numbers, and it is no level in decibels."""
    if len(text) > _LONGEST or any(word in _LEVELS for word in re.findall(r"[A-Za-z]+", text)):
        return False
    for power in _POWER.finditer(text):
        rest = text[power.end() :].lstrip()
        if power[2] is None or rest.startswith(("**", "^")) or rest[:1].isdigit():
            return False
    # a power of what holds a power already
    return not re.search(r"(\*\*|\^)[^()]*\)\s*(\*\*|\^)", text) and text.count("(") <= 4


def known_unit(unit: str) -> bool:
    """Whether `unit` is a unit at all."""
    try:
        _base(unit)
    except ValueError:
        return False
    return True


def factor(given: str, unit: str) -> float | None:
    """How many `unit` one `given` is; `None` where they measure different things.

    An angle below the line may be left out (`N*m` for `N*m/rad`), one above it may not.
    """
    if given.strip() in _FROM_ZERO and given.strip() != unit:
        return None  # its zero is elsewhere
    a, have = _base(given)
    b, want = _base(unit)
    if "radian" not in have and want.get("radian", 0.0) < 0:
        want = {k: v for k, v in want.items() if k != "radian"}
    return a / b if have == want else None


def read(value: Any, unit: str) -> float:
    """The number of `unit` in `value`; a `ValueError` holds the predicate of a sentence.

    With a `unit`, `value` is a text such as `"60 mm"`; without one it is a bare number.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(f"must be {_wanted(unit)} but is {shown(value)}: {_write(1.0, unit)}")
    if not isinstance(value, str):
        _finite(value, shown(value), unit)
        if unit:
            raise ValueError(
                f"must carry a unit, but is the bare number {value!r}: {_write(value, unit)}"
            )
        return float(value)
    if len(value) > _LONGEST + 40:
        raise ValueError(f"must be {_wanted(unit)} but is {shown(value)}: {_write(1.0, unit)}")
    match = _NUMBER.fullmatch(value.strip())
    if match is None:
        if re.match(r"\s*[+-]?(nan|inf)", value, re.IGNORECASE):
            raise ValueError(f"must be finite, but is {shown(value)}: {_write(1.0, unit)}")
        if re.match(r"\s*[+-]?\d+,\d", value):
            raise ValueError(
                f"must be {_wanted(unit)} but is {shown(value)}: write the decimal point as '.'"
            )
        raise ValueError(f"must be {_wanted(unit)} but is {shown(value)}: {_write(1.0, unit)}")
    number, written = float(match[1]), match[2]
    _finite(number, shown(value), unit)
    if not written and unit:
        raise ValueError(f"must carry a unit, but is {shown(value)}: {_write(number, unit)}")
    if any(word in _LEVELS for word in re.findall(r"[A-Za-z]+", written)):
        raise ValueError(
            f"must be {_wanted(unit)} but is {shown(value)}, a level: give the ratio itself, which of "
            f"{number:g} dB is {10 ** min(number / 20, 300):.4g}"
        )
    if not known_unit(written):
        close = _nearest(written, unit)
        guess = f'did you mean "{match[1]} {close}"?' if close else _write(1.0, unit)
        raise ValueError(f'has the unknown unit "{written}", in {shown(value)}: {guess}')
    if unit == "K" and written.strip() in _FROM_ZERO:
        scale, zero = _FROM_ZERO[written.strip()]
        return (number + zero) * scale
    scale = factor(written, unit)
    if scale is None:
        raise ValueError(_mismatch(number, written, value, unit))
    return number * scale


def quantity(value: Any, unit: str) -> float:
    """`quantity("60 mm", "m")` is 0.06. `InputError` says what is wrong, and the remedy."""
    try:
        return read(value, unit)
    except ValueError as error:
        raise InputError(f"a quantity{f' in {unit}' if unit else ''} {error}") from None


def shown(value: Any) -> str:
    """A value as it would stand in a study file, shortened."""
    if isinstance(value, int) and value.bit_length() > 200:
        return f"an integer of {int(value.bit_length() * 0.30103) + 1} digits"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"' if len(value) <= 60 else f'"{value[:57]}..."'
    if isinstance(value, dict):
        return "a table" + (f" with {', '.join(list(value)[:4])}" if value else "")
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return f"{value}"


def example(unit: str, number: float = 1.0) -> str:
    """What to write: `"0.06 m"` in quotes, or a bare number."""
    return f'"{number:.6g} {unit}"' if unit else f"{number:.6g}"


def _finite(number: float, text: str, unit: str) -> None:
    if isinstance(number, int) and number.bit_length() > 1023 or not math.isfinite(number):
        raise ValueError(f"must be finite, but is {text}: {_write(1.0, unit)}")


def _wanted(unit: str) -> str:
    return f"a number with its unit, {unit} or the like," if unit else "a number,"


def _write(number: float, unit: str) -> str:
    # a bare speed is as often meant in rpm
    other = f" or {example('rpm', number)}" if unit == "rad/s" else ""
    return f"write {example(unit, number)}{other}"


def _nearest(written: str, wanted: str) -> str | None:
    fitting = [unit for unit in _COMMON if factor(unit, wanted) is not None]
    for unit in fitting:  # GPA, khz: the letters are right and their size is not
        if unit.lower() == written.lower():
            return unit
    close = difflib.get_close_matches(written, fitting, n=1, cutoff=0.5)
    return close[0] if close else None


def _mismatch(number: float, written: str, value: str, unit: str) -> str:
    if not unit:
        return f"must be a number without a unit, but is {shown(value)}: {_write(number, '')}"
    remedy = _write(1.0, unit)
    if unit == "rad/s" and (turns := factor(written, "1/s")) is not None:
        hertz = number * turns
        remedy = f'write a speed of {hertz:g} turns a second as "{60 * hertz:g} rpm"'
    elif unit == "Hz" and (angular := factor(written, "rad/s")) is not None:
        remedy = f'write a frequency as "{number * angular / (2 * math.pi):.6g} Hz"'
    elif written == "Nm":
        remedy = f'write "{number:g} N*m" (pint reads Nm as something else)'
    return f"must be in {unit}, but {shown(value)} is in {written}, another quantity: {remedy}"
