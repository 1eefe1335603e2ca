"""The machine: its parts, how they are joined, and its parameters by name."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from ..core.arguments import mapping, names, number, text
from ..core.doors import plot_door, through
from ..core.errors import InputError, refuse
from ..core.gate import takes
from ..core.kinematics import COORDINATES
from ..core.parameter import as_float64, parameter, problems
from ..core.part import Part
from ..core.protocol import (
    AbstractAttachment,
    AbstractConnector,
    AbstractElement,
    AbstractInertia,
    AbstractPrescribed,
    AbstractStation,
    Ended,
    Lumping,
)
from ..profiles.motion import AbstractMotion
from .condensation import FULL, condensed_by
from .ends import check_carried, check_ends, massless
from .lineup import structure_of
from .paths import entry_of, field_of, place_of, resolve, split_entry, walk, with_entry
from .text import machine_text
from .wiring import FIXED, Held, Wiring, check_connected, coordinate, unknown, wire

Place = str | Sequence[str]


class Machine(Part):
    """A line-up of elements: a pytree whose leaves are the physical parameters.

    **Arguments:**

    - `elements`: name -> element. Stations (rotors, bearings, driven ends), elastic elements and
      attachments in any order; names hold no dot.
    - `connections`: name of each elastic element or attachment -> its station, or its stations.
      `"main.mass_centre"` names a port of a station.
    - `gravity`: m/s², a vector in the global frame (z is the axis of rotation, y is up).
    - `fixed`: station -> the names of those of its coordinates that stay zero.
    - `prescribed`: station -> {coordinate: motion}. A held coordinate of a station with mass gets
      the right inertia coupling, and its constraint force is the station's `reaction`. Held as `phi` is
      how far the station has turned, chi = phi + psi theta/2 (docs/physics.md).

    Everything is checked here; an `InputError` says what is wrong, where, and what to do.
    """

    stations: tuple[AbstractStation, ...]
    connectors: tuple[AbstractElement, ...]
    motions: tuple[AbstractMotion, ...]
    gravity: Float[Array, "3"] = parameter("m/s^2", shapes=((3,),))
    wiring: Wiring = eqx.field(static=True)  # pyright: ignore[reportGeneralTypeIssues]

    @takes(elements=mapping, connections=mapping, fixed=mapping, prescribed=mapping)
    def __init__(
        self,
        elements: Mapping[str, AbstractElement],
        connections: Mapping[str, Place],
        gravity: Any = (0.0, 0.0, 0.0),
        fixed: Mapping[str, Sequence[str]] | None = None,
        prescribed: Mapping[str, Mapping[str, AbstractMotion]] | None = None,
    ):
        parts = {name: e for name, e in elements.items() if isinstance(e, AbstractElement)}
        refuse(_faults(parts, as_float64(gravity)))  # first: wiring counts what parts are made of
        wiring, stations, connectors = wire(elements, connections)
        check_connected(wiring)
        held, motions = _hold(wiring, stations, fixed or {}, prescribed or {})
        self.wiring = replace(wiring, held=held)
        self.stations = tuple(stations)  # pyright: ignore
        self.connectors = tuple(connectors)
        self.motions = motions
        self.gravity = as_float64(gravity)
        refuse(self._motion_faults(set(wiring.stations)))
        lineup = structure_of(self)
        check_ends(lineup)
        check_carried(lineup)
        refuse(massless(self))

    @classmethod
    @takes(elements=mapping, attachments=mapping)
    def in_line(
        cls,
        elements: Mapping[str, AbstractElement],
        attachments: Mapping[str, tuple[AbstractElement, Place]] | None = None,
        gravity: Any = (0.0, 0.0, 0.0),
        fixed: Mapping[str, Sequence[str]] | None = None,
        prescribed: Mapping[str, Mapping[str, AbstractMotion]] | None = None,
    ) -> "Machine":
        """A serial machine, read from left to right: station, shaft, station, ..., station.

        `attachments`: name -> (element, station), or (element, (station, station)). The other
        arguments are those of `Machine`. Raises `InputError` for two stations side by side, an elastic
        element without a station on either side, a name used twice, and what `Machine` refuses.
        """
        names = list(elements)
        connections: dict[str, Place] = {}
        for i, name in enumerate(names):
            station = isinstance(elements[name], AbstractStation)
            if station and i and isinstance(elements[names[i - 1]], AbstractStation):
                raise InputError(
                    f"`{names[i - 1]}` and `{name}` are two stations with nothing between them: "
                    "put a shaft or a coupling there"
                )
            if isinstance(elements[name], AbstractConnector):
                if i in (0, len(names) - 1) or not isinstance(
                    elements[names[i + 1]], AbstractStation
                ):
                    raise InputError(
                        f"`{name}`: an elastic element must stand between two stations: put a "
                        "rotor, a SelfAligningBearing or a driven end on either side; a support goes into "
                        "attachments={...}"
                    )
                before, after = elements[names[i - 1]], elements[names[i + 1]]
                connections[name] = (
                    names[i - 1] + (before.end("right") if isinstance(before, Ended) else ""),
                    names[i + 1] + (after.end("left") if isinstance(after, Ended) else ""),
                )
            elif not station and isinstance(elements[name], AbstractElement):
                raise InputError(
                    f"`{name}`: a {type(elements[name]).__name__} does not stand in the line: "
                    f"give it as attachments={{{name!r}: (..., 'station')}}"
                )
        parts = dict(elements)
        for name, given in (attachments or {}).items():
            if name in parts:
                raise InputError(f"`{name}`: the name is used twice: rename the attachment")
            if not isinstance(given, tuple) or len(given) != 2:
                raise InputError(
                    f"`{name}`: an attachment is given as (element, station), but is {given!r}"
                )
            parts[name], connections[name] = given
        return cls(parts, connections, gravity, fixed, prescribed)

    def __getitem__(self, name: str) -> AbstractElement:
        if name in self.wiring.stations:
            return self.stations[self.wiring.stations.index(name)]
        if name in self.wiring.connectors:
            return self.connectors[self.wiring.connectors.index(name)]
        raise InputError(unknown("element", name, self.wiring.order))

    plot = plot_door()

    def __repr__(self) -> str:
        return machine_text(self)

    def _repr_html_(self) -> str:
        """For notebooks: the drawing above the line-up."""
        return through("plot.inline", "machine_html")(self)

    def summary(self) -> Any:
        """Masses, inertias, lengths, centre of gravity and static reactions: a `MachineSummary`, which prints
        as tables."""
        return through("simulation.summary", "summarize")(self)

    def to_toml(self) -> str:
        """The [machine] section of a study that reads back as this machine, equal to the last bit. Raises
        `InputError` for what has no such form: traced numbers, a class that cannot be imported by name."""
        return through("study.write", "machine_text")(self)

    def elements(self) -> dict[str, AbstractElement]:
        """name -> element, in the order given."""
        return {name: self[name] for name in self.wiring.order}

    def connections(self) -> dict[str, tuple[str, ...]]:
        """connector -> the places of its ends."""
        return {
            name: tuple(self.wiring.stations[s] + (f".{port}" if port else "") for s, port in ends)
            for name, ends in zip(self.wiring.connectors, self.wiring.ends)
        }

    def fixed(self) -> dict[str, tuple[str, ...]]:
        """station -> the names of those of its coordinates that stay zero."""
        names: dict[str, tuple[str, ...]] = {}
        for held in self.wiring.held:
            if held.motion == FIXED:
                station = self.wiring.stations[held.station]
                names[station] = (*names.get(station, ()), COORDINATES[held.coordinate])
        return names

    def prescribed(self) -> dict[str, dict[str, AbstractMotion]]:
        """station -> {coordinate: motion}, in the order given."""
        moved: dict[str, dict[str, AbstractMotion]] = {}
        for held in sorted(self.wiring.held, key=lambda h: h.motion):
            if held.motion != FIXED:
                station = moved.setdefault(self.wiring.stations[held.station], {})
                station[COORDINATES[held.coordinate]] = self.motions[held.motion]
        return moved

    @takes(
        up_to=number("Hz", above=0.0),
        tolerance=number(above=0.0, below=1.0),
        speed=number("rad/s", least=0.0),
    )
    def reduced(
        self, up_to: float, tolerance: float = 1e-6, speed: float | None = None
    ) -> "Machine":
        """The same machine with fewer stations to solve for, by component mode synthesis (Hurty 1965; Craig &
        Bampton 1968): where nothing but two pieces of a `FiniteElementShaft` meets, a station follows others.

        So many are kept that natural frequencies below `up_to` (Hz), at speeds up to `speed` (rad/s, of the
        fastest shaft; by default `2 pi up_to`), are off by no more than `tolerance`, as estimated:
        `machine.wiring.condensation.error`. Statics are exact. All stations keep their names and stand in
        every result; parameters keep their paths, may change (inside `jit` too) and be differentiated by;
        where much changes, reduce anew. Rotating damping turns with a whole shaft, not with each station.
        Raises `InputError` for wrong input, inside `jit`, and where a force of the undeformed machine has no
        finite slope.

        `simulate`, `plan` and `energy_audit` do so with machines beyond forty stations, for half the sample
        rate, and linear analysis for what it is asked for; not inside `jit`, and not with what is `full`.
        """
        choose = through("machine.reduction", "choose")
        return condensed_by(self, choose(self, up_to, tolerance, speed) or FULL)

    def full(self) -> "Machine":
        """With all stations solved for, however many."""
        return condensed_by(self, FULL)

    @property
    def is_driven(self) -> bool:
        """Whether the spin of the line, or of a part of it, is given."""
        return any(isinstance(s, AbstractPrescribed) for s in self.stations) or any(
            held.coordinate == 5 and held.motion != FIXED for held in self.wiring.held
        )

    def sways(self, station: str) -> bool:
        """Whether a station can move across the axis: not where a study of turning alone fixes it. Raises
        `InputError` for an unknown name."""
        if station not in self.wiring.stations:
            raise InputError(unknown("station", station, self.wiring.stations))
        index = self.wiring.stations.index(station)
        held = {h.coordinate for h in self.wiring.held if h.station == index and h.motion == FIXED}
        return not {0, 1} <= held

    def parameters(self) -> dict[str, Array]:
        """path -> value of every parameter."""
        found = {"gravity": self.gravity}
        for name, element in self.elements().items():
            found.update(walk(element, name))
        for held in self.wiring.held:
            if held.motion != FIXED:
                found.update(walk(self.motions[held.motion], self._held_path(held)))
        return found

    def _held_path(self, held: Held) -> str:
        return f"{self.wiring.stations[held.station]}.{COORDINATES[held.coordinate]}"

    def _split(self, path: str) -> tuple[Any, Any, list[str]]:
        """For a path: (machine -> the root it starts from, that root, the steps below it)."""
        head, *steps = text(path, "a parameter's path").split(".")
        if path == "gravity":
            return (lambda m: m), self, ["gravity"]
        for held in self.wiring.held:
            if steps and held.motion != FIXED and path.startswith(self._held_path(held) + "."):
                which = held.motion
                return (lambda m, which=which: m.motions[which]), self.motions[which], steps[1:]
        if head not in self.wiring.order:
            raise InputError(
                f"`{path}`: {unknown('element', head, (*self.wiring.order, 'gravity'))}"
            )
        return (lambda m: m[head]), self[head], steps

    def get(self, path: str) -> Any:
        """The parameter (or part) at `path`, such as `"main.unbalance.eccentricity"`, or an entry of one,
        `"bearing.stiffness[0]"`. Raises `InputError` where there is none."""
        path, entry = split_entry(text(path, "a parameter's path"))
        _, root, steps = self._split(path)
        found = resolve(root, steps, path)
        return found if entry is None else entry_of(found, entry, f"{path}[{entry}]")

    def units(self, path: str) -> tuple[str, ...]:
        """SI unit of a parameter: one, or one for each entry where they differ. Raises `InputError` for
        a path that names no parameter."""
        _, root, steps = self._split(path)
        resolve(root, steps, path)
        field = field_of(resolve(root, steps[:-1], path), steps[-1]) if steps else None
        if field is None or "unit" not in field.metadata:
            raise InputError(f"`{path}`: is no parameter")
        length = isinstance(root, AbstractMotion) and path.split(".")[1] in "xyz"
        return place_of(root, steps, path, length).units(field)

    @takes(values=mapping)
    def set(self, values: Mapping[str, Any]) -> "Machine":
        """A machine with other values: `machine.set({"main.mass": 6.1, "bearing.stiffness[0]": 1e6})`; SI
        units, checked. Raises `InputError` for a path that names no parameter or part, and for what is out
        of its bounds."""
        machine = self
        for whole, value in values.items():
            path, entry = split_entry(text(whole, "a parameter's path"))
            if entry is not None:
                value = with_entry(machine.get(path), entry, as_float64(value), whole)
            where, root, steps = machine._split(path)
            resolve(root, steps, path)
            owner = resolve(root, steps[:-1], path) if steps else None
            field = field_of(owner, steps[-1]) if steps else None
            if field is None or "unit" not in field.metadata:
                if not isinstance(value, eqx.Module):
                    raise InputError(
                        f"`{path}`: is a part of the machine, not one number: name one of its "
                        f"parameters, {', '.join(p for p, _ in walk(resolve(root, steps, path), path))}"
                        if isinstance(resolve(root, steps, path), eqx.Module)
                        else f"`{path}`: is an option, not a number: build the machine anew with it"
                    )
                if not steps and not any(
                    isinstance(root, kind) and isinstance(value, kind)
                    for kind in (
                        AbstractPrescribed,
                        AbstractInertia,
                        AbstractConnector,
                        AbstractAttachment,
                    )
                ):
                    raise InputError(
                        f"`{path}`: is a {type(root).__name__} and cannot become a "
                        f"{type(value).__name__}: build the machine anew"
                    )
            else:
                value = as_float64(value)
            machine = eqx.tree_at(
                lambda m: resolve(where(m), steps, path),  # noqa: B023
                machine,
                value,
                is_leaf=lambda x: x is None,
            )
        # the others were looked at when they came in: each takes a millisecond, in each row of a sweep
        machine._check({split_entry(path)[0].split(".")[0] for path in values})
        return machine

    def check(self) -> None:
        """Raises `InputError` for every parameter that is out of its bounds."""
        self._check({"gravity", *self.wiring.order})

    def _check(self, names: Set[str]) -> None:
        """Of the elements of these names and the motions of these stations."""
        elements = {name: self[name] for name in self.wiring.order if name in names}
        refuse([*_faults(elements, self.gravity), *self._motion_faults(names)])
        refuse(massless(self))

    def _motion_faults(self, names: Set[str]) -> list[str]:
        stations = self.wiring.stations
        moved = [h for h in self.wiring.held if h.motion != FIXED and stations[h.station] in names]
        return [p for h in moved for p in problems(self.motions[h.motion], self._held_path(h))]

    def filled(self) -> "Machine":
        """The machine with the lumped shares of shafts filled in where the user gave none. Raises
        `InputError` where no shaft beside such a station has a share to give."""
        stations = list(self.stations)
        for i, (name, station) in enumerate(zip(self.wiring.stations, stations)):
            if isinstance(station, Lumping):
                beside = tuple(
                    connector
                    for connector, ends in zip(self.connectors, self.wiring.ends)
                    if isinstance(connector, AbstractConnector) and any(s == i for s, _ in ends)
                )
                try:
                    stations[i] = station.lumped(beside)
                except ValueError as error:
                    raise InputError(f"`{name}`: {error}") from None
        return eqx.tree_at(lambda m: m.stations, self, tuple(stations))


class _Gravity(eqx.Module):
    gravity: Float[Array, "3"] = parameter("m/s^2", shapes=((3,),))


def _faults(elements: Mapping[str, AbstractElement], gravity: Any) -> list[str]:
    """Of the parameters of elements, by name, and of the gravity."""
    found = list(problems(_Gravity(gravity), "machine"))
    return found + [p for name, e in elements.items() for p in problems(e, name)]


def _hold(
    wiring: Wiring,
    stations: list[AbstractElement],
    fixed: Mapping[str, Sequence[str]],
    prescribed: Mapping[str, Mapping[str, AbstractMotion]],
) -> tuple[tuple[Held, ...], tuple[AbstractMotion, ...]]:
    held: list[Held] = []
    motions: list[AbstractMotion] = []

    def station(name: str, what: str) -> int:
        if name not in wiring.stations:
            raise InputError(f"{what}: {unknown('station', name, wiring.stations)}")
        index = wiring.stations.index(name)
        if index >= len(stations):
            raise InputError(
                f"{what}: `{name}` is an inner station: put a Node between two shafts and name that"
            )
        if isinstance(stations[index], AbstractPrescribed):
            raise InputError(
                f"`{name}`: all its coordinates are prescribed already: leave it out of {what}"
            )
        return index

    for name, coordinates in fixed.items():
        index = station(name, "fixed")
        if not isinstance(coordinates, (list, tuple)) or coordinates:  # none is a choice too
            names(coordinates, f"fixed: coordinates of `{name}`")
        if isinstance(coordinates, str):
            coordinates = (coordinates,)
        held += [Held(index, coordinate(name, c), FIXED) for c in coordinates]
    for name, given in prescribed.items():
        index = station(name, "prescribed")
        for c, motion in mapping(given, f"prescribed: coordinates of `{name}`").items():
            if not isinstance(motion, AbstractMotion):
                raise InputError(
                    f"`{name}.{c}`: a prescribed coordinate needs a motion such as "
                    f"CosineRamp(...), but is {motion!r}"
                )
            held.append(Held(index, coordinate(name, c), len(motions)))
            motions.append(motion)
    for index, part in enumerate(stations):
        if isinstance(part, AbstractInertia) and part.turns_only:
            own = {h.coordinate: h.motion for h in held if h.station == index}
            if any(c < 5 and motion != FIXED for c, motion in own.items()):
                raise InputError(
                    f"`{wiring.stations[index]}`: turns alone, a {type(part).__name__}: prescribe no more "
                    "than its phi"
                )
            held += [Held(index, c, FIXED) for c in range(5) if c not in own]
    places = [(h.station, h.coordinate) for h in held]
    for s, c in places:
        if places.count((s, c)) > 1:
            raise InputError(f"`{wiring.stations[s]}`: {COORDINATES[c]} is held twice")
    return tuple(sorted(held, key=lambda h: (h.station, h.coordinate))), tuple(motions)
