"""The sections of a study beside the machine: how to simulate it and what to report."""

import dataclasses
from typing import Annotated, Any, ClassVar, Literal, TypeVar, get_args

import pydantic

from .. import integrators
from ..core.errors import InputError
from ..core.units import read, shown
from ..machine.machine import Machine
from ..simulation.simulation import Simulation
from .mistakes import Faults, guess


def _in(unit: str) -> Any:
    return pydantic.BeforeValidator(lambda value: read(value, unit))


def _above_zero(value: float) -> float:
    if not value > 0:
        raise ValueError(f"must be positive, but is {value:g} (SI)")
    return value


def _below_one(value: float) -> float:
    if not value < 1:
        raise ValueError(f"must be below 1, but is {value:g}: write 1e-7 or the like")
    return value


def _pure(value: Any) -> float:
    return read(value, "")


_Positive = pydantic.AfterValidator(_above_zero)
Time = Annotated[float, _in("s"), _Positive]
Rate = Annotated[float, _in("Hz"), _Positive]
Speed = Annotated[float, _in("rad/s")]
Tolerance = Annotated[float, pydantic.BeforeValidator(_pure), _Positive]
Relative = Annotated[Tolerance, pydantic.AfterValidator(_below_one)]


class Section(pydantic.BaseModel):
    model_config: ClassVar[pydantic.ConfigDict] = pydantic.ConfigDict(
        extra="forbid", frozen=True, strict=True
    )


S = TypeVar("S", bound=Section)


class SimulationSection(Section):
    """[simulation], in SI. What is None is left to `jaxrotor.Simulation`."""

    t_end: Time
    sample_rate: Rate
    initial: Literal["static", "running", "steady", "undeformed"] = "static"
    speed: Speed | None = None
    solver: (
        Literal["ExponentialAdams", "ETD4RK", "Rosenbrock", "Kvaerno3", "Kvaerno4", "Kvaerno5"]
        | None
    ) = None
    order: Literal[2, 3, 4, 5, 6, 7] | None = None
    step: Time | None = None
    tolerance: Relative | None = None
    rtol: Relative | None = None
    atol: Tolerance | None = None

    def simulation(self) -> Simulation:
        given: dict[str, Any] = self.model_dump(exclude_none=True)
        order, name = given.pop("order", None), given.pop("solver", None)
        if order is not None:
            given["solver"] = integrators.ExponentialAdams(order)
        elif name is not None:
            import diffrax  # takes as long to load as the rest of a check, of studies that mostly name none

            given["solver"] = getattr(
                integrators if hasattr(integrators, name) else diffrax, name
            )()
        return Simulation(**given)


def read_simulation(table: Any, machine: Machine | None, faults: Faults) -> Simulation | None:
    """The section as a `Simulation` that can run `machine`."""
    section = read_section(SimulationSection, "simulation", table, faults)
    if section is None:
        return None
    if section.t_end * section.sample_rate < 2:
        faults.add(
            "simulation",
            f"sample_rate must give two samples before t_end = {section.t_end:g} s, but is "
            f'{section.sample_rate:g} Hz: write "{100 / section.t_end:.3g} Hz"',
        )
        return section.simulation()
    if section.order is not None and section.solver not in (None, "ExponentialAdams"):
        faults.add(
            "simulation",
            f'order goes with the solver "ExponentialAdams", but that is "{section.solver}": '
            "remove order",
        )
    simulation = section.simulation()
    if machine is not None:
        try:
            simulation.refuse(machine)
        except InputError as error:
            faults.sentences += [f"`simulation`: {p}" for p in error.problems]
    return simulation


def settings_of(simulation: Simulation) -> dict[str, Any]:
    """What was said, in plain values: for a summary. SI."""
    found = {}
    for field in dataclasses.fields(simulation):
        value = getattr(simulation, field.name)
        if field.name == "solver" and value is not None:
            found["solver"] = type(value).__name__
            if hasattr(value, "order_"):
                found["order"] = value.order_
        elif value is not None:
            found[field.name] = value
    return found


# The figures that every run is drawn in, where its machine has something to show there.
Automatic = Literal[
    "machine",
    "spin",
    "trajectories",
    "distances",
    "vibration",
    "inclinations",
    "differences",
    "spectrum",
    "bearing_forces",
    "torques",
]


class Report(Section):
    """What the automatic figures show: `main` is the station in the foreground, `figures` those to
    draw (left out: all)."""

    main: str | None = None
    figures: tuple[Automatic, ...] | None = None


# What to write for a key that is missing.
_EXAMPLES = {
    "t_end": '"10 s"',
    "sample_rate": '"1 kHz"',
    "title": '"..."',
    "y": '["main.x", ...]',
    "figures": '["spin", ...]',
    "units": '["mm", ...]',
}


def read_section(
    model: type[S], place: str, table: Any, faults: Faults, header: str | None = None
) -> S | None:
    """The section as a model; every fault becomes one of our sentences. `header` heads its table
    (left out: the place)."""
    if not isinstance(table, dict):
        header = header or place
        faults.add(place, f"must be a table, but is {shown(table)}: write [{header}]")
        return None
    meant = faults.unknown_keys(place, table, model.model_fields)
    known = {k: tuple(v) if isinstance(v, list) else v for k, v in table.items()}
    known = {k: v for k, v in known.items() if k in model.model_fields}
    try:
        return model(**known)
    except pydantic.ValidationError as error:
        for fault in error.errors():
            key = str(fault["loc"][0])
            if fault["type"] != "missing" or key not in meant:
                faults.add(place, f"{key} {_predicate(model, key, fault)}")
        return None


def _predicate(model: type[Section], key: str, fault: Any) -> str:
    given = shown(list(v) if isinstance(v := fault["input"], tuple) else v)
    if fault["type"] == "missing":
        return f"is missing: write {key} = {_EXAMPLES.get(key, '...')}"
    if fault["type"] == "value_error":
        return str(fault["ctx"]["error"])
    if fault["type"] == "literal_error":
        annotation = model.model_fields[key].annotation
        choices = [str(c) for c in _flat(annotation) if c not in (None, ...)]
        return f"must be one of those known, but is {given}{guess(fault['input'], choices)}"
    if fault["type"] == "tuple_type" or len(fault["loc"]) > 1:
        return f"must be a list of texts, but has {given}: write {key} = {_EXAMPLES[key]}"
    return f"must be a text, but is {given}: put it in quotes"


def _flat(annotation: Any) -> list[Any]:
    """Choices of a Literal, or of a union with one."""
    found: list[Any] = []
    for arg in get_args(annotation):
        found += _flat(arg) if get_args(arg) else [] if isinstance(arg, type) else [arg]
    return found
