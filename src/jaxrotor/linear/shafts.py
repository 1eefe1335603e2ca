"""Which stations turn together: the shafts of a machine, between its gears."""

from ..core.protocol import Geared
from ..machine.layout import layout_of
from ..machine.machine import Machine
from ..machine.speed_ratios import root


def driven_station(machine: Machine) -> int:
    """The station whose spin is the reference, by number."""
    layout = layout_of(machine)
    node = root(layout)
    if node >= layout.n_nodes:
        return layout.ground[node - layout.n_nodes]
    return layout.internal.index(node)


def line_of(machine: Machine, end: tuple[int, str]) -> tuple[int, str]:
    """A station, by number, and which of the lines that turn there: its own, "", or a port's behind gears."""
    station, port = end
    geared = station < len(machine.stations) and isinstance(machine.stations[station], Geared)
    return station, port if geared else ""


def joined_with(machine: Machine, station: int) -> frozenset[tuple[int, str]]:
    """What is reached from a station without passing gears, as `line_of` tells it; it too."""
    links = [
        tuple(line_of(machine, end) for end in ends)
        for ends, c in zip(machine.wiring.ends, machine.connectors)
        if not isinstance(c, Geared)
    ]
    reached, grown = {(station, "")}, True
    while grown:
        new = {place for ends in links if any(e in reached for e in ends) for place in ends}
        new -= reached
        reached |= new
        grown = bool(new)
    return frozenset(reached)


def shafts_of(machine: Machine) -> tuple[tuple[str, ...], ...]:
    """The names of the stations of each shaft, in the order of the machine; the driven shaft first. A shaft
    is what turns at one speed: all that is reached without passing gears. Rigid gears count to that of gear
    a."""
    names = machine.wiring.stations[: len(machine.stations)]
    found: list[frozenset[tuple[int, str]]] = []
    for start in (driven_station(machine), *range(len(names))):
        if not any((start, "") in shaft for shaft in found):
            found.append(joined_with(machine, start))
    return tuple(tuple(n for k, n in enumerate(names) if (k, "") in shaft) for shaft in found)
