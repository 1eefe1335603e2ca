"""Reads the [standards] section."""

import re
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.units import read, shown
from ..linear.coordinates import coordinate_order
from ..linear.loops import AXES, magnetic_bearings
from ..machine.machine import Machine
from ..standards.placed import own_unbalance
from ..standards.stability import anticipated_cross_coupling
from .mistakes import Faults, guess
from .reader import Reader, tables_of
from .standards import Balance, Limits, Loop, Stability, Standards, Vibration

_KEYS = (
    "speeds", "probes", "unbalance", "bearings", "modes", "trip", "clearances", "films", "state",
    "limits", "stability", "balance", "vibration", "magnetic",
)  # fmt: skip
_LIMITS = ("most_below", "most_above", "least_factor", "probe", "share", "scale")
_STABILITY = (
    "stations", "cross_coupling", "wheels", "density", "without", "level_two", "turbine",
    "least_ratio", "least_decrement", "screened_ratio",
)  # fmt: skip
_WHEEL = ("station", "power", "diameter", "height", "density_ratio", "constant")
_BALANCE = ("grade", "speed", "planes", "residual")
_VIBRATION = ("kind", "place", "value", "accepted", "group", "support", "limits")
_LOOP = ("name", "speed", "accepted", "signal", "acts_on", "against", "limits")


def read_standards(table: Any, machine: Machine) -> Standards:
    """Raises `InputError` with every fault of the section. Only what it names is assessed.

    ```toml
    [standards]
    speeds = ["4500 rpm", "7500 rpm"]     # least and greatest of service; one machine speed: twice the same
    probes = ["disc.x", "disc at 45 deg"] # or "disc", its orbit's long half axis: resonances, margins, A_vl
    unbalance = { disc = "100 g*mm" }     # or ["100 g*mm", "90 deg"]; left out: by mode shape, 2 x 6350 W/N
    bearings = ["b1", "b2"]               # the journals, for mode shapes; left out: the two supports
    modes = 2                             # so many critical speeds have an unbalance placed
    trip = "8000 rpm"                     # clearances are looked at up to it; left out: the greatest
    clearances = { left = "0.3 mm" }      # diametral, at stations; films have their own
    films = { b1 = ["0.1 mm", "0.14 mm"] } # least and greatest radial clearance: both machines are looked at
    state = "undeformed"                  # linear about it; left out: "equilibrium"
    limits = { most_below = 16, most_above = 26, least_factor = 2.5, share = 0.75 }  # probe, scale

    [standards.stability]
    stations = "disc"                     # of the cross coupling, or { a = 0.6, b = 0.4 }; left out: wheels'
    cross_coupling = "1e5 N/m"            # Q_A; or wheels:
    wheels = [{ station = "disc", power = "1 MW", diameter = "0.5 m", height = "20 mm", density_ratio = 1.5 }]
    density = "20 kg/m^3"                 # mean of the gas; left out: no screening by it
    without = ["seal 1"]                  # left out at level 1
    level_two = true
    least_ratio = 2                       # limits, with least_decrement = 0.1, screened_ratio = 10
    turbine = false                       # the log decrement at Q_A alone

    [standards.balance]
    grade = 2.5                           # mm/s
    speed = "7500 rpm"                    # left out: the greatest
    planes = ["left", "right"]            # stations; left out: the whole rotor
    residual = ["80 g*mm", "60 g*mm"]     # left out: what the rotors have

    [[standards.vibration]]
    kind = "shaft"                        # or "housing"
    place = "disc"                        # a station; of a housing a coordinate, "pedestal.x"
    value = "60 um"                       # measured: pp, RMS ("2 mm/s") of a housing; left out: computed
    accepted = "B"                        # with group = "1", support = "rigid" of a housing

    [[standards.magnetic]]
    name = "loop"                         # or "bearing.v", an axis of a MagneticBearing; of a part of
                                          # your own with signal = "force", acts_on = "disc.x"
    speed = "7500 rpm"                    # left out: the greatest
    accepted = "A"                        # with limits = [3, 4, 5]
    ```
    """
    faults = Faults()
    if not isinstance(table, dict):
        raise InputError(f"`standards`: must be a table, but is {shown(table)}: write [standards]")
    faults.unknown_keys("standards", table, _KEYS)
    ask = Reader(table, "standards", faults)
    stations = machine.wiring.stations
    row = ask.row("speeds", "rad/s", 2)
    if "speeds" not in table:
        faults.add("standards", 'speeds is missing: write speeds = ["4500 rpm", "7500 rpm"]')
    elif row is not None and not 0 < row[0] <= row[1]:
        faults.add("standards", "speeds must be above 0, the lower one first")
        row = None
    speeds = (row[0], row[1]) if row is not None else (1.0, 1.0)
    trip = ask.positive("trip", "rad/s")
    if trip is not None and row is not None and trip < speeds[1]:
        faults.add("standards", "trip must not lie below the greatest speed")
    found = Standards(
        speeds,
        _probes(table, machine, faults),
        _unbalance(ask, stations),
        _bearings(ask, machine),
        ask.count("modes") or 2,
        trip,
        _amounts(ask, "clearances", "m", stations),
        _films(ask, machine),
        ask.choice("state", ("equilibrium", "undeformed"), "equilibrium"),
        _limits(table, faults),
        _stability(table, machine, speeds[1], faults),
        _balance(table, machine, speeds[1], faults),
        tuple(
            one
            for place, each in tables_of(table, "standards", "vibration", faults)
            if (one := _vibration(each, place, machine, faults)) is not None
        ),
        tuple(
            one
            for place, each in tables_of(table, "standards", "magnetic", faults)
            if (one := _loop(each, place, machine, speeds[1], faults)) is not None
        ),
    )
    if "probes" not in table:
        for key in ("clearances", "films", "limits", "trip"):
            if key in table:
                faults.add("standards", f'{key} goes with probes: write probes = ["disc.x"]')
    if faults.sentences:
        raise InputError(*faults.sentences)
    return found


