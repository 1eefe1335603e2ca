"""The JSON Schema of studies, by which editors complete keys, tell units and mark what is misspelt."""

from typing import Any, get_args

from ..core.kinematics import COORDINATES
from ..core.protocol import (
    AbstractAttachment,
    AbstractConnector,
    AbstractElement,
    AbstractStation,
)
from ..core.version import installed_version
from ..elements.shafts.finite import FiniteElementShaft
from ..identification.loss import LOSSES
from ..profiles.motion import AbstractMotion
from ..sensors.channel import Channel
from ..sensors.tracking_filter import TrackingFilter
from ..sweeps.outputs import OverSpeed, TimeSeries
from .cases import _METHODS
from .diagnosis import KINDS as DIAGNOSES
from .machine import COEFFICIENTS
from .measures import MEASURES
from .profile import OPTIONS as PROFILE_OPTIONS
from .read_standards import _LIMITS
from .schema_parts import Definitions, Schema, closed, listed, quantity
from .settings import Automatic, SimulationSection
from .spread import _KINDS as DISTRIBUTIONS

TEXT: Schema = {"type": "string"}
FLAG: Schema = {"type": "boolean"}
COUNT: Schema = {"type": "integer", "minimum": 1}
WHOLE: Schema = {"type": "integer", "minimum": 0}
NUMBER: Schema = {"type": "number"}
# Of a parameter that the path names: its unit is known to the reader alone.
ANY: Schema = {"type": ["string", "number"], "description": "a quantity in the parameter's unit"}
NAMES = listed(TEXT)
PATH: Schema = {
    "type": "string",
    "description": 'a parameter of the machine, such as "main.unbalance.eccentricity"',
}
FACTORS: Schema = {"type": "object", "additionalProperties": NUMBER}


def schema() -> dict[str, Any]:
    """The whole of it, in plain values (JSON Schema, draft 7)."""
    parts = Definitions()
    sections = {
        "title": {**TEXT, "description": "what the results are headed with"},
        "source": {**TEXT, "description": "where the machine and its numbers come from"},
        "machine": _machine(parts),
        "simulation": _simulation(),
        "report": closed(
            {
                "main": {**TEXT, "description": "the station in the foreground"},
                "figures": listed({"enum": list(get_args(Automatic))}),
            },
            words="what the automatic figures of a run show",
        ),
        "figures": listed({"anyOf": [_figure(), _diagnosis()]}),
        "identify": _identify(parts),
        "optimize": _optimize(parts),
        "sweep": _sweep(parts),
        "torsional": _torsional(),
        "standards": _standards(),
    }
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"A study of jaxrotor {installed_version()}",
        **closed(sections, ["machine"]),
        "$defs": parts.found,
    }


def _coefficients(more: Schema, needed: list[str]) -> Schema:
    words = (
        "a support from a table of coefficients beside the study, by its columns' names and units"
    )
    units = {"type": "object", "additionalProperties": TEXT}
    own = {"kind": {"const": COEFFICIENTS}, "file": TEXT, "units": units}
    return {**closed({**more, **own}, ["kind", "file", *needed]), "description": words}


def _machine(parts: Definitions) -> Schema:
    name = {"name": {**TEXT, "description": "without a dot"}}
    position = {"position": quantity("m", "where a station stands on the profile")}
    at = {"anyOf": [TEXT, NAMES], "description": "the station it acts on; or two"}
    line = parts.kinds((AbstractStation, AbstractConnector), {**name, **position}, ["name"])
    loads = parts.kinds(AbstractAttachment, {**name, "at": at}, ["name", "at"])
    element = parts.kinds(AbstractElement)
    loads["anyOf"].append(_coefficients({**name, "at": at}, ["name", "at"]))
    element["anyOf"].append(_coefficients({}, []))
    coordinates: Schema = {"enum": list(COORDINATES)}
    motions = {c: parts.nested(AbstractMotion, _motion(c)) for c in COORDINATES}
    reduced = closed(
        {"up_to": quantity("Hz"), "tolerance": NUMBER, "speed": quantity("rad/s")}, ["up_to"]
    )
    return closed(
        {
            "line": {**listed(line, 1), "description": "the machine, from left to right"},
            "attachments": listed(loads),
            "profile": _profile(parts),
            "elements": _each(element, "parts by name, joined by connections"),
            "connections": _each({"anyOf": [TEXT, NAMES]}, "part -> the stations that it joins"),
            "gravity": {**listed(quantity("m/s^2")), "minItems": 3, "maxItems": 3},
            "fixed": _each(listed(coordinates), "station -> coordinates that stay zero"),
            "prescribed": _each(closed(motions), "station -> coordinates that are given in time"),
            "reduce": {"anyOf": [{"const": False}, reduced]},
        },
    )


