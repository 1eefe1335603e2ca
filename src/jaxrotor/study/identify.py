"""The [identify] section of a study."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.arguments import whole
from ..core.errors import InputError
from ..core.units import read, shown
from ..identification.domain import AbstractDomain, Frequencies, Orders, Time
from ..identification.identify import Stage
from ..identification.loss import LOSSES, Loss
from ..machine.machine import Machine
from ..search.instrumented import Instrumented
from ..search.unknown import Unknown
from ..sensors.channel import AbstractChannel, Channel
from ..sensors.tracking_filter import TrackingFilter
from .build import FAILED, Context, build_element
from .mistakes import Faults, guess
from .unknowns import read_quantity, read_unknown, space_of

_KEYS = (
    "records",
    "responses",
    "sensors",
    "unknowns",
    "stages",
    "turns",
    "orders",
    "iterations",
    "shaft",
    "loss",
    "profile",
)
_STAGES = ("orders", "envelope", "time")


_CHANNELS = {"Channel": Channel, "TrackingFilter": TrackingFilter}


@dataclass(frozen=True)
class Identify:
    """What [identify] asks for."""

    records: tuple[tuple[Path, dict[str, float]], ...]  # with what was different in each run
    responses: tuple[Path, ...]
    sensors: dict[str, AbstractChannel]
    unknowns: tuple[Unknown, ...]
    stages: tuple[Stage, ...]
    shaft: str | None
    loss: Loss
    profile: bool


def read_identify(table: Any, machine: Machine, folder: Path) -> Identify:
    """Raises `InputError` with every fault of the section.

    ```toml
    [identify]
    records = [                            # see jr.read_record; beside the study file
        "run_up.toml",
        { file = "trial.toml", conditions = { "main.unbalance.angle" = "30 deg" } },
    ]
    responses = ["steady.toml"]            # see jr.identification.read_response; either may be left out
    stages = ["orders", "time"]            # also "envelope", { low = "10 Hz", high = "80 Hz" }
    turns = 8                              # of a window of orders and envelope
    orders = [1]
    shaft = "main"                         # station whose angle counts the turns
    loss = "huber"                         # or "student": no spike decides; left out: "squares"
    profile = true                         # figure of how the misfit grows about each parameter

    [identify.sensors.housing]             # named as in the record
    sensor = { kind = "Accelerometer", station = "left", direction = [0, 1, 0] }
    noise = { std = 0.2 }                  # in the unit of the channel; left out: from the residual
                                           # kind = "TrackingFilter" and shaft = "main": vectors

    [[identify.unknowns]]
    path = "main.unbalance.eccentricity"
    start = "0.1 mm"                       # left out: what the machine has
    positive = true                        # or circular = true, or bounds = ["0 mm", "1 mm"]
    ```
    """
    faults = Faults()
    if not isinstance(table, dict):
        raise InputError(f"`identify`: must be a table, but is {shown(table)}: write [identify]")
    meant = faults.unknown_keys("identify", table, _KEYS)
    if table.get("responses"):
        meant.add("records")
    for key, words in (
        ("records", 'records = ["run_up.toml"], or responses'),
        ("sensors", "[identify.sensors.NAME] tables"),
        ("unknowns", "[[identify.unknowns]] tables with a path"),
    ):
        if not table.get(key) and key not in meant:
            faults.add("identify", f"{key} is missing: write {words}")
    records = [
        _record(one, f"identify.records, entry {i + 1}", machine, folder, faults)
        for i, one in enumerate(_listed(table, "records", faults))
    ]
    responses = _listed(table, "responses", faults)
    for one in responses:
        if not isinstance(one, str):
            faults.add("identify.responses", f"must be names of files, but one is {shown(one)}")
    sensors = {}
    given = table.get("sensors", {})
    for name, one in (given if isinstance(given, dict) else {}).items():
        place = f"identify.sensors.{name}"
        if not isinstance(one, dict):
            faults.add(place, f"must be a table, but is {shown(one)}: give it sensor = {{ ... }}")
            continue
        kind = one.get("kind", "Channel")
        if kind not in _CHANNELS:
            faults.add(place, f"kind names no channel {shown(kind)}{guess(kind, tuple(_CHANNELS))}")
            continue
        told = {key: value for key, value in one.items() if key != "kind"}
        channel = build_element(_CHANNELS[kind], told, Context(faults, place, folder))
        if channel is not FAILED:
            sensors[name] = channel
    stages = _stages(table, faults)
    shaft = table.get("shaft")
    if shaft is not None and shaft not in machine.wiring.stations:
        faults.add(
            "identify",
            f"shaft names no station {shown(shaft)}{guess(shaft, machine.wiring.stations)}",
        )
    loss = table.get("loss", "squares")
    if loss not in LOSSES:
        faults.add(
            "identify",
            f"loss must be one of the known, but is {shown(loss)}{guess(loss, LOSSES)}",
        )
    profile = table.get("profile", True)
    if not isinstance(profile, bool):
        faults.add("identify", f"profile must be true or false, but is {shown(profile)}")
    unknowns = []
    if not faults.sentences:
        bench = _bench(machine, sensors, faults)
        for i, one in enumerate(table["unknowns"]):
            unknowns.append(read_unknown(one, f"identify.unknowns, entry {i + 1}", bench, faults))
    if not faults.sentences:
        space_of(bench, tuple(unknowns), "identify.unknowns", faults)
    if faults.sentences:
        raise InputError(*faults.sentences)
    files = tuple(folder / one for one in responses)
    return Identify(tuple(records), files, sensors, tuple(unknowns), stages, shaft, loss, profile)


def _bench(machine: Machine, sensors: dict[str, AbstractChannel], faults: Faults) -> Instrumented:
    """Whose sensors find what they look at."""
    try:
        bench = Instrumented(machine, sensors)
        bench.check()
    except InputError as error:
        faults.sentences += [f"`identify.sensors`: {p}" for p in error.problems]
        return Instrumented(machine, {})
    return bench


def _listed(table: dict, key: str, faults: Faults) -> list[Any]:
    given = table.get(key, [])
    if isinstance(given, list):
        return given
    faults.add("identify", f"{key} must be a list, but is {shown(given)}")
    return []


def _record(given: Any, place: str, machine: Machine, folder: Path, faults: Faults):
    told = {"file": given} if isinstance(given, str) else given
    if not isinstance(told, dict) or not isinstance(told.get("file"), str):
        faults.add(
            place,
            f'must be a file\'s name or {{ file = "...", conditions = {{ ... }} }}, but is {shown(given)}',
        )
        return folder, {}
    faults.unknown_keys(place, told, ("file", "conditions"))
    conditions = told.get("conditions", {})
    if not isinstance(conditions, dict):
        faults.add(place, f"conditions must be a table of path = value, but is {shown(conditions)}")
        return folder, {}
    found = {}
    for path, value in conditions.items():
        try:
            units = machine.units(path)
        except InputError as error:
            faults.sentences += [f"`{place}`: {p}" for p in error.problems]
            continue
        found[path] = read_quantity(value, units[0], f"{place}: {path}", faults)
    return folder / told["file"], found


def _stages(table: dict, faults: Faults) -> tuple[Stage, ...]:
    try:
        iterations = whole(1)(table.get("iterations", 20), "iterations")
    except InputError as error:
        faults.add("identify", f"{error}: correct it")
        return ()
    found: list[AbstractDomain] = []
    for one in _listed({"stages": ["time"]} | table, "stages", faults):
        try:
            if one == "time":
                found.append(Time())
            elif one in ("orders", "envelope"):
                orders, turns = table.get("orders", [1]), table.get("turns", 8)
                found.append(Orders(orders, turns, envelope=one == "envelope"))
            elif isinstance(one, dict) and set(one) == {"low", "high"}:
                found.append(Frequencies(read(one["low"], "Hz"), read(one["high"], "Hz")))
            else:
                faults.add(
                    "identify",
                    f'stages must be "orders", "envelope", "time" or {{ low = "...", high = "..." }}, but '
                    f"one is {shown(one)}{guess(one, _STAGES)}",
                )
        except InputError as error:
            faults.sentences += [f"`identify.stages`: {p}" for p in error.problems]
        except ValueError as error:
            faults.add("identify.stages", f"low and high {error}")
    return tuple(Stage(domain, iterations) for domain in found)