def _coordinates(machine: Machine) -> tuple[str, ...]:
    return tuple(f"{s}.{c}" for s, c in coordinate_order(machine)[3])


def _probes(table: dict, machine: Machine, faults: Faults) -> tuple[Any, ...]:
    given = table.get("probes", [])
    if not isinstance(given, list) or not all(isinstance(x, str) for x in given):
        faults.add(
            "standards", f'probes must be a list of texts, but is {shown(given)}: write ["disc.x"]'
        )
        return ()
    known, free = machine.wiring.stations, _coordinates(machine)
    found = []
    for text in given:
        turned = re.fullmatch(r"(.*\S)\s+at\s+(.+)", text)
        station = turned[1] if turned else text
        if turned is not None and station in known:
            try:
                found.append((station, float(read(turned[2], "rad"))))
            except ValueError as error:
                faults.add("standards", f'probes: the angle of "{text}" {error}')
        elif text in free or text in known:
            found.append(text)
        else:
            near = (*known, *(c for c in free if c.endswith((".x", ".y"))))
            faults.add(
                "standards", f'probes names no station or coordinate "{text}"{guess(text, near)}'
            )
    return tuple(found)


def _unbalance(ask: Reader, stations: tuple[str, ...]) -> dict[str, tuple[float, float]] | None:
    if "unbalance" not in ask.table:
        return None
    found = {}
    for station, given in ask.mapping("unbalance", stations).items():
        pair = given if isinstance(given, list) else [given, "0 rad"]
        try:
            if len(pair) != 2:
                raise ValueError(f"must be an amount and an angle, but has {len(pair)} entries")
            found[station] = float(read(pair[0], "kg*m")), float(read(pair[1], "rad"))
        except ValueError as error:
            ask.faults.add(ask.place, f'unbalance of "{station}" {error}')
    return found


def _amounts(ask: Reader, key: str, unit: str, known: tuple[str, ...]) -> dict[str, float]:
    found = {}
    for name, given in ask.mapping(key, known).items():
        try:
            found[name] = float(read(given, unit))
            if not found[name] > 0:
                raise ValueError(f"must be positive, but is {shown(given)}")
        except ValueError as error:
            ask.faults.add(ask.place, f'{key} of "{name}" {error}')
    return found


def _films(ask: Reader, machine: Machine) -> dict[str, tuple[float, float]]:
    films = tuple(n for n, e in machine.elements().items() if hasattr(e, "clearance"))
    found = {}
    for name, given in ask.mapping("films", films).items():
        row = Reader({"films": given}, f'{ask.place}, films of "{name}"', ask.faults).row(
            "films", "m", 2
        )
        if row is not None and not 0 < row[0] <= row[1]:
            ask.faults.add(ask.place, f'films of "{name}" must be above 0, the lower one first')
        elif row is not None:
            found[name] = row[0], row[1]
    return found


def _bearings(ask: Reader, machine: Machine) -> tuple[str, ...] | None:
    if "bearings" not in ask.table:
        return None
    found = ask.names("bearings", (*machine.connections(), *machine.wiring.stations))
    if found is not None and len(found) != 2:
        ask.faults.add(ask.place, f"bearings must be the two journals, but are {len(found)}")
    return found


def _limits(table: dict, faults: Faults) -> Limits:
    inside = _table(table, "limits", faults)
    if inside is None:
        return Limits()
    faults.unknown_keys("standards.limits", inside, _LIMITS)
    ask = Reader(inside, "standards.limits", faults)
    given = {
        key: ask.positive(key, "m" if key == "probe" else "") for key in _LIMITS if key in inside
    }
    return Limits(**{key: value for key, value in given.items() if value is not None})


def _table(table: dict, key: str, faults: Faults) -> dict | None:
    given = table.get(key)
    if given is not None and not isinstance(given, dict):
        faults.add(
            "standards", f"{key} must be a table, but is {shown(given)}: write [standards.{key}]"
        )
        return None
    return given


