"""The sections of a study beside the machine: how to simulate it and what to report."""

from typing import Annotated, Any, Literal, TypeVar, get_args

import pydantic

from ..core.units import read, shown
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
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, strict=True)


S = TypeVar("S", bound=Section)


class Simulation(Section):
    """What `jaxrotor.simulate` is asked for; SI. What is None is left to it."""

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
    rtol: Relative | None = None
    atol: Tolerance | None = None

    def arguments(self) -> dict[str, Any]:
        """Those of `jaxrotor.simulate` that the study gives."""
        import diffrax

        from ..integrators.exponential import ETD4RK, ExponentialAdams
        from ..integrators.rosenbrock import Rosenbrock

        given = self.model_dump(exclude_none=True)
        order, name = given.pop("order", None), given.pop("solver", None)
        if name is None and order is None:
            return given
        if name in (None, "ExponentialAdams"):
            return given | {
                "solver": ExponentialAdams() if order is None else ExponentialAdams(order)
            }
        own = {"ETD4RK": ETD4RK, "Rosenbrock": Rosenbrock}
        return given | {"solver": (own.get(name) or getattr(diffrax, name))()}


# Solvers that step onto the samples, at a length given or planned; where none is named it may be either.
_STEPPING = (None, "ExponentialAdams", "ETD4RK")


def check_simulation(settings: Simulation, faults: Faults) -> None:
    """What no single setting shows."""
    if settings.t_end * settings.sample_rate < 2:
        faults.add(
            "simulation",
            f"sample_rate must give two samples before t_end = {settings.t_end:g} s, but is "
            f'{settings.sample_rate:g} Hz: write "{100 / settings.t_end:.3g} Hz"',
        )
    if settings.order is not None and settings.solver not in (None, "ExponentialAdams"):
        faults.add(
            "simulation",
            f'order goes with the solver "ExponentialAdams", but that is "{settings.solver}": '
            "remove order",
        )
    for name in ("rtol", "atol"):
        if getattr(settings, name) is not None and settings.solver in _STEPPING:
            faults.add(
                "simulation",
                f'{name} goes with an adaptive solver such as "Rosenbrock", but that is '
                f'"{settings.solver or "ExponentialAdams"}": remove {name}, or give step',
            )


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