def _profile(parts: Definitions) -> Schema:
    options = parts.properties(FiniteElementShaft)
    row = listed({"type": ["string", "number"]}, 2)
    own = {
        "name": {**TEXT, "description": "of the pieces of shaft: shaft, unless it is given"},
        "file": {**TEXT, "description": "CSV with columns position [mm], diameter [mm], bore [mm]"},
        "rows": {
            **listed(row, 2),
            "description": "[position, diameter] or [position, diameter, bore]",
        },
        "unit": {**TEXT, "description": "of bare numbers in rows, and of columns without one"},
        "between": {"enum": ["cones", "cylinders"], "description": "what stands between two rows"},
        "longest": quantity("m", "no section longer than"),
    }
    rest = {key: options[key] for key in PROFILE_OPTIONS if key in options}
    return closed(
        {**own, **rest}, words="a shaft from its drawing's table, between the line's stations"
    )


def _motion(coordinate: str) -> Any:
    from ..core.declared import Within

    return Within(length=coordinate in "xyz")


def _each(item: Schema, words: str = "") -> Schema:
    """A table of tables by names that nobody knows beforehand."""
    return {"type": "object", "additionalProperties": item, "description": words}


def _simulation() -> Schema:
    units = {"t_end": "s", "sample_rate": "Hz", "speed": "rad/s", "step": "s"}
    found: Schema = {}
    for key, field in SimulationSection.model_fields.items():
        choices = _choices(field.annotation)
        found[key] = quantity(units.get(key, "")) if not choices else {"enum": choices}
    return closed(found, ["t_end", "sample_rate"], "how the machine is run")


def _choices(annotation: Any) -> list[Any]:
    found: list[Any] = []
    for arg in get_args(annotation):
        found += _choices(arg) if get_args(arg) else [] if isinstance(arg, type) else [arg]
    return [c for c in found if isinstance(c, (str, int)) and not isinstance(c, bool)]


def _figure() -> Schema:
    quantities = {"type": "string", "description": '"part.quantity", such as "main.x"'}
    return closed(
        {
            "title": TEXT,
            "y": listed(quantities, 1),
            "x": {"type": "string", "description": '"t", or "part.quantity"'},
            "name": TEXT,
            "units": NAMES,
        },
        ["title", "y"],
        "quantities over time or over each other",
    )


def _diagnosis() -> Schema:
    return closed(
        {
            "title": TEXT,
            "kind": {"enum": list(DIAGNOSES)},
            "station": TEXT,
            "name": TEXT,
            "start": quantity("s"),
            "orders": listed(NUMBER, 1),
            "clearance": quantity("m"),
        },
        ["title", "kind", "station"],
        "what x and y of a station say",
    )


def _unknown(prior: bool) -> Schema:
    pair = {**listed(ANY), "minItems": 2, "maxItems": 2}
    more = {"prior": pair} if prior else {}
    return closed(
        {
            "path": PATH,
            "start": ANY,
            "positive": FLAG,
            "circular": FLAG,
            "bounds": pair,
            "scale": ANY,
            "also": FACTORS,
            **more,
        },
        ["path"],
    )


def _identify(parts: Definitions) -> Schema:
    record = {
        "anyOf": [
            TEXT,
            closed({"file": TEXT, "conditions": _each(ANY)}, ["file"]),
        ]
    }
    band = closed({"low": quantity("Hz"), "high": quantity("Hz")}, ["low", "high"])
    channel = parts.nested(Channel, _alone())
    tracking = {
        "allOf": [
            {"type": "object", "properties": {"kind": {"const": "TrackingFilter"}}, "required": ["kind"]},
            parts.kinds(TrackingFilter),
        ]
    }  # fmt: skip
    return closed(
        {
            "records": listed(record),
            "responses": NAMES,
            "sensors": _each({"anyOf": [channel, tracking]}, "named as in the record"),
            "unknowns": listed(_unknown(prior=True), 1),
            "stages": listed({"anyOf": [{"enum": ["orders", "envelope", "time"]}, band]}),
            "turns": NUMBER,
            "orders": listed(NUMBER),
            "iterations": COUNT,
            "shaft": TEXT,
            "loss": {"enum": list(LOSSES)},
            "profile": FLAG,
        },
        ["sensors", "unknowns"],
        "parameters from measured runs: jaxrotor identify",
    )


def _alone() -> Any:
    from ..core.declared import ALONE

    return ALONE


def _optimize(parts: Definitions) -> Schema:
    measure = parts.kinds(MEASURES)
    over = {"enum": ["worst", "mean"]}
    limits = {"at_most": ANY, "at_least": ANY, "equal_to": ANY}
    optimiser = {"type": "object", "properties": {"kind": TEXT}, "required": ["kind"]}
    variations = {"spread": NUMBER, "count": COUNT, "seed": WHOLE, "paths": listed(PATH)}
    return closed(
        {
            "unknowns": listed(_unknown(prior=False), 1),
            "objective": listed(
                closed({"measure": measure, "weight": NUMBER, "over": over}, ["measure"]), 1
            ),
            "constraints": listed(
                closed({"measure": measure, "over": over, **limits}, ["measure"])
            ),
            "starts": listed(_each(ANY)),
            "variations": closed(variations),
            "iterations": COUNT,
            "tolerance": NUMBER,
            "optimiser": optimiser,
        },
        ["unknowns", "objective"],
        "the best design under constraints: jaxrotor optimize",
    )


