"""A record file for a file of measured data, with what is known and what was guessed."""

import os
import re
from collections import Counter
from pathlib import Path

import tomli_w

from .described import UNKNOWN
from .formats.spelling import group_and_name
from .survey import Signal, Survey

_UNKNOWN_RATE = {"rate": f"{UNKNOWN} Hz"}


def draft(found: Survey, target: Path) -> str:
    """The text of a record file at `target` that describes all signals of a survey; what nobody knows is
    "?", which `read_record` refuses in words."""
    file = found.file
    try:
        place = Path(os.path.relpath(file.resolve(), target.resolve().parent)).as_posix()
    except ValueError:  # another drive
        place = file.resolve().as_posix()
    shared = _clock(found.signals[0])
    lines = [
        f"# Written by `jaxrotor record {file.name} --init`. Look over what it guessed, write what",
        f'# is still "{UNKNOWN}", take out channels that are not needed, name the others like the sensors.',
        f'# Then jr.read_record("{target.name}") reads it, and `jaxrotor record {target.name}` shows it.',
        *(f"# {note}" for note in found.notes),
        "",
        _line("file", place),
        _line("time", shared, _said(shared, found)),
        *_doubts(found),
        '# offset = "0 s"            # added to the time',
        '# missing = [-9999, "n/a"]  # what stands for a missing value; empty and nan always do',
        *(f"# left out: `{name}` is {words}" for name, words in found.left_out.items()),
    ]
    names = _names(found.signals)
    for name, one in zip(names, found.signals):
        lines += ["", f"[channels.{_key(name)}]", _line("column", one.name)]
        if _clock(one) != shared:
            lines.append(_line("time", _clock(one), _said(_clock(one), found)))
        unknown = f'{one.why or "the file tells none"}: write it; "1" for a plain number'
        lines.append(_line("unit", one.unit or UNKNOWN, "" if one.unit else unknown))
    return "\n".join(lines) + "\n"


def unknowns(found: Survey) -> int:
    """How many "?" a draft has."""
    units = sum(not one.unit for one in found.signals)
    clocks = {str(_clock(one)) for one in found.signals}
    return units + (str(_UNKNOWN_RATE) in clocks)


def _clock(one: Signal) -> dict[str, str]:
    return _UNKNOWN_RATE if one.clock is None else one.clock


def _said(clock: dict[str, str], found: Survey) -> str:
    if clock == _UNKNOWN_RATE:
        return 'how it was sampled: "2048 Hz", or { step = "0.5 ms" }, or the column of instants'
    if not clock:
        return "as the file says"
    return "guessed" if found.guesses else ""


def _doubts(found: Survey) -> list[str]:
    """Rows that are out of order are sorted."""
    fall = any(one.t is not None and (one.t[1:] < one.t[:-1]).any() for one in found.signals)
    return ["sort = true  # the rows of the file are not in the order of time"] if fall else []


def _line(key: str, value: str | dict[str, str], comment: str = "") -> str:
    if isinstance(value, dict):
        inside = ", ".join(f"{k} = {_quoted(v)}" for k, v in value.items())
        text = f"{{ {inside} }}" if inside else "{}"
    else:
        text = _quoted(value)
    return f"{key} = {text}{f'  # {comment}' if comment else ''}"


def _quoted(text: str) -> str:
    """As TOML writes a text."""
    return tomli_w.dumps({"x": text}).partition("=")[2].strip()


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _quoted(name)


def _names(signals: list[Signal]) -> list[str]:
    """The last part of each path, the whole of it where that is not enough."""
    short = [group_and_name(one.name)[1] for one in signals]
    again = Counter(short)
    return [name if again[name] == 1 else one.name for name, one in zip(short, signals)]
