"""What is done with a machine to judge it: nothing, or a run; alone, or with a batch of its likes."""

import abc
import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, Literal

import diffrax
import equinox as eqx
import jax
from jaxtyping import Array

from ..core.arguments import number, positive
from ..core.errors import InputError
from ..core.part import Part, option
from ..machine.machine import Machine
from ..objectives.criterion import Criterion
from ..simulation.plan import Plan, plan
from ..simulation.response import Response
from ..simulation.simulate import simulate
from ..simulation.solver import is_planned, solver_for
from .variations import Variations

Over = Literal["worst", "mean"]


class AbstractExperiment(Part):
    """Something that a machine is put through. `measure` judges what comes out."""

    variations: eqx.AbstractVar[Variations | None]

    @abc.abstractmethod
    def outcome(self, machine: Machine) -> Any:
        """Of one machine: what measures look at."""

    @abc.abstractmethod
    def ready(self, machine: Machine, reverse: bool) -> "AbstractExperiment":
        """Prepared for machines like this one and for slopes by forward or reverse mode; raises
        `InputError` where it cannot be."""

    def judged(self, machine: Machine, measures: list[Callable]) -> list[Array]:
        """Each measure of the outcome; with variations (b, ...), of each machine."""

        def one(machine):
            outcome = self.outcome(machine)
            return [measure(outcome) for measure in measures]

        if self.variations is None:
            return one(machine)
        return jax.vmap(lambda own: one(self.variations.member(machine, own)))(  # pyright: ignore
            self.variations.factors
        )

    def measure(self, measure: Callable[[Any], Array], over: Over = "worst") -> Criterion:
        """What `measure` says of the outcome, to be minimised or bounded. With variations: of the `"worst"`
        of the machines (an exact minimax over all of them), or of their `"mean"`."""
        if over not in ("worst", "mean"):
            raise InputError(f'over must be "worst" or "mean", but is {over!r}')
        if not callable(measure):
            raise InputError(f"measure must be a function or a measure, but is {measure!r}")
        return Criterion(((1.0, self, measure, over),))


class NoRun(AbstractExperiment):
    """No run: measures look at the machine itself (its mass, its linear model)."""

    variations: Variations | None = None

    def outcome(self, machine: Machine) -> Machine:
        return machine

    def ready(self, machine: Machine, reverse: bool) -> "NoRun":
        if self.variations is not None:
            self.variations.check(machine)
        return self


class SimulatedRun(AbstractExperiment):
    """A run of `jr.simulate`; measures look at its `Response`.

    **Arguments:**

    - `t_end`, `sample_rate`, `initial`, `speed`, `solver`, `rtol`, `atol`: as for `simulate`.
    - `step`: a `Plan`, or s; by default planned once, for the machine that the design starts from.
    - `conditions`: path -> value of what is different in this run.
    - `variations`: a batch of machines about the design, all of them run.
    """

    t_end: float = option(positive("s"))
    sample_rate: float = option(positive("Hz"))
    initial: Any = "static"
    speed: Any = None
    conditions: Mapping[str, Any] = eqx.field(default_factory=dict)
    step: Any = None
    solver: Any = None
    variations: Variations | None = None
    adjoint: Any = None
    rtol: float = option(number(above=0.0, below=1.0), default=1e-7)
    atol: float = option(positive(), default=1e-10)

    def machine(self, machine: Machine) -> Machine:
        return machine.set(self.conditions) if self.conditions else machine

    def outcome(self, machine: Machine) -> Response:
        return simulate(
            self.machine(machine),
            self.t_end,
            self.sample_rate,
            self.initial,
            self.speed,
            self.solver,
            self.step,
            self.rtol,
            self.atol,
            adjoint=self.adjoint,
            progress=False,
        )

    def ready(self, machine: Machine, reverse: bool) -> "SimulatedRun":
        machine = self.machine(machine)
        if self.variations is not None:
            self.variations.check(machine)
        solver, step, adjoint = solver_for(machine, self.solver), self.step, self.adjoint
        adaptive = not is_planned(solver)
        if adaptive and adjoint is None:
            adjoint = diffrax.RecursiveCheckpointAdjoint() if reverse else diffrax.ForwardMode()
        if not adaptive and step is None:
            step = _planned(machine, self)
        return dataclasses.replace(self, step=step, solver=solver, adjoint=adjoint)


def _planned(machine: Machine, run: SimulatedRun) -> Plan:
    if machine.is_driven:
        return plan(machine, run.t_end, run.sample_rate, run.speed)
    # what speed a line without a drive reaches is known when it has run
    info = simulate(machine, run.t_end, run.sample_rate, run.initial, run.speed).info
    numbers = (info.linearised_at, info.planned_top_speed, info.pilot_error, info.tolerance)
    return Plan(info.substeps or 1, info.order or 6, *map(float, numbers))