def _sweep(parts: Definitions) -> Schema:
    distributions = [
        closed({"kind": {"const": kind}, **{k: ANY for k in (*needed, *more)}}, ["kind", *needed])
        for kind, (needed, more, _) in DISTRIBUTIONS.items()
    ]
    grid = {"from": ANY, "to": ANY, "points": COUNT}
    parameter = closed(
        {
            "path": PATH,
            "distribution": {"anyOf": distributions},
            "values": listed(ANY, 1),
            "also": FACTORS,
            **grid,
        },
        ["path"],
    )
    output = parts.kinds((*MEASURES, TimeSeries, OverSpeed), {"at_most": ANY, "at_least": ANY})
    for choice in output["anyOf"]:  # edges also as from, to and points
        edges = choice["properties"].get("edges")
        if edges is not None:
            choice["properties"]["edges"] = {"anyOf": [edges, closed(grid, list(grid))]}
    table = {
        "file": TEXT,
        "units": {"type": "object", "additionalProperties": TEXT},
        "ignore": NAMES,
    }
    pair = {**listed(PATH), "minItems": 2, "maxItems": 2}
    return closed(
        {
            "count": COUNT,
            "method": {"enum": list(_METHODS)},
            "seed": WHOLE,
            "chunk": COUNT,
            "parameters": listed(parameter, 1),
            "correlations": listed(closed({"paths": pair, "value": NUMBER}, ["paths", "value"])),
            "table": closed(table, ["file"]),
            "outputs": _each(output, "what is kept of each run, by name"),
        },
        ["outputs"],
        "one machine many times over: jaxrotor sweep",
    )


def _torsional() -> Schema:
    excitation = {
        "name": TEXT,
        "station": TEXT,
        "order": NUMBER,
        "frequency": quantity("Hz"),
        "torque": quantity("N*m"),
    }
    shaft = {
        "name": TEXT,
        "amplitudes": listed(TEXT, 2),
        "cycles": listed(NUMBER, 2),
        "endless": FLAG,
        "ultimate": TEXT,
        "diameter": quantity("m"),
        "inner_diameter": quantity("m"),
        "concentration": NUMBER,
        "mean_torque": quantity("N*m"),
        "hours": NUMBER,
        "starts": NUMBER,
    }
    return closed(
        {
            "speeds": _pair("rad/s"),
            "line_frequency": quantity("Hz"),
            "orders": listed(NUMBER),
            "mesh": FLAG,
            "margin": NUMBER,
            "modes": COUNT,
            "excitations": listed(closed(excitation, ["name", "station"])),
            "shafts": listed(closed(shaft, ["name", "amplitudes", "cycles"])),
        },
        words="torsional analysis: jaxrotor torsional",
    )


def _pair(unit: str) -> Schema:
    return {**listed(quantity(unit)), "minItems": 2, "maxItems": 2}


def _standards() -> Schema:
    limits = {key: quantity("m") if key == "probe" else NUMBER for key in _LIMITS}
    wheel = {
        "station": TEXT,
        "power": quantity("W"),
        "diameter": quantity("m"),
        "height": quantity("m"),
        "density_ratio": NUMBER,
        "constant": NUMBER,
    }
    stability = {
        "stations": {"anyOf": [TEXT, FACTORS]},
        "cross_coupling": quantity("N/m"),
        "wheels": listed(closed(wheel, ["station", "power", "diameter", "height"])),
        "density": quantity("kg/m^3"),
        "without": NAMES,
        "level_two": FLAG,
        "turbine": FLAG,
        "least_ratio": NUMBER,
        "least_decrement": NUMBER,
        "screened_ratio": NUMBER,
    }
    balance = {
        "grade": NUMBER,
        "speed": quantity("rad/s"),
        "planes": NAMES,
        "residual": listed(quantity("kg*m")),
    }
    vibration = {
        "kind": {"enum": ["shaft", "housing"]},
        "place": TEXT,
        "value": TEXT,
        "accepted": {"enum": ["A", "B", "C"]},
        "group": {"enum": ["1", "2"]},
        "support": {"enum": ["rigid", "flexible"]},
        "limits": listed(TEXT),
    }
    loop = {
        "name": TEXT,
        "speed": quantity("rad/s"),
        "accepted": {"enum": ["A", "B", "C"]},
        "signal": TEXT,
        "acts_on": TEXT,
        "against": TEXT,
        "limits": listed(NUMBER),
    }
    return closed(
        {
            "speeds": _pair("rad/s"),
            "probes": NAMES,
            "unbalance": _each({"anyOf": [quantity("kg*m"), NAMES]}),
            "bearings": NAMES,
            "modes": COUNT,
            "trip": quantity("rad/s"),
            "clearances": _each(quantity("m")),
            "films": _each(_pair("m")),
            "state": {"enum": ["equilibrium", "undeformed"]},
            "limits": closed(limits),
            "stability": closed(stability),
            "balance": closed(balance),
            "vibration": listed(closed(vibration, ["place"])),
            "magnetic": listed(closed(loop, ["name"])),
        },
        ["speeds"],
        "checks of API and ISO: jaxrotor assess",
    )
