"""The [machine] section: a line or a general machine, with attachments."""

from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.protocol import (
    AbstractAttachment,
    AbstractConnector,
    AbstractElement,
    AbstractStation,
    Composite,
)
from ..core.units import read, shown
from ..interop.coefficients import read_coefficients
from ..machine.machine import Machine
from .build import FAILED, Context, build_element
from .constraints import read_fixed, read_prescribed
from .kinds import find_kind
from .mistakes import Faults, guess
from .profile import profile_line, profile_name, read_position

# Not a class: what a file of coefficients becomes, `read_coefficients` says.
COEFFICIENTS = "Coefficients"
_KEYS = (
    "line",
    "attachments",
    "profile",
    "elements",
    "connections",
    "gravity",
    "fixed",
    "prescribed",
    "reduce",
)


class MachineReader:
    """Reads one [machine] table; what is wrong is added to `faults`."""

    def __init__(self, table: Any, faults: Faults, folder: Path | None):
        self.table, self.faults, self.folder = table, faults, folder
        self.parts: dict[str, Any] = {}  # name -> element, or FAILED
        self.stations: list[str] = []  # names that may be wired to, as far as is known
        self.line: list[str] = []
        self.attached: dict[str, Any] = {}  # name -> its place or places
        self.positions: dict[str, float] = {}  # of stations on a profile, m

    def read(self) -> Machine | None:
        if not isinstance(self.table, dict):
            self.faults.add(
                "machine", f"must be a table, but is {shown(self.table)}: write [machine]"
            )
            return None
        before = len(self.faults.sentences)
        self.faults.unknown_keys("machine", self.table, _KEYS)
        if ("line" in self.table) == ("elements" in self.table):
            given = "both are" if "line" in self.table else "neither is"
            self.faults.add(
                "machine", f"needs either [[machine.line]] or [machine.elements], but {given} given"
            )
        self._named_list("line", (AbstractStation, AbstractConnector))
        self._profile()
        self._elements()
        self._named_list("attachments", (AbstractAttachment,))
        connections = self._connections()
        options = dict(
            gravity=self._gravity(),
            fixed=read_fixed(self.table.get("fixed", {}), self.stations, self.faults),
            prescribed=read_prescribed(
                self.table.get("prescribed", {}), self.stations, self.faults, self.folder
            ),
        )
        reduce = self._reduce()
        if len(self.faults.sentences) > before:
            return None
        try:
            if "line" in self.table:
                attachments = {n: (self.parts[n], at) for n, at in self.attached.items()}
                line = {n: self.parts[n] for n in self.line}
                machine = Machine.in_line(line, attachments, **options)
            else:
                machine = Machine(self.parts, {**connections, **self.attached}, **options)
            if reduce is None:
                return machine
            return machine.reduced(**reduce) if reduce else machine.full()
        except InputError as error:
            self.faults.sentences += error.problems
            return None

    def _named_list(self, section: str, bases: tuple[type, ...]) -> None:
        """[[machine.line]] and [[machine.attachments]]: tables with a name and a kind."""
        given = self.table.get(section, [])
        if not isinstance(given, list) or (section in self.table and not given):
            self.faults.add(
                "machine",
                f"{section} must be a list of elements, but is {shown(given)}: write "
                f"[[machine.{section}]] tables",
            )
            return
        for i, table in enumerate(given):
            place = f"{section}, entry {i + 1}"
            if not isinstance(table, dict):
                given = shown(table)
                self.faults.add(place, f"must be a table, but is {given}: give it name and kind")
                continue
            name = table.get("name")
            if name is None:
                kind = table.get("kind", "?")
                self.faults.add(place, f'name is missing (kind "{kind}"): write name = "..."')
            elif self._name(place, name, "name "):
                place = f'{section} "{name}"'
            else:
                name = None
            rest = {k: v for k, v in table.items() if k != "name"}
            if section == "attachments":
                at = self._at(place, rest.pop("at", None))
                self._part(place, name, rest, bases)
                if name is not None:
                    self.attached[name] = at
            else:
                position = read_position(rest, place, self.faults)
                self._part(place, name, rest, bases)
                if name is not None:
                    self.line.append(name)
                    if position is not None:
                        self.positions[name] = position

    def _profile(self) -> None:
        """Draws the shaft between the stations that stand on it, and its ends."""
        if "profile" not in self.table:
            for name in self.positions:
                self.faults.add(f'line "{name}"', "position goes with a [machine.profile]: add one")
            return
        if not self.positions:
            self.faults.add(
                "profile", 'nothing stands on it: give stations of the line a position = "..."'
            )
            return
        places = [i for i, name in enumerate(self.line) if name in self.positions]
        first, last = places[0], places[-1]
        for name in self.line[first : last + 1]:
            if name not in self.positions:
                self.faults.add(
                    f'line "{name}"',
                    "stands between stations that have a position: give it one, or move it",
                )
        for i in (first - 1, last + 1):
            beside = self.line[i] if 0 <= i < len(self.line) else None
            if isinstance(self.parts.get(beside or ""), AbstractStation):
                self.faults.add(
                    f'line "{beside}"', "stands beside the profile without a position: give it one"
                )
        on_it = {
            name: (at, self.parts[name])
            for name, at in self.positions.items()
            if isinstance(self.parts[name], AbstractStation)
        }
        for name in self.positions:
            if name not in on_it and self.parts[name] is not FAILED:
                self.faults.add(f'line "{name}"', "only a station has a position: leave it out")
        drawn = profile_line(self.table["profile"], on_it, self.faults, self.folder)
        if drawn is None:  # what it would have made is not told again
            made = profile_name(self.table["profile"])
            numbers = range(1, len(on_it) + 2)
            self.stations += [made, *(f"{made} {k}" for k in numbers)]
            self.stations += [f"{made} left end", f"{made} right end"]
            return
        for name, part in drawn.items():
            if name in on_it:
                continue
            if name in self.parts:
                self.faults.add("profile", f'makes a "{name}", which is there already: rename one')
            self.parts[name] = part
            inner = range(part.inner) if isinstance(part, Composite) else None
            self.stations += [name] if inner is None else [f"{name}.{k + 1}" for k in inner]
        self.line[first : last + 1] = drawn

    def _name(self, place: str, name: Any, prefix: str = "") -> bool:
        if not isinstance(name, str) or not name.strip():
            self.faults.add(
                place, f"{prefix}must be a text, but is {shown(name)}: put it in quotes"
            )
        elif "." in name:
            self.faults.add(
                place, f'{prefix}must hold no dot (paths do), but is "{name}": rename the element'
            )
        elif name in self.parts:
            self.faults.add(place, f'{prefix}"{name}" is used twice: rename one of the two')
        else:
            return True
        return False

    def _elements(self) -> None:
        given = self.table.get("elements", {})
        if not isinstance(given, dict):
            self.faults.add("machine", "elements must be tables: write [machine.elements.<name>]")
            return
        for name, table in given.items():
            place = f'elements "{name}"'
            if not isinstance(table, dict):
                self.faults.add(place, f"must be a table, but is {shown(table)}: give it a kind")
            elif self._name(place, name):
                self._part(place, name, dict(table), (AbstractElement,))

    def _part(self, place: str, name: str | None, table: dict, bases: tuple[type, ...]) -> None:
        kind = table.pop("kind", None)
        cls, element = None, FAILED
        if kind is None:
            self.faults.add(place, 'kind is missing: write kind = "Rotor", "Shaft" or another')
        elif kind == COEFFICIENTS:
            element = self._coefficients(place, table)
            cls = AbstractAttachment if element is FAILED else type(element)
        else:
            cls = find_kind(kind, AbstractElement, place, self.faults, self.folder)
        misplaced = cls is not None and not issubclass(cls, bases)
        if misplaced:
            where = (
                "[[machine.attachments]], with at" if bases[0] is AbstractStation else "the line"
            )
            self.faults.add(place, f'kind "{kind}" does not belong here: give it in {where}')
        elif cls is not None and kind != COEFFICIENTS:
            element = build_element(cls, table, Context(self.faults, place, self.folder))
        if name is not None:
            self.parts[name] = element
            # what is not known, or misplaced, may well be meant as a station: no second sentence
            if cls is None or misplaced or issubclass(cls, AbstractStation):
                self.stations.append(name)
            elif issubclass(cls, Composite):
                # of one that could not be built nobody knows how many it makes: any will do
                inner = range(0) if element is FAILED else range(element.inner)
                self.stations += [f"{name}.{k + 1}" for k in inner] or [name]

    def _coefficients(self, place: str, table: dict) -> Any:
        """A support from a file beside the study."""
        file, units = table.get("file"), table.get("units", {})
        self.faults.unknown_keys(place, table, ("file", "units"))
        if not isinstance(file, str):
            self.faults.add(place, 'file is missing: write file = "seal.csv"')
        elif not isinstance(units, dict) or not all(isinstance(x, str) for x in units.values()):
            self.faults.add(place, 'units must be a table of texts: write units = { k = "N/mm" }')
        else:
            try:
                return read_coefficients((self.folder or Path()) / file, units)
            except InputError as error:
                self.faults.sentences += [f"`{place}`: {p}" for p in error.problems]
        return FAILED

    def _at(self, place: str, at: Any, key: str = "at") -> Any:
        """A station's name, or two; a port such as `main.mass_centre` counts as its station."""
        if isinstance(at, list):
            return tuple(self._at(place, one, key) for one in at)
        if at is None:
            self.faults.add(place, f'{key} is missing: write {key} = "..." with a station\'s name')
        elif not isinstance(at, str):
            self.faults.add(place, f"{key} must be a station's name, but is {shown(at)}: quote it")
        elif at not in self.stations and at.partition(".")[0] not in self.stations:
            self.faults.add(place, f'{key} names no station "{at}"{guess(at, self.stations)}')
        return at

    def _connections(self) -> dict[str, Any]:
        given = self.table.get("connections", {})
        if not isinstance(given, dict):
            self.faults.add(
                "machine", 'connections must be a table: write name = ["left", "right"]'
            )
            return {}
        if given and "line" in self.table:
            self.faults.add(
                "connections", "do not go with [[machine.line]], which joins its own: remove them"
            )
        for name in given:
            if name not in self.parts:
                self.faults.add("connections", f'there is no "{name}"{guess(name, self.parts)}')
        return {name: self._at("connections", at, name) for name, at in given.items()}

    def _reduce(self) -> dict[str, float] | None:
        """The arguments of `Machine.reduced`, empty for a machine that is to be full."""
        given = self.table.get("reduce")
        if given is None or given is False:
            return None if given is None else {}
        if not isinstance(given, dict) or "up_to" not in given:
            self.faults.add(
                "machine",
                f"reduce must say up to which frequency, but is {shown(given)}: write [machine.reduce] "
                'with up_to = "500 Hz", or reduce = false',
            )
            return None
        self.faults.unknown_keys("reduce", given, ("up_to", "tolerance", "speed"))
        found = {}
        for key, unit in (("up_to", "Hz"), ("tolerance", ""), ("speed", "rad/s")):
            if key in given:
                try:
                    found[key] = read(given[key], unit)
                except ValueError as error:
                    self.faults.add("reduce", f"{key} {error}")
        return found

    def _gravity(self) -> Any:
        given = self.table.get("gravity", ["0 m/s^2"] * 3)
        if not isinstance(given, list) or len(given) != 3:
            self.faults.add(
                "machine",
                f"gravity must be three accelerations, but is {shown(given)}: write "
                '["0 m/s^2", "-9.81 m/s^2", "0 m/s^2"]',
            )
            return None
        numbers = []
        for i, value in enumerate(given):
            try:
                numbers.append(read(value, "m/s^2"))
            except ValueError as error:
                self.faults.add("machine", f"gravity[{i}] {error}")
        return numbers
