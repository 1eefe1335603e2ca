"""What is run and how: the settings of a run as one object, for all that run machines."""

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, TypedDict

from jax.core import Tracer
from jaxtyping import Array, Float

from .. import integrators
from ..core.arguments import Check, number, positive
from ..core.errors import InputError
from ..core.gate import either
from ..core.part import Part, option
from ..machine.machine import Machine
from .checks import (
    a_solver,
    a_start,
    check_machine,
    initial_speed,
    refuse_sampled_whirl,
    sample_count,
)
from .planned import DEFAULT_TOLERANCE, Plan
from .sampling_grid import grid_of
from .solver import is_planned, solver_for
from .state import State

if TYPE_CHECKING:  # what no solver is given for is run, and checked, without it
    import diffrax

Initial = Literal["static", "running", "steady", "undeformed"]

# Of adaptive solvers, where nothing else is said.
RTOL, ATOL = 1e-7, 1e-10


class Settings(TypedDict, total=False):
    """The keywords that make a `Simulation`."""

    t_end: float
    sample_rate: float
    initial: Initial | State
    speed: Float[Array, ""] | float | None
    solver: "diffrax.AbstractSolver[Any] | None"
    step: Plan | float | None
    tolerance: float | None
    rtol: float | None
    atol: float | None
    adjoint: "diffrax.AbstractAdjoint | None"


def _plain(check: Check) -> Check:
    """Of what makes another program: a number that is known, as a float."""

    def plain(value: Any, place: str) -> float:
        if isinstance(value, Tracer):
            raise InputError(f"{place} sets what is compiled, so it must be a plain number")
        return float(check(value, place))

    return plain


def _checked(check: Check, default: Any = None) -> Any:
    """Of a field that may hold what is traced."""
    return dataclasses.field(default=default, metadata=dict(check=check))


