"""Units as measuring programs spell them."""

import re

from ...core.units import known_unit

# Known as units, and meant otherwise: gram and gauss, or the pull of the Earth; an "engineering unit".
_AMBIGUOUS = {
    "g": '"g_0" (9.80665 m/s^2) or "gram"',
    "G": '"g_0" (9.80665 m/s^2) or "gauss"',
    "EU": "a unit of your own: what it stands for",
}
_NONE = ("", "none", "-", "n/a", "null", "unknown")
_WORDS = {"volts": "V", "amps": "A", "sec": "s", "seconds": "s", "units": ""}
_ENDING = re.compile(r"[\[(]([^\[\]()]+)[\])]\s*$")


def told_unit(text: str) -> tuple[str, str]:
    """The unit that a file tells, as this program writes it, or "" and the words that say why not."""
    unit = text.strip().strip("[]").strip()
    if unit.lower() in _NONE:
        return "", ""
    if unit in _AMBIGUOUS:
        return "", f"the file says {unit}, which may be {_AMBIGUOUS[unit]}"
    powers = re.sub(r"(?<=[A-Za-z])([23])\b", r"^\1", unit)  # m/s2
    for spelled in (unit, powers, _WORDS.get(unit.lower(), unit)):
        if known_unit(spelled):
            return spelled, ""
    return "", f"the file says {unit!r}, which is no unit here"


def unit_in(name: str) -> str:
    """The unit at the end of a column's name, `a [m/s^2]`, in its own words, or ""; `a[2]` is a column of a
    matrix."""
    found = _ENDING.search(name)
    return "" if found is None or found[1].strip().isdigit() else found[1].strip()


def group_and_name(path: str) -> tuple[str, str]:
    """`rig/a [m/s^2]`: `rig`, `a`."""
    bare = _ENDING.sub("", path).strip() if unit_in(path) else path
    group, _, name = bare.rpartition("/")
    return group, name or path
