"""Which part is joined to which: the static half of a machine, free of numbers."""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..core.arguments import listed
from ..core.errors import InputError
from ..core.kinematics import COORDINATES
from ..core.protocol import (
    AbstractAttachment,
    AbstractConnector,
    AbstractElement,
    AbstractStation,
    Composite,
    Ported,
)

FIXED = -1


@dataclass(frozen=True)
class Held:
    """One coordinate of a station with mass that is not free: `motion` counts the given motions,
    or is FIXED."""

    station: int
    coordinate: int
    motion: int


@dataclass(frozen=True)
class Wiring:
    """Names and connections. `ends[i]` lists connector i's ends as (station, port).

    `stations` has the user's first, then those that composites make: `inner[i]` is the number of the
    first one of connector i. `condensation`: which stations follow others;
    `None` where nobody has chosen.
    """

    stations: tuple[str, ...]
    connectors: tuple[str, ...]
    ends: tuple[tuple[tuple[int, str], ...], ...]
    held: tuple[Held, ...]
    order: tuple[str, ...]
    inner: tuple[int, ...] = ()
    condensation: Any = None


def unknown(kind: str, name: object, known: Iterable[str]) -> str:
    """'there is no station `mian`: did you mean `main`? ...'."""
    known = list(known)
    close = difflib.get_close_matches(str(name), known, n=1, cutoff=0.5)
    guess = f": did you mean `{close[0]}`?" if close else ""
    listed = ", ".join(f"`{k}`" for k in known) or "none"
    return f"there is no {kind} `{name}`{guess or ';'} known: {listed}"


def check_name(name: object) -> None:
    if not isinstance(name, str) or not name.strip():
        raise InputError(f"an element's name must be a text, but is {name!r}")
    if "." in name:
        raise InputError(
            f"`{name}`: a name must hold no dot (paths such as `main.mass` do): rename the element"
        )


def wire(
    elements: Mapping[str, AbstractElement],
    connections: Mapping[str, str | Sequence[str]],
) -> tuple[Wiring, list[AbstractElement], list[AbstractElement]]:
    """Sorts elements into stations and connectors and resolves where each connector ends."""
    for name, element in elements.items():
        check_name(name)
        if not isinstance(element, (AbstractStation, AbstractConnector, AbstractAttachment)):
            raise InputError(
                f"`{name}`: must be an element (a Rotor, a Shaft, ...), but is "
                f"{type(element).__name__}: wrap it in a class derived from jaxrotor's "
                "AbstractInertia, AbstractElastic or AbstractAttachment"
            )
    stations = {n: e for n, e in elements.items() if isinstance(e, AbstractStation)}
    connectors = {n: e for n, e in elements.items() if n not in stations}
    if not stations:
        raise InputError("the machine has no station: add a rotor, a bearing or a driven end")
    for name in connections:
        if name not in elements:
            raise InputError(f"connections: {unknown('element', name, connectors)}")
        if name in stations:
            raise InputError(
                f"`{name}`: is a station ({type(elements[name]).__name__}) and is not connected "
                "itself: connect shafts and attachments to it"
            )
    names, inner = list(stations), []
    for name, element in connectors.items():
        inner.append(len(names))
        if isinstance(element, Composite):
            names += [f"{name}.{k + 1}" for k in range(element.inner)]
    ends = []
    for name, element in connectors.items():
        if name not in connections:
            raise InputError(
                f"`{name}`: is connected to nothing: give its stations in `connections`"
            )
        given = connections[name]
        places = (
            (given,) if isinstance(given, str) else tuple(listed(given, f"`{name}`: its stations"))
        )
        if isinstance(element, AbstractConnector) and len(places) != 2:
            raise InputError(f"`{name}`: joins two stations, but {len(places)} are given")
        ends.append(tuple(_resolve(name, place, stations, names) for place in places))
        if len(set(ends[-1])) != len(ends[-1]):
            raise InputError(f"`{name}`: both ends are at `{places[0]}`: name two places")
    return (
        Wiring(tuple(names), tuple(connectors), tuple(ends), (), tuple(elements), tuple(inner)),
        list(stations.values()),
        list(connectors.values()),
    )


def _resolve(
    connector: str, place: str, stations: Mapping[str, AbstractElement], names: list[str]
) -> tuple[int, str]:
    if not isinstance(place, str):
        raise InputError(f"`{connector}`: a place is a station's name, but is {place!r}")
    if place in names:
        return names.index(place), ""
    station, _, port = place.partition(".")
    inner = [n for n in names[len(stations) :] if n.startswith(f"{station}.")]
    if inner:
        raise InputError(f"`{connector}`: {unknown('inner station', place, inner)}")
    if station not in stations:
        raise InputError(f"`{connector}`: {unknown('station', station, stations)}")
    element = stations[station]
    ports = element.ports if isinstance(element, Ported) else ()
    if port and port not in ports:
        raise InputError(f"`{connector}`: {unknown(f'port of `{station}`', port, ports)}")
    return list(stations).index(station), port


def coordinate(place: str, name: str) -> int:
    if name not in COORDINATES:
        raise InputError(f"`{place}`: {unknown('coordinate', name, COORDINATES)}")
    return COORDINATES.index(name)


def check_connected(wiring: Wiring) -> None:
    """Refuses a machine that falls into pieces which nothing joins."""
    group = list(range(len(wiring.stations)))

    def root(i: int) -> int:
        while group[i] != i:
            i = group[i]
        return i

    for ends in wiring.ends:
        for (a, _), (b, _) in zip(ends, ends[1:]):
            group[root(a)] = root(b)
    for i, first in enumerate(wiring.inner):
        stop = [*wiring.inner, len(wiring.stations)][i + 1]
        for k in range(first, stop):
            group[root(k)] = root(wiring.ends[i][0][0])
    pieces = {root(i) for i in group}
    if len(pieces) > 1:
        first = wiring.stations[0]
        apart = [s for i, s in enumerate(wiring.stations) if root(i) != root(0)]
        raise InputError(
            f"the line is disconnected: nothing joins `{apart[0]}` to `{first}`: add a shaft or a "
            "coupling between them"
        )
