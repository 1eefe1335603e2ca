"""The [torsional] section of a study: what `jaxrotor torsional` looks at."""

import math
from dataclasses import dataclass
from typing import Any

from ..core.errors import InputError
from ..core.units import read, shown
from ..linear.torsion import torque_carriers
from ..machine.machine import Machine
from ..standards.sn_curve import SNCurve
from ..standards.torsional import TorsionalExcitation
from .mistakes import Faults
from .reader import Reader, tables_of

_KEYS = (
    "speeds",
    "line_frequency",
    "orders",
    "mesh",
    "margin",
    "modes",
    "excitations",
    "shafts",
)
_EXCITATION = ("name", "station", "order", "frequency", "torque")
_SHAFT = (
    "name",
    "diameter",
    "inner_diameter",
    "concentration",
    "mean_torque",
    "amplitudes",
    "cycles",
    "ultimate",
    "endless",
    "hours",
    "starts",
)


@dataclass(frozen=True)
class Exciting:
    """An excitation of the user's own; `torque`: amplitude on `station`, N·m, or none."""

    excitation: TorsionalExcitation
    station: str
    torque: float | None


@dataclass(frozen=True)
class StrengthOfShaft:
    """What a shaft stands. `diameter`: m, or `None` for that of a `Shaft`; `hours`, `starts`: wanted, or
    none."""

    name: str
    curve: SNCurve
    diameter: float | None = None
    inner_diameter: float = 0.0
    concentration: float = 1.0
    mean_torque: float = 0.0
    hours: float | None = None
    starts: float | None = None


@dataclass(frozen=True)
class Torsional:
    """What [torsional] asks for, SI. `speeds`: of the driven shaft, or `None`: the drive's own."""

    speeds: tuple[float, float] | None = None
    line_frequency: float | None = None
    orders: tuple[float, ...] = (1.0, 2.0)
    mesh: bool = True
    margin: float = 0.1
    modes: int | None = None
    excitations: tuple[Exciting, ...] = ()
    shafts: tuple[StrengthOfShaft, ...] = ()


def read_torsional(table: Any, machine: Machine) -> Torsional:
    """Raises `InputError` with every fault of the section.

    ```toml
    [torsional]
    speeds = ["1450 rpm", "1500 rpm"]  # of operation, of the driven shaft; left out: the drive's highest
    line_frequency = "50 Hz"         # left out: no line
    orders = [1, 2]                  # of every shaft
    mesh = true                      # whether teeth excite, by the number of teeth of each gear mesh
    margin = 0.1                     # the separation that is asked for
    modes = 4                        # of the lowest; left out: all that some excitation can meet

    [[torsional.excitations]]        # more of them; with a torque the forced response is computed
    name = "impeller vanes"
    station = "pump"                 # whose shaft turns, and on which the torque acts
    order = 5                        # periods a turn of that shaft; or frequency = "100 Hz"
    torque = "12 N*m"                # its amplitude

    [[torsional.shafts]]             # what a shaft, coupling or gear stands
    name = "shaft"
    amplitudes = ["200 MPa", "60 MPa"]   # the S-N curve: of shear stress, or of torque, "4 kN*m"
    cycles = [1e3, 1e7]
    endless = true                   # below the last amplitude no damage; left out: the line goes on
    ultimate = "400 MPa"             # left out: the mean does not count
    diameter = "60 mm"               # for stress; left out: that of a Shaft
    inner_diameter = "0 mm"
    concentration = 1.8              # of the notch
    mean_torque = "250 N*m"          # the steady one
    hours = 20000                    # wanted where the separation is not met
    starts = 5000                    # wanted
    ```
    """
    faults = Faults()
    if not isinstance(table, dict):
        raise InputError(f"`torsional`: must be a table, but is {shown(table)}: write [torsional]")
    faults.unknown_keys("torsional", table, _KEYS)
    ask = Reader(table, "torsional", faults)
    row, speeds = ask.row("speeds", "rad/s", 2), None
    if row is not None:
        speeds = row[0], row[1]
        if not 0 < speeds[0] <= speeds[1]:
            faults.add("torsional", "speeds must be above 0, the lower one first")
    line = ask.positive("line_frequency", "Hz")
    orders = ask.row("orders", "") if "orders" in table else (1.0, 2.0)
    if orders is not None and not all(order > 0 for order in orders):
        faults.add("torsional", "orders must be positive")
    found = Torsional(
        speeds,
        line,
        orders or (),
        ask.flag("mesh", True),
        ask.positive("margin", "", 0.1) or 0.1,
        ask.count("modes"),
        tuple(
            one
            for place, each in tables_of(table, "torsional", "excitations", faults)
            if (one := _excitation(each, place, machine, faults)) is not None
        ),
        tuple(
            one
            for place, each in tables_of(table, "torsional", "shafts", faults)
            if (one := _shaft(each, place, machine, faults)) is not None
        ),
    )
    if faults.sentences:
        raise InputError(*faults.sentences)
    return found


def _excitation(table: dict, place: str, machine: Machine, faults: Faults) -> Exciting | None:
    before = len(faults.sentences)
    faults.unknown_keys(place, table, _EXCITATION)
    ask = Reader(table, place, faults)
    stations = machine.wiring.stations[: len(machine.stations)]
    name, station = ask.name("name"), ask.name("station", stations)
    order, frequency = ask.positive("order", ""), ask.positive("frequency", "Hz")
    if ("order" in table) == ("frequency" in table):
        faults.add(place, "takes an order or a frequency: give one of them")
    torque = ask.positive("torque", "N*m")
    if len(faults.sentences) > before or name is None or station is None:
        return None
    one = TorsionalExcitation(name, order or 0.0, station, 2 * math.pi * (frequency or 0.0))
    return Exciting(one, station, torque)


def _shaft(table: dict, place: str, machine: Machine, faults: Faults) -> StrengthOfShaft | None:
    before = len(faults.sentences)
    faults.unknown_keys(place, table, _SHAFT)
    ask = Reader(table, place, faults)
    name = ask.name("name", tuple(torque_carriers(machine)))
    of, unit = _quantity_of(table.get("amplitudes"))
    amplitudes, cycles = ask.row("amplitudes", unit), ask.row("cycles", "")
    for key, value in (("amplitudes", amplitudes), ("cycles", cycles)):
        if value is None and key not in table:
            faults.add(place, f"{key} is missing: write {key} = [...], the S-N curve")
    ultimate = ask.positive("ultimate", unit)
    endless = ask.flag("endless", False)
    numbers = dict(
        diameter=ask.positive("diameter", "m"),
        inner_diameter=ask.quantity("inner_diameter", "m", 0.0),
        concentration=ask.positive("concentration", "", 1.0),
        mean_torque=ask.quantity("mean_torque", "N*m", 0.0),
        hours=ask.positive("hours", ""),
        starts=ask.positive("starts", ""),
    )
    if len(faults.sentences) > before or name is None or amplitudes is None or cycles is None:
        return None
    try:
        curve = SNCurve(amplitudes, cycles, ultimate, of, endless)
    except InputError as error:
        for problem in error.problems:
            faults.add(place, problem.removeprefix("`SNCurve`: "))
        return None
    return StrengthOfShaft(name, curve, **numbers)


def _quantity_of(amplitudes: Any) -> tuple[Any, str]:
    """Whether an S-N curve is of stress or of torque, by the unit of its first amplitude."""
    first = amplitudes[0] if isinstance(amplitudes, list) and amplitudes else None
    try:
        read(first, "N*m")
    except ValueError:
        return "stress", "Pa"
    return ("torque", "N*m") if isinstance(first, str) else ("stress", "Pa")