class Simulation(Part):
    """A run from t = 0 to `t_end` (s), sampled at `sample_rate` (Hz).

    `simulate`, `plan`, `energy_audit`, `sweep`, a `MeasuredRun` and a `SimulatedRun` take one as it is, or
    its fields as keywords; `[simulation]` of a study is one. `dataclasses.replace(simulation, t_end=5.0)`
    changes a field.

    **Arguments:**

    - `initial`: `"static"`, resting under its weight and every load's value at t = 0 and standstill, with
      the line's speed added; `"running"`, where the balanced machine stays at that speed, its films
      carrying; `"steady"`, the periodic whirl at `speed`; `"undeformed"`; or a `State`.
    - `speed`: rad/s, of the whole line at the start. A driven line starts with its drive; there it
      may be left out. A `State` brings its own.
    - `solver`: by default `ExponentialAdams`, or where a part of the machine is not smooth (backlash, a
      clutch, a limited governor, an oil film, a rub) `Rosenbrock`; any solver of diffrax may be given.
      `ETD4RK` steps onto the samples, `ExponentialAdams` too or over several; others adapt their step.
    - `step`: a largest step in s (which no pilot has tried, so that it evaluates the field twice), or for the
      exponential solvers a `Plan`. By default `jr.plan` chooses. One of `ExponentialAdams` may span up to 64
      samples.
    - `tolerance`: of the exponential solvers, what the plan keeps the error below, as part of each
      coordinate's peak; by default 5e-5. It stands in place of `step`. Where it is asked for, steps span as
      many samples as it allows; else only where they are a thousand times as right.
    - `rtol`, `atol`: of the adaptive solvers, by default 1e-7 and 1e-10 (SI; of a free spin's angle `rtol`
      counts in rad).
    - `adjoint`: of diffrax, for the adaptive solvers, whose default knows reverse mode alone: give
      `diffrax.ForwardMode()` for forward mode. The exponential ones need none, both modes work; but with
      `ForwardMode()` several tangents take a quarter of the time.

    Raises `InputError` for a value that cannot be.
    """

    t_end: float = option(_plain(positive("s")))
    sample_rate: float = option(_plain(positive("Hz")))
    initial: Initial | State = _checked(a_start, "static")
    speed: Float[Array, ""] | float | None = _checked(number("rad/s"))
    solver: "diffrax.AbstractSolver[Any] | None" = _checked(a_solver)
    step: Plan | float | None = _checked(either(Plan, positive("s")))
    tolerance: float | None = option(_plain(number(above=0.0, below=1.0)), default=None)
    rtol: float | None = option(_plain(number(above=0.0, below=1.0)), default=None)
    atol: float | None = option(_plain(positive()), default=None)
    adjoint: "diffrax.AbstractAdjoint | None" = None

    def check(self, machine: Machine) -> Float[Array, ""]:
        """The speed at the start, rad/s. Raises `InputError` where `machine` cannot be run so, or a setting
        would mean nothing to its solver."""
        self.refuse(machine)
        return initial_speed(machine, self.initial, self.speed)

    def refuse(self, machine: Machine) -> None:
        """Raises `InputError` as `check` does. Where nothing about the start is asked that the drive could
        contradict, its speed is not computed: no operation is compiled for it."""
        check_machine(machine)
        self._check_accuracy(solver_for(machine, self.solver))
        sample_count(self.t_end, self.sample_rate, len(machine.wiring.stations))
        if self.speed is not None or not isinstance(self.initial, str) or self.initial == "steady":
            initial_speed(machine, self.initial, self.speed)
        refuse_sampled_whirl(self.initial, grid_of(machine, self.sample_rate) is not None)

    def _check_accuracy(self, solver: Any) -> None:
        name = "ExponentialAdams" if solver is None else type(solver).__name__
        if name == "ExponentialAdams" and not 3 <= self.order <= 6:
            raise InputError(
                f"order of ExponentialAdams must be 3 to 6 in a simulation, but is {self.order}: with one "
                "evaluation a step 7 is unstable, and 2 cannot follow what turns"
            )
        if is_planned(solver):
            for setting in ("rtol", "atol"):
                if getattr(self, setting) is not None:
                    raise InputError(
                        f"{setting} goes with an adaptive solver such as Rosenbrock, but {name} runs this "
                        f"machine: remove {setting} (tolerance or step say how fine its steps are), or "
                        "choose such a solver"
                    )
            if self.step is not None and self.tolerance is not None:
                raise InputError(
                    "tolerance is what a step is chosen for, but step is given: leave one of them out"
                )
            return
        if isinstance(self.step, Plan):
            raise InputError("a Plan is for the exponential solvers: give a step in s, or none")
        if self.tolerance is not None:
            raise InputError(
                f"tolerance is what the exponential solvers' step is chosen for, but {name} runs this "
                "machine and adapts its own: give rtol and atol"
            )

    @property
    def start(self) -> str:
        """`initial` in a word."""
        return self.initial if isinstance(self.initial, str) else "given state"

    @property
    def order(self) -> int:
        """Of the exponential Adams method that runs where it is planned."""
        if self.solver is None or not isinstance(self.solver, integrators.ExponentialAdams):
            return 6
        return self.solver.order_

    @property
    def planned_tolerance(self) -> float:
        return DEFAULT_TOLERANCE if self.tolerance is None else self.tolerance


def end_or_simulation(value: Any, place: str) -> Any:
    """A whole `Simulation` may stand where `t_end` does."""
    return value if isinstance(value, Simulation) else positive("s")(value, place)


def as_simulation(given: Any, settings: Mapping[str, Any]) -> Simulation:
    """`given`, a whole `Simulation`, or one made of `settings`, among them `t_end` where it is `given`."""
    if not isinstance(given, Simulation):
        said = {name: value for name, value in settings.items() if value is not None}
        return Simulation(**(said if given is None else said | {"t_end": given}))
    defaults = {f.name: f.default for f in dataclasses.fields(Simulation)}
    for name, value in settings.items():
        if value is not defaults.get(name) and value is not None:
            raise InputError(
                f"{name} is a setting of the Simulation that was given: change it there, by "
                f"dataclasses.replace(simulation, {name}=...)"
            )
    return given
