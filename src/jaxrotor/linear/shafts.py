"""Which stations turn together: the shafts of a machine, between its gears."""

from ..core.protocol import Geared
from ..machine.layout import lay_out
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from ..machine.speed_ratios import root


def driven_station(machine: Machine) -> int:
    """The station whose spin is the reference, by number."""
    layout = lay_out(structure_of(machine))
    node = root(layout)
    if node >= layout.n_nodes:
        return layout.ground[node - layout.n_nodes]
    return layout.internal.index(node)


def joined_with(machine: Machine, station: int) -> frozenset[int]:
    """Stations, by number, that are reached from one without passing gears; it too."""
    links = [
        ends
        for ends, c in zip(machine.wiring.ends, machine.connectors)
        if not isinstance(c, Geared)
    ]
    reached, grown = {station}, True
    while grown:
        new = {s for ends in links if any(e in reached for e, _ in ends) for s, _ in ends}
        new -= reached
        reached |= new
        grown = bool(new)
    return frozenset(reached)


def shafts_of(machine: Machine) -> tuple[tuple[str, ...], ...]:
    """The names of the stations of each shaft, in the order of the machine; the driven shaft first. A shaft
    is what turns at one speed: all that is reached without passing gears."""
    names = machine.wiring.stations[: len(machine.stations)]
    found: list[frozenset[int]] = []
    for start in (driven_station(machine), *range(len(names))):
        if not any(start in shaft for shaft in found):
            found.append(joined_with(machine, start))
    return tuple(tuple(n for k, n in enumerate(names) if k in shaft) for shaft in found)
