"""The [optimize] section of a study."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ..core.arguments import LARGEST, MANY, whole
from ..core.errors import InputError
from ..core.units import shown
from ..machine.machine import Machine
from ..objectives.criterion import Constraint, Criterion
from ..optimization.variations import Variations
from ..search.instrumented import Instrumented
from ..search.space import place_of
from ..search.unknown import Unknown, expanded
from ..simulation.simulation import Simulation
from .criteria import CriteriaReader
from .mistakes import Faults, guess
from .optimisers import read_optimiser
from .unknowns import read_quantity, read_unknown, space_of

_KEYS = (
    "unknowns",
    "objective",
    "constraints",
    "starts",
    "variations",
    "iterations",
    "tolerance",
    "optimiser",
)
_VARIATIONS = ("spread", "count", "seed", "paths")


@dataclass(frozen=True)
class Optimize:
    """What [optimize] asks for: arguments of `jr.optimize`."""

    unknowns: tuple[Unknown, ...]
    objective: Criterion
    constraints: tuple[Constraint, ...]
    starts: tuple[dict[str, float], ...]
    options: dict[str, Any]


def read_optimize(table: Any, machine: Machine, settings: Simulation, folder: Path) -> Optimize:
    """Raises `InputError` with every fault of the section. Runs last as [simulation] says.

    ```toml
    [optimize]
    iterations = 200                 # evaluations of each search at most
    tolerance = 1e-8                 # on slopes and bounds, scaled
    starts = [{ "damper.stiffness" = "80 N*m/rad" }]     # of further searches
    optimiser = { kind = "adam", learning_rate = 0.02 }  # of optax, `iterations` steps in each round of the
                                                         # multipliers; left out: BFGS

    [[optimize.unknowns]]            # a list, such as a controller's gains, stands for each of its entries
    path = "damper.stiffness"
    start = "60 N*m/rad"             # left out: what the machine has
    positive = true                  # or circular = true, or bounds = ["10 N*m/rad", "200 N*m/rad"]

    [[optimize.objective]]           # made small; several are summed
    measure = { kind = "PeakValue", sensor = { kind = "Twist", first = "motor", second = "fan" } }
    weight = 1.0                     # per unit of the measure; negative: made large
    over = "worst"                   # or "mean", of the machines of [optimize.variations]

    [[optimize.constraints]]
    measure = { kind = "PeakValue", sensor = { kind = "Signal", element = "loop", name = "torque" } }
    at_most = "5 N*m"                # or at_least, or equal_to

    [optimize.variations]            # machines about the design, all of which are judged
    spread = 0.2                     # of each parameter, up and down, evenly
    count = 50
    seed = 0
    paths = ["main.mass"]            # left out: every parameter that is not zero, but gravity
    ```
    """
    faults = Faults()
    if not isinstance(table, dict):
        raise InputError(f"`optimize`: must be a table, but is {shown(table)}: write [optimize]")
    meant = faults.unknown_keys("optimize", table, _KEYS)
    for key, words in (
        ("unknowns", "[[optimize.unknowns]] tables with a path"),
        ("objective", "[[optimize.objective]] tables with a measure"),
    ):
        if not table.get(key) and key not in meant:
            faults.add("optimize", f"{key} is missing: write {words}")
    bench = Instrumented(machine, {})
    unknowns = _unknowns(table.get("unknowns", []), bench, faults)
    starts = _starts(table.get("starts", []), unknowns, bench, faults)
    options = _options(table, faults)
    variations = None
    if "variations" in table:
        variations = _variations(table["variations"], machine, faults)
    reader = CriteriaReader(machine, settings, variations, folder, faults)
    reader.varied = "variations" in table  # or meant to be
    objective = reader.objective(table.get("objective", []))
    constraints = reader.constraints(table.get("constraints", []))
    if faults.sentences or objective is None:
        raise InputError(*faults.sentences)
    return Optimize(unknowns, objective, constraints, starts, options)


def _unknowns(tables: Any, bench: Instrumented, faults: Faults) -> tuple[Unknown, ...]:
    if not isinstance(tables, list):
        faults.add(
            "optimize",
            f"unknowns must be a list, but is {shown(tables)}: write [[optimize.unknowns]]",
        )
        return ()
    before, found = len(faults.sentences), []
    for i, table in enumerate(tables):
        place = f"optimize.unknowns, entry {i + 1}"
        found.append(read_unknown(table, place, bench, faults, lists=True, prior=False))
    return tuple(found) if len(faults.sentences) == before else ()


def _starts(
    given: Any, unknowns: tuple[Unknown, ...], bench: Instrumented, faults: Faults
) -> tuple[dict[str, float], ...]:
    """With all that the unknowns and their starts say of each other."""
    if not isinstance(given, list) or not all(isinstance(one, dict) for one in given):
        faults.add(
            "optimize",
            f'starts must be a list of tables, but is {shown(given)}: write [{{ "damper.damping" = "..." }}]',
        )
        return ()
    if not unknowns:
        return ()
    each = partial(expanded, machine=bench.machine)
    space = space_of(bench, unknowns, "optimize.unknowns", faults, each)
    if space is None:
        return ()
    found = []
    for i, one in enumerate(given):
        place, start = f"optimize.starts, entry {i + 1}", {}
        for path, value in one.items():
            if path not in space.paths:
                faults.add(place, f"`{path}` is not looked for{guess(path, space.paths)}")
            else:
                start[path] = read_quantity(value, bench.unit(path), f"{place}: {path}", faults)
        try:
            place_of(space, bench, start)
        except InputError as error:
            faults.sentences += [f"`{place}`: {p}" for p in error.problems]
        found.append(start)
    return tuple(found)


def _options(table: dict, faults: Faults) -> dict[str, Any]:
    options: dict[str, Any] = {}
    if "iterations" in table:
        options["iterations"] = _whole(table, "iterations", "optimize", 1, faults)
    if "tolerance" in table:
        value = table["tolerance"]
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value < 1:
            faults.add("optimize", f"tolerance must lie between 0 and 1, but is {shown(value)}")
        options["tolerance"] = value
    if "optimiser" in table:
        options["optimiser"] = read_optimiser(table["optimiser"], faults)
    return options


def _whole(table: dict, key: str, place: str, least: int, faults: Faults) -> int:
    try:
        return whole(least, LARGEST if key == "seed" else MANY)(table[key], key)
    except InputError as error:
        faults.add(place, f"{error}: correct it")
        return least


def _variations(table: Any, machine: Machine, faults: Faults) -> Variations | None:
    place = "optimize.variations"
    if not isinstance(table, dict):
        faults.add(place, f"must be a table, but is {shown(table)}: write [{place}]")
        return None
    before = len(faults.sentences)
    faults.unknown_keys(place, table, _VARIATIONS)
    spread = table.get("spread", 0.2)
    if isinstance(spread, bool) or not isinstance(spread, (int, float)):
        faults.add(place, f"spread must be a number, but is {shown(spread)}: give 0.2 for 20 %")
    for key, least in (("count", 2), ("seed", 0)):
        _whole({key: 2} | table, key, place, least, faults)
    paths = table.get("paths")
    if paths is not None and not (
        isinstance(paths, list) and paths and all(isinstance(path, str) for path in paths)
    ):
        faults.add(
            place, f'paths must be a list of parameters, but is {shown(paths)}: write ["main.mass"]'
        )
    if len(faults.sentences) > before:
        return None
    try:
        return Variations.uniform(machine, **table)
    except InputError as error:
        faults.sentences += [f"`{place}`: {p}" for p in error.problems]
        return None
