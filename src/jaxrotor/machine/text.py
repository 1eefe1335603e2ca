"""A machine as text: its line-up from left to right, with values and units; no more than a screen."""

import dataclasses
import re
import textwrap
from collections.abc import Iterator
from typing import Any, NamedTuple

import equinox as eqx
import numpy as np

from ..core.arguments import short
from ..core.declared import ALONE, Within, same
from ..core.kinematics import COORDINATES
from ..core.protocol import AbstractConnector, AbstractPrescribed
from ..core.readable import one_line, parameter_text, settings
from .built import Built
from .wiring import FIXED

WIDTH, HEIGHT = 100, 40
# Names longer than this do not push the values of all others to the right.
_NAME = 24
# A number stays with its unit, a short list on its line.
_UNBROKEN, _TIED = re.compile(r"\[[^\[\]]{0,24}\]( \S+)?|(?<=[^,]) \S+"), "\N{NO-BREAK SPACE}"


class _Row(NamedTuple):
    """`place`: where an element is connected, if that is not plain from the order of the rows."""

    name: str
    kind: str
    values: tuple[str, ...]
    place: str = ""


def machine_text(machine: Built) -> str:
    """Whatever the leaves are; where the machine has been taken apart (a filtered tree), what is left."""
    wiring = getattr(machine, "wiring", None)
    parts = (getattr(machine, "stations", None), getattr(machine, "connectors", None))
    if wiring is None or not all(isinstance(p, (tuple, list)) for p in parts):
        return textwrap.shorten(one_line(machine), WIDTH * HEIGHT // 8, placeholder=" ...")
    return "\n".join(_cut(machine))


def _cut(machine: Built) -> list[str]:
    """The lines, values folded where there is room, else cut; the middle of a long list left out."""
    heads, groups = _heading(machine), _groups(machine)
    size = min(_NAME, max(len(row.name) for _, rows in groups for row in rows))
    kinds = max(len(row.kind) for _, rows in groups for row in rows)
    for folded in (True, False):
        written = [
            (title, [_lines(row, size, kinds, folded) for row in rows]) for title, rows in groups
        ]
        count = len(heads) + sum(1 + sum(map(len, rows)) for _, rows in written)
        if count <= HEIGHT:
            break
    # what stands over is taken from the middle of the longest lists
    lengths = [len(rows) for _, rows in written]
    room = HEIGHT - len(heads) - len(written)
    kept = list(lengths)
    while count > HEIGHT and sum(kept) + sum(k < n for k, n in zip(kept, lengths)) > room:
        longest = max(range(len(kept)), key=kept.__getitem__)
        if kept[longest] <= 2:
            break
        kept[longest] -= 1
    out = heads
    for (title, rows), keep in zip(written, kept):
        out.append(title)
        first, last = rows, []
        if keep < len(rows):
            first, last = rows[: (keep + 1) // 2], rows[len(rows) - keep // 2 :]
        out += [line for row in first for line in row]
        if keep < len(rows):
            out.append(f"  ... {len(rows) - keep} more ...")
        out += [line for row in last for line in row]
    return out


def _lines(row: _Row, size: int, kinds: int, folded: bool) -> list[str]:
    head = f"  {row.name:{size}}  {row.kind:{kinds}}  "
    text = ", ".join([row.place] * bool(row.place) + list(row.values))
    if folded:
        whole = _UNBROKEN.sub(lambda found: found[0].replace(" ", _TIED), text)
        lines = textwrap.wrap(
            whole, WIDTH, initial_indent=head, subsequent_indent=" " * len(head),
            break_long_words=True, break_on_hyphens=False,
        )  # fmt: skip
        return [line.replace(_TIED, " ").rstrip() for line in lines] or [head.rstrip()]
    whole = (head + text).rstrip()
    if len(whole) <= WIDTH:
        return [whole]
    room = text[: WIDTH - len(head) - 5]
    return [f"{head}{room[: room.rfind(', ')] if ', ' in room else room}, ..."]


def _heading(machine: Built) -> list[str]:
    stations = machine.wiring.stations
    driven = sum(isinstance(s, AbstractPrescribed) for s in machine.stations)
    free = 6 * (len(stations) - driven) - len(machine.wiring.held)
    inner, condensed = len(stations) - len(machine.stations), machine.wiring.condensation
    free -= 6 * len(condensed.followers) if condensed else 0
    count = len(machine.stations)
    words = f"{count} station{'s' * (count > 1)}" + (f" and {inner} inside shafts" if inner else "")
    fields = dataclasses.fields(machine)  # pyright: ignore[reportArgumentType]
    field = next(f for f in fields if f.name == "gravity")
    gravity = f"gravity {parameter_text(field, machine.gravity)}"
    if same(machine.gravity, np.zeros(3)):
        gravity = "no gravity"
    heading = [f"Machine: {words}, {free} degrees of freedom, {gravity}"]
    if condensed and condensed.followers:
        heading.append(
            f"reduced: {len(condensed.followers)} stations follow others; natural frequencies below "
            f"{condensed.up_to:g} Hz at up to {condensed.speed * 30 / np.pi:.4g} rpm are off by "
            f"{condensed.error:.1g} at most"
        )
    return heading


def _groups(machine: Built) -> list[tuple[str, list[_Row]]]:
    wiring = machine.wiring
    line, attached = [], []
    places = dict(zip(wiring.connectors, (_places(machine, ends) for ends in wiring.ends)))
    for element, name, beside in _from_left_to_right(machine):
        line.append(_row(name, element, "" if beside else " - ".join(places[name])))
    for name, element in zip(wiring.connectors, machine.connectors):
        if not isinstance(element, AbstractConnector):
            attached.append(_row(name, element, "at " + ", ".join(places[name])))
    given = []
    for held in wiring.held:
        station, coordinate = wiring.stations[held.station], COORDINATES[held.coordinate]
        if held.motion != FIXED:
            motion = machine.motions[held.motion] if held.motion < len(machine.motions) else None
            along = Within(length=coordinate in "xyz")
            given.append(_row(f"{station}.{coordinate}", motion, within=along))
    groups = [("line:", line), ("attached:", attached)]
    groups.append(
        ("fixed:", [_Row(name, ", ".join(which), ()) for name, which in machine.fixed().items()])
    )
    groups.append(("prescribed:", given))
    return [(title, rows) for title, rows in groups if rows]


def _row(name: str, element: Any, place: str = "", within: Within = ALONE) -> _Row:
    if not isinstance(element, eqx.Module):
        return _Row(name, short(element), (), place)
    kind = getattr(element, "shown_as", type(element).__name__)
    return _Row(name, kind, tuple(settings(element, within)), place)


def _places(machine: Built, ends: tuple[tuple[int, str], ...]) -> list[str]:
    return [machine.wiring.stations[s] + (f".{port}" if port else "") for s, port in ends]


def _from_left_to_right(machine: Built) -> Iterator[tuple[Any, str, bool]]:
    """(element, name, whether it stands between the rows before and behind it) of stations and connectors,
    along the line from its left end, branch by branch."""
    wiring = machine.wiring
    joined: dict[int, list[tuple[int, int, bool]]] = {}
    lefts, rights = set(), set()
    for i, (element, ends) in enumerate(zip(machine.connectors, wiring.ends)):
        if isinstance(element, AbstractConnector) or (
            not isinstance(element, eqx.Module) and len(ends) == 2
        ):
            (a, left), (b, right) = ends
            plain = left in ("", "right") and right in ("", "left")
            joined.setdefault(a, []).append((i, b, plain))
            joined.setdefault(b, []).append((i, a, False))
            lefts.add(a)
            rights.add(b)
    own = range(len(machine.stations))
    starts = sorted(own, key=lambda s: (s not in lefts - rights, s))
    seen: set[int] = set()
    passed: set[int] = set()
    before = None  # the station of the row before
    for start in starts:
        waiting: list[tuple[int | None, int, int, bool]] = [(None, start, start, False)]
        while waiting:
            via, source, station, plain = waiting.pop()
            if via is not None:
                if via in passed:
                    continue
                passed.add(via)
                fresh = station not in seen
                yield (
                    machine.connectors[via],
                    wiring.connectors[via],
                    plain and fresh and before == source,
                )
            if station in seen:
                continue
            seen.add(station)
            yield machine.stations[station], wiring.stations[station], True
            before = station
            # the last is taken first: onwards along the line before branches
            for i, other, plain in reversed(joined.get(station, [])):
                if i not in passed:
                    waiting.append((i, station, other, plain))
