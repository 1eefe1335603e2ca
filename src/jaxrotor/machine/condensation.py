"""Which stations of shafts with mass are not solved for, but follow others (component mode synthesis):
static bookkeeping."""

import copy
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import jax

from ..core.protocol import Carried, Condensable
from .lineup import Lineup


@dataclass(frozen=True)
class Span:
    """Stations between two that something else acts on too, by their numbers, along the shaft: `kept` ones
    are solved for, `followers` follow these and the two ends."""

    kept: tuple[int, ...]
    followers: tuple[int, ...]


@dataclass(frozen=True)
class Condensation:
    """Of a machine. `up_to`: Hz; `speed`: rad/s; `error`: by what part natural frequencies and speeds below
    are off, estimated when it was chosen; `tolerance`: what was asked."""

    spans: tuple[Span, ...] = ()
    up_to: float = 0.0
    tolerance: float = 0.0
    speed: float = 0.0
    error: float = field(default=0.0, compare=False)

    @property
    def followers(self) -> tuple[int, ...]:
        return tuple(station for span in self.spans for station in span.followers)

    @property
    def stations(self) -> set[int]:
        """Kept ones and followers."""
        return {station for span in self.spans for station in (*span.kept, *span.followers)}


# Whoever has chosen that nothing follows.
FULL = Condensation()


def condensed_by(machine: Any, condensation: Condensation | None) -> Any:
    """The machine with these stations following others."""
    other = copy.copy(machine)
    wiring = replace(machine.wiring, condensation=condensation)
    object.__setattr__(other, "wiring", wiring)
    return other


def paths_of(lineup: Lineup, keep: Iterable[int] = ()) -> list[list[int]]:
    """Stations that hold nothing but condensable shafts to two others, run by run, along the shaft; without
    those to `keep`."""
    wiring, member = lineup.wiring, 0
    beside: dict[int, set[int]] = {}  # station -> stations that pieces of shaft join it to
    other: set[int] = {*keep, *(h.station for h in wiring.held)}
    for block in lineup.connectors:
        plain = isinstance(block.element, Condensable)
        for ends in wiring.ends[member : member + len(block)]:
            for (a, port), (b, _) in zip(ends, ends[1:] + ends[:1]):
                if plain and not port:
                    beside.setdefault(a, set()).add(b)
                else:
                    other.add(a)
        member += len(block)
    inner, member = set(), 0
    for block in lineup.stations:
        if isinstance(block.element, Carried) and not jax.tree.leaves(block.element):
            own = range(member, member + len(block))
            inner |= {k for k in own if k not in other and len(beside.get(k, ())) == 2}
        member += len(block)
    paths, left = [], set(inner)
    for first in sorted(inner):
        if first in left and any(k not in inner for k in beside[first]):
            path = [first]
            left.discard(first)
            while following := [k for k in beside[path[-1]] if k in left]:
                path.append(following[0])
                left.discard(following[0])
            paths.append(path)
    return paths
