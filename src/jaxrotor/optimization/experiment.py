"""What is done with a machine to judge it: nothing, or a run; alone, or with a batch of its likes."""

import abc
from collections.abc import Callable, Mapping
from typing import Any, Literal

import equinox as eqx
import jax
from jaxtyping import Array

from ..core.errors import InputError
from ..core.part import Part
from ..machine.machine import Machine
from ..objectives.criterion import Criterion
from ..simulation.response import Response
from ..simulation.simulate import for_slopes, settled, simulate
from ..simulation.simulation import Simulation, as_simulation
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

    def judged(self, machine: Machine, measures: list[Callable[[Any], Array]]) -> list[Array]:
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

    - `simulation`: how it is run, a `Simulation`, or its fields (`SimulatedRun(2.0, 1000.0, speed=100.0)`).
      Solver and step are chosen once, for the machine that the design starts from.
    - `conditions`: path -> value of what is different in this run.
    - `variations`: a batch of machines about the design, all of them run.
    """

    simulation: Simulation
    conditions: Mapping[str, Any]
    variations: Variations | None

    def __init__(
        self,
        simulation: Simulation | float | None = None,
        sample_rate: float | None = None,
        initial: Any = None,
        *,
        conditions: Mapping[str, Any] | None = None,
        variations: Variations | None = None,
        **settings: Any,
    ):
        told = settings | {"sample_rate": sample_rate, "initial": initial}
        self.simulation = as_simulation(simulation, told)
        self.conditions = dict(conditions or {})
        self.variations = variations

    def machine(self, machine: Machine) -> Machine:
        return machine.set(self.conditions) if self.conditions else machine

    def outcome(self, machine: Machine) -> Response:
        return simulate(self.machine(machine), self.simulation, progress=False)

    def ready(self, machine: Machine, reverse: bool) -> "SimulatedRun":
        machine = self.machine(machine)
        if self.variations is not None:
            self.variations.check(machine)
        ready = for_slopes(settled(machine, self.simulation), reverse)
        return SimulatedRun(ready, conditions=self.conditions, variations=self.variations)
