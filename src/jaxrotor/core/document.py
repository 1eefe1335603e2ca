"""From a file to nested tables, with the file's own faults named."""

import re
import tomllib
from pathlib import Path
from typing import Any

from .errors import InputError


def read_document(path: Path, wanted: str) -> dict[str, Any]:
    """The tables of a TOML file; `InputError` where it cannot be read as one. `wanted`: what to put into an
    empty one."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        near = sorted(p.name for p in path.parent.glob("*.toml")) if path.parent.is_dir() else []
        there = f"; in that folder are {', '.join(near[:8])}" if near else ""
        raise InputError(f"`{path}`: there is no such file: check the path{there}") from None
    except IsADirectoryError:
        raise InputError(f"`{path}`: is a folder: name a .toml file in it") from None
    except OSError as error:
        raise InputError(f"`{path}`: cannot be read ({error.strerror}): check the file") from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise InputError(
            f"`{path}`: line {line} is not UTF-8 text (byte 0x{data[error.start]:02x}): save the "
            "file as UTF-8"
        ) from None
    if not text.strip():
        raise InputError(f"`{path}`: is empty: give it {wanted}")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"`{path}`: {_syntax(str(error), text)}") from None
    except ValueError:  # Python reads no integer of more than 4300 digits
        raise InputError(f"`{path}`: holds an integer of thousands of digits: shorten it") from None
    except RecursionError:
        raise InputError(f"`{path}`: is nested too deeply: flatten its tables") from None


def _syntax(message: str, text: str) -> str:
    lines = text.splitlines()
    match = re.fullmatch(r"(.*) \(at line (\d+), column (\d+)\)", message, re.DOTALL)
    if match is None:  # at the end of the document
        reason = re.sub(r" \(at .*\)", "", message)
        return f"is no valid TOML at its end, line {len(lines)}: {reason}: close what is open there"
    row = int(match[2])
    line = lines[row - 1].strip() if row <= len(lines) else ""
    return (
        f"is no valid TOML at line {row}, column {match[3]}, `{line[:70]}`: {match[1]}: "
        f"{_remedy(match[1], line)}"
    )


def _remedy(reason: str, line: str) -> str:
    if re.search(r"=\s*[+-]?[\d.]+\s*[A-Za-z/]", line):
        return 'write a quantity in quotes, such as length = "60 mm"'
    if "overwrite" in reason or "twice" in reason:
        return "each name may stand once: rename one or remove it"
    return "correct that line"
