"""The diagnostic figures that a study asks for: `[[figures]]` with a `kind`."""

import re
from typing import Annotated, Any, Literal, get_args

import pydantic

from ..core.units import shown
from ..machine.machine import Machine
from .mistakes import Faults, guess
from .settings import Section, _above_zero, _in

Kind = Literal[
    "full_spectrum",
    "waterfall",
    "cascade",
    "order_tracking",
    "orbit",
    "centreline",
    "poincare",
]
KINDS: tuple[str, ...] = get_args(Kind)


def _orders(value: Any) -> tuple[float, ...]:
    many = value if isinstance(value, (list, tuple)) else ()
    numbers = [k for k in many if isinstance(k, (int, float)) and not isinstance(k, bool)]
    sound = [float(k) for k in numbers if 0 < k < float("inf")]
    if not sound or len(sound) < len(many) or len(set(sound)) < len(sound):
        given = shown(list(value)) if isinstance(value, tuple) else shown(value)
        raise ValueError(
            f"must be a list of different positive numbers per turn, but is {given}: write orders = [1, 2]"
        )
    return tuple(sound)


Orders = Annotated[tuple[float, ...], pydantic.BeforeValidator(_orders)]
Length = Annotated[float, _in("m"), pydantic.AfterValidator(_above_zero)]
Start = Annotated[float, _in("s")]


class Diagnosis(Section):
    """What x and y of a `station` say, by its own angle and speed.

    `kind`: which figure. `start`: from when on the run is looked at (s); left out, all of it for what goes
    over the speed, else its last third. `orders`: per turn, to be marked, tracked or filtered. `clearance`:
    radius (m) of the circle round a centreline. `name`: of the file, without its ending.
    """

    title: str
    kind: Kind
    station: str
    name: str | None = None
    start: Start | None = None
    orders: Orders | None = None
    clearance: Length | None = None

    @property
    def stem(self) -> str:
        """The name of the file without its ending."""
        return file_stem(self.name or self.title)


def file_stem(words: str) -> str:
    return re.sub(r"[^\w.-]+", "_", words).strip("_.").lower()


def check_diagnosis(wanted: Diagnosis, place: str, machine: Machine, faults: Faults) -> None:
    """Whether the machine has the station, and the figure a use for what is given."""
    stations = machine.wiring.stations
    if wanted.station not in stations:
        faults.add(
            place, f'station names none, "{wanted.station}"{guess(wanted.station, stations)}'
        )
    elif not machine.sways(wanted.station):
        faults.add(
            place,
            f'station must move across the axis, but "{wanted.station}" is fixed there: name another one',
        )
    if wanted.clearance is not None and wanted.kind != "centreline":
        faults.add(
            place,
            f'clearance goes with kind = "centreline", but that is "{wanted.kind}": remove it',
        )
    if wanted.orders is not None and wanted.kind in ("centreline", "poincare"):
        faults.add(place, f'orders say nothing to kind = "{wanted.kind}": remove them')
    if wanted.start is not None and wanted.start < 0:
        faults.add(place, f"start must not be negative, but is {wanted.start:g} s: remove it")
