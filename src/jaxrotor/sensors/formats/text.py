"""Tables of numbers in text files, as measuring programs write them: what is not plain is found out and told,
what does not fit is refused with its line."""

import csv
import re
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core.errors import InputError
from ...core.units import known_unit
from .spelling import told_unit
from .table import Column, Table

# In this order: where two would do, what a decimal comma or a name cannot hold comes first.
_SEPARATORS = {"\t": "tab", ";": "';'", "|": "'|'", ",": "','", " ": "spaces"}
_COUNTS = {1: "one column", 2: "two columns"}
_NUMBER = re.compile(
    r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)|", re.IGNORECASE
)
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


class HowWritten(NamedTuple):
    """`separator`: one character, `" "` for any run of spaces. `decimal`: `"."` or `","`. `skip`: lines
    before the names of the columns. `encoding`: as Python names it. `None`: to be found out."""

    separator: str | None = None
    decimal: str | None = None
    skip: int | None = None
    encoding: str | None = None


def read_text_table(
    file: Path, how: HowWritten, wanted: frozenset[str], least: int = 2, recorded: bool = True
) -> Table:
    """Columns of texts, numbers with a decimal point. `wanted`: names that are looked for in the line of
    names; `least`: how many columns there must be; `recorded`: a last line without an end was cut off.
    Raises `InputError` with the line for rows of another length, for names that stand twice, and for files
    without such a table."""
    text, notes = _decoded(file, how.encoding)
    lines = text.splitlines()
    numbered = [
        (k, line)
        for k, line in enumerate(lines, 1)
        if k > (how.skip or 0) and line.strip() and not line.lstrip().startswith("#")
    ]
    separator, rows = _split(file, numbered, how.separator, least)
    if how.separator is None and separator != "," and len(rows[0][1]) > 1:
        notes.append(f"columns are parted by {_SEPARATORS[separator]}")
    decimal = how.decimal or _decimal(rows, separator)
    if decimal == ",":
        if how.decimal is None:
            notes.append("numbers have a decimal comma")
        rows = [(k, [_pointed(x) for x in row]) for k, row in rows]
    names, units, first, before = _header(
        file, lines, rows, separator, wanted, how.skip is not None
    )
    if how.skip is None and before:
        notes.append(f"{before} line{'s' * (before > 1)} before the names of the columns left out")
    body = rows[first:]
    if names and not names[-1] and all(len(row) == len(names) and not row[-1] for _, row in body):
        names, body = names[:-1], [(k, row[:-1]) for k, row in body]
    for name, count in Counter(names).items():
        if count > 1:
            raise InputError(f"`{file}`: {count} columns are named `{name}`: rename all but one")
    for k, row in body:
        if len(row) != len(names):
            raise InputError(
                f"`{file}`: cannot be read: line {k} has {len(row)} entries where the names are "
                f"{len(names)} ({', '.join(names)}): correct it (a missing value is left empty between its "
                "separators)"
            )
    if recorded and body and body[-1][0] == len(lines) and not text.endswith(("\n", "\r")):
        body = body[:-1]
        notes.append("the last line has no end, so its last number may be cut off: left out")
    units = dict(zip(names, units))
    lines_of = [k for k, _ in body]

    def column(i: int) -> Column:
        return Column(lambda: [row[i] for _, row in body], units.get(names[i], ""), None, lines_of)

    return Table({name: column(i) for i, name in enumerate(names)}, tuple(notes))


def as_numbers(texts: list[str]) -> np.ndarray | int:
    """The numbers, or the place of the first text that is none."""
    for k, text in enumerate(texts):
        if not _NUMBER.fullmatch(text):
            return k
    return np.array([text or "nan" for text in texts]).astype(float)


def _decoded(file: Path, encoding: str | None) -> tuple[str, list[str]]:
    data = file.read_bytes()
    found = encoding
    if encoding is None:
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            found = "utf-16"
        elif b"\0" in data[:200]:  # every second byte of Latin text
            found = "utf-16-be" if data[:1] == b"\0" else "utf-16-le"
        else:
            found = "utf-8-sig"
            try:
                data.decode(found)
            except UnicodeDecodeError:
                found = "cp1252"
    try:
        text = data.decode(str(found))
    except LookupError:
        raise InputError(
            f"`{file}`: encoding {encoding!r} is not known: such as utf-8, utf-16 or latin-1"
        ) from None
    except UnicodeDecodeError as error:
        raise InputError(
            f"`{file}`: is not written in {found} (byte {error.start + 1}): give its encoding"
        ) from None
    plain = encoding is not None or found == "utf-8-sig"
    return text, [] if plain else [f"read as {found}"]