def _stability(table: dict, machine: Machine, speed: float, faults: Faults) -> Stability | None:
    inside = _table(table, "stability", faults)
    if inside is None:
        return None
    place, before = "standards.stability", len(faults.sentences)
    faults.unknown_keys(place, inside, _STABILITY)
    ask = Reader(inside, place, faults)
    known = machine.wiring.stations
    each: dict[str, float] = {}
    for where, wheel in tables_of(inside, place, "wheels", faults):
        station, amount = _wheel(wheel, where, known, speed, faults)
        each[station] = each.get(station, 0.0) + amount
    given = inside.get("stations")
    given = {given: 1.0} if isinstance(given, str) else given
    if given is not None:
        given = Reader({"stations": given}, place, faults).numbers("stations", known)
    coupling = ask.positive("cross_coupling", "N/m")
    if ("cross_coupling" in inside) == bool(inside.get("wheels")):
        faults.add(place, "takes cross_coupling or wheels: give one of them")
    if given is None and not each and "wheels" not in inside:
        faults.add(
            place, 'stations is missing: write stations = "disc", where the cross coupling acts'
        )
    found = Stability(
        given or each,
        coupling or sum(each.values()),
        ask.positive("density", "kg/m^3"),
        ask.names("without", machine.wiring.connectors) or (),
        ask.flag("level_two", True),
        ask.flag("turbine", False),
        ask.positive("least_ratio", "", 2.0) or 2.0,
        ask.quantity("least_decrement", "", 0.1) or 0.0,
        ask.positive("screened_ratio", "", 10.0) or 10.0,
    )
    return found if len(faults.sentences) == before else None


def _wheel(
    wheel: dict, where: str, known: tuple[str, ...], speed: float, faults: Faults
) -> tuple[str, float]:
    before = len(faults.sentences)
    faults.unknown_keys(where, wheel, _WHEEL)
    ask = Reader(wheel, where, faults)
    station = ask.name("station", known)
    for key, example in (("power", "1 MW"), ("diameter", "500 mm"), ("height", "20 mm")):
        if key not in wheel:
            faults.add(where, f'{key} is missing: write {key} = "{example}"')
    size = [ask.positive("power", "W"), ask.positive("diameter", "m"), ask.positive("height", "m")]
    ratio, constant = ask.positive("density_ratio", "", 1.0), ask.positive("constant", "", 3.0)
    if station is None or len(faults.sentences) > before:
        return "", 0.0
    power, diameter, height = size
    amount = anticipated_cross_coupling(power, speed, diameter, height, ratio, constant)
    return station, float(np.asarray(amount))


def _balance(table: dict, machine: Machine, speed: float, faults: Faults) -> Balance | None:
    inside = _table(table, "balance", faults)
    if inside is None:
        return None
    place, before = "standards.balance", len(faults.sentences)
    faults.unknown_keys(place, inside, _BALANCE)
    ask = Reader(inside, place, faults)
    planes = ask.names("planes", machine.wiring.stations)
    if planes is not None and len(planes) != 2:
        faults.add(place, f"planes must be two stations, but are {len(planes)}")
    residual = ask.row("residual", "kg*m", 1 if planes is None else 2)
    if "residual" not in inside and not _has_unbalance(machine):
        faults.add(
            place,
            'residual is missing, and the rotors have no unbalance: write residual = ["80 g*mm"]',
        )
    grade = ask.positive("grade", "", 2.5)
    service = ask.positive("speed", "rad/s", speed)
    if len(faults.sentences) > before:
        return None
    pair = None if planes is None else (planes[0], planes[1])
    return Balance(grade, service, pair, residual)


def _has_unbalance(machine: Machine) -> bool:
    try:
        own_unbalance(machine)
    except InputError:
        return False
    return True


def _vibration(table: dict, place: str, machine: Machine, faults: Faults) -> Vibration | None:
    before = len(faults.sentences)
    faults.unknown_keys(place, table, _VIBRATION)
    ask = Reader(table, place, faults)
    kind = ask.choice("kind", ("shaft", "housing"), "shaft")
    shaft = kind == "shaft"
    where = ask.name("place", machine.wiring.stations if shaft else _coordinates(machine))
    value = ask.positive("value", "m" if shaft else "m/s")
    row = ask.row("limits", "m" if shaft else "m/s", 3)
    found = Vibration(
        kind, where or "", value, ask.choice("accepted", ("A", "B", "C"), "B"),
        ask.choice("group", ("1", "2"), "1"), ask.choice("support", ("rigid", "flexible"), "rigid"), row,
    )  # fmt: skip
    return found if len(faults.sentences) == before else None


def _loop(table: dict, place: str, machine: Machine, speed: float, faults: Faults) -> Loop | None:
    before = len(faults.sentences)
    faults.unknown_keys(place, table, _LOOP)
    ask = Reader(table, place, faults)
    axes = (f"{name}.{axis}" for name in magnetic_bearings(machine) for axis in AXES)
    name = ask.name("name", (*machine.elements(), *axes))
    at = ask.quantity("speed", "rad/s", speed)
    texts = {
        key: ask.name(key) if key in table else None for key in ("signal", "acts_on", "against")
    }
    limits = ask.row("limits", "", 3) or (3.0, 4.0, 5.0)
    accepted = ask.choice("accepted", ("A", "B", "C"), "A")
    if len(faults.sentences) > before or name is None:
        return None
    return Loop(name, at, accepted, limits=limits, **texts)