def _split(
    file: Path, lines: list[tuple[int, str]], separator: str | None, least: int
) -> tuple[str, list[tuple[int, list[str]]]]:
    """Which separator gives most lines one number of entries, two at least; and the entries."""
    texts = [line for _, line in lines]
    best, found, chosen = (False, 0), [], separator or ","
    for candidate in (separator,) if separator else _SEPARATORS:
        rows = _entries(texts, str(candidate))
        if len(rows) != len(texts):
            raise InputError(f"`{file}`: cannot be read: a quotation mark is left open")
        # a preamble is of any length: most of a file are its numbers
        widths = Counter(map(len, rows[len(rows) // 2 :]))
        width, count = widths.most_common(1)[0] if widths else (0, 0)
        if width >= least and (width > 1, count) > best:
            best, found, chosen = (width > 1, count), rows, str(candidate)
    if found:
        return chosen, [(k, row) for (k, _), row in zip(lines, found)]
    words = f"parted by {separator!r}" if separator else "parted by tabs, ';', '|', ',' or spaces"
    raise InputError(
        f"`{file}`: cannot be read: holds no table of {_COUNTS[least]} or more, {words}: give its separator "
        "(and skip, the lines before the names of its columns)"
    )


def _entries(lines: list[str], separator: str) -> list[list[str]]:
    if separator == " ":
        return [line.split() for line in lines]
    return [[x.strip() for x in row] for row in csv.reader(lines, delimiter=separator)]


def _decimal(rows: list[tuple[int, list[str]]], separator: str) -> str:
    if separator == ",":
        return "."
    entries = [x for _, row in rows[len(rows) // 2 :] for x in row]
    return (
        "," if any(map(_COMMA.fullmatch, entries)) and not any("." in x for x in entries) else "."
    )


def _pointed(text: str) -> str:
    return text.replace(",", ".") if _COMMA.fullmatch(text) else text


def _is_number(text: str) -> bool:
    return bool(text) and _NUMBER.fullmatch(text) is not None


def _header(
    file: Path,
    lines: list[str],
    rows: list[tuple[int, list[str]]],
    separator: str,
    wanted: frozenset[str],
    first: bool,
) -> tuple[list[str], list[str], int, int]:
    """Names and units of the columns, where in `rows` the values begin, and how many lines stand before the
    names. `first`: the names are in the first row."""
    width = Counter(len(row) for _, row in rows[len(rows) // 2 :]).most_common(1)[0][0]
    full = (i for i, (_, row) in enumerate(rows) if len(row) == width and any(map(_is_number, row)))
    above = rows[: 1 if first else next((i for i in full if _numeric(rows[i][1])), len(rows))]
    # names are no numbers: what has one among them is a row of values that cannot be read
    named = [i for i, (_, row) in enumerate(above) if not any(map(_is_number, row))]
    named = [i for i in named if first or len(rows[i][1]) == width]
    if not named:  # a line of names that is commented out
        place = rows[0][0] - 2
        names = lines[place].strip().lstrip("#").strip() if place >= 0 else ""
        found = _entries([names], separator)[0] if names else []
        if len(found) == width:
            return found, [], 0, place
        raise InputError(
            f"`{file}`: line {rows[0][0]} holds numbers where the names of the columns are looked for: "
            "write them above, parted as the numbers are"
        )
    last = named[-1]
    if last - 1 in named and _units(rows[last][1]):
        last -= 1
    at = next((i for i in named if wanted & set(rows[i][1])), last)
    units = _units(rows[at + 1][1]) if at + 1 < len(rows) and at + 1 in named else []
    return rows[at][1], units, at + 1 + bool(units), rows[at][0] - 1


def _numeric(row: list[str]) -> bool:
    return all(map(_NUMBER.fullmatch, row))


def _units(row: list[str]) -> list[str]:
    """Those of a line of units, or nothing where one of its entries is none."""
    bare = ["1" if x == "-" else x.strip("[]()") for x in row]
    return bare if all(known_unit(x) or told_unit(x)[0] for x in bare) else []
