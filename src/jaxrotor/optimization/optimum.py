"""The result of a design: the machine, what it gained, what holds it, and what would move it."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..core.doors import plot_door
from ..core.files import save_json
from ..core.quick import lightly_compiled
from ..core.result_text import shows
from ..machine.machine import Machine
from ..objectives.criterion import Constraint, Criterion
from .augmented_lagrangian import Layout, Terms
from .problem import Problem, in_parts
from .search import Found, Step

# A scaled price above this says that the constraint holds the design.
_ACTIVE = 1e-6


@shows()
@dataclasses.dataclass(frozen=True)
class Held:
    """A constraint at the optimum. `value`: of the criterion, its worst entry. `price`: by how much the
    objective would change for each unit by which the limit is raised; 0 where it does not hold the
    design."""

    name: str
    sense: str
    limit: float
    value: float
    price: float
    active: bool


@dataclasses.dataclass(frozen=True)
class Optimum:
    """**Attributes:**

    - `machine`: the best one. - `values`, `start`: path -> value (SI) there and before.
    - `objective`, `objective_before`: the largest entry where there are several.
    - `constraints`: a `Held` each. - `stopped`: why the search ended; `converged`: whether it came to rest.
    - `interrupted`: Ctrl-C ended the searches: this is the best so far.
    - `history`: every evaluation in turn (judged vector, violation, place), of all starts.
    - `weights`: of a minimax's entries in the optimum, those that hold it up; they sum to one.
    """

    machine: Machine
    before: Machine
    values: dict[str, float]
    start: dict[str, float]
    units: dict[str, str]
    name: str
    unit: str
    objective: float
    objective_before: float
    constraints: tuple[Held, ...]
    weights: np.ndarray
    history: tuple[tuple[Step, ...], ...]
    stopped: str
    converged: bool
    problem: Problem = dataclasses.field(repr=False)
    found: Found = dataclasses.field(repr=False)
    scales: tuple[float, ...] = dataclasses.field(repr=False)
    interrupted: bool = False

    plot = plot_door()

    def sensitivities(self, paths: Sequence[str] | None = None) -> dict[str, np.ndarray]:
        """How the best objective changes with each parameter of the machine that was not designed (per SI
        unit), the design following: by the envelope theorem, one reverse sweep. `paths`: by default all.
        Raises `InputError` for a path that the machine has not."""
        weights = self._pull()
        problem = _reversed(self.problem)
        slopes = _by_machine(problem, self.machine, weights)
        found = slopes.parameters()
        designed = {path.split("[")[0] for path in problem.space.paths}
        names = [p for p in found if p not in designed] if paths is None else list(paths)
        for name in names:
            self.machine.get(name)
        return {name: np.asarray(found[name]) for name in names if found.get(name) is not None}

    def tolerances(self, rise: float = 0.01) -> dict[str, float]:
        """By how much each designed parameter alone may leave its value, either way, before the Lagrangian
        (the objective, and active constraints by their price) rises by this part of the objective: from the
        curvature there, in the parameter's unit. Infinite where it is flat."""
        space, u = self.problem.space, jnp.asarray(self.found.u)
        weights = self._pull()
        found = {}
        for i, path in enumerate(space.paths):
            h = 1e-3
            d = jnp.zeros(len(u)).at[i].set(h)
            ends = [float(weights @ _vector(self.problem, place)) for place in (u - d, u, u + d)]
            bend = (ends[0] - 2 * ends[1] + ends[2]) / h**2
            reach = np.sqrt(2 * rise * abs(self.objective) / bend) if bend > 0 else np.inf
            # in the parameter's own unit, to first order
            rate = (space.values(u + d)[i] - space.values(u - d)[i]) / (2 * h)
            found[path] = float(abs(rate) * reach)
        return found

    def _pull(self) -> np.ndarray:
        """What each judged entry weighs in the Lagrangian, in the objective's unit."""
        sizes = self.problem.sizes()
        parts = [np.zeros(size) for size in sizes]
        prices = self.found.prices
        if sizes[0] > 1:
            parts[0] = self.weights
            prices = prices[sizes[0] :]
        else:
            parts[0][:] = 1.0
        first = 0
        for k, held in enumerate(self.constraints, 1):
            own = prices[first : first + sizes[k]] * self.scales[0] / self.scales[k]
            parts[k] = -own if held.sense == ">=" else own
            first += sizes[k]
        return np.concatenate(parts)

    def __str__(self) -> str:
        gain = self.objective / self.objective_before if self.objective_before else np.nan
        lines = [
            f"{self.name}: {self.objective_before:.6g} -> {self.objective:.6g} {self.unit}".rstrip()
            + f"   ({100 * (gain - 1):+.3g} %)"
        ]
        width = max(map(len, self.values))
        for path, value in self.values.items():
            lines.append(
                f"  {path:{width}}  {self.start[path]:.6g} -> {value:.6g} {self.units[path]}".rstrip()
            )
        for held in self.constraints:
            words = (
                f"holds the design, {held.price:+.3g} per unit of its limit"
                if held.active
                else "is free"
            )
            lines.append(f"  {held.name} {held.sense} {held.limit:g}: {held.value:.6g}, {words}")
        worst = (
            f", bounds missed by {self.found.violation:.1e}" if self.found.violation > 1e-6 else ""
        )
        count = sum(map(len, self.history))
        lines.append(f"  {count} evaluations; {self.stopped}{worst}")
        if self.interrupted:
            lines.append("! the search was interrupted: this is the best so far, unfinished")
        return "\n".join(lines)

    __repr__ = __str__

    def to_dict(self) -> dict[str, Any]:
        """Everything but the machine and the history, for JSON."""
        return {
            "objective": {
                "name": self.name,
                "unit": self.unit,
                "before": self.objective_before,
                "after": self.objective,
            },
            "parameters": {
                path: {"unit": self.units[path], "before": self.start[path], "after": value}
                for path, value in self.values.items()
            },
            "constraints": [dataclasses.asdict(held) for held in self.constraints],
            "evaluations": sum(map(len, self.history)),
            "violation": self.found.violation,
            "converged": self.converged,
            "stopped": self.stopped,
            "interrupted": self.interrupted,
        }

    def save(self, path: str | Path) -> Path:
        """`to_dict` as JSON, whole or not at all."""
        save_json(Path(path), self.to_dict())
        return Path(path)


@lightly_compiled
def _vector(problem: Problem, u):
    return problem.vector(u)


def _reversed(problem: Problem) -> Problem:
    """For one reverse sweep."""
    if problem.reverse:
        return problem
    ready = tuple(e.ready(problem.bench.machine, True) for e in problem.experiments)
    return dataclasses.replace(problem, experiments=ready, reverse=True)


@lightly_compiled
def _by_machine(problem: Problem, machine: Machine, weights):
    return eqx.filter_grad(lambda m: weights @ jnp.concatenate(problem.judged(m)))(machine)


def summed_up(
    problem: Problem,
    layout: Layout,
    terms: Terms,
    constraints: Sequence[Constraint],
    found: Found,
    searches: Sequence[Found],
    first: np.ndarray,
    objective: Criterion,
) -> Optimum:
    """`first`: the judged vector of the machine as it was."""
    space = problem.space
    parts, before = in_parts(found.vector, layout.sizes), in_parts(first, layout.sizes)
    prices = found.prices
    weights = np.ones(1)
    if layout.minimax:
        weights, prices = prices[: layout.sizes[0]], prices[layout.sizes[0] :]
    held, k = [], 0
    scales = np.asarray(terms.scales)
    for one, values, scale in zip(constraints, parts[1:], scales[1:]):
        own = prices[k : k + values.size]
        k += values.size
        off = values - one.limit
        worst = values[np.argmax({"<=": off, ">=": -off, "==": np.abs(off)}[one.sense])]
        price = float(np.sum(own) * scales[0] / scale)
        held.append(
            Held(
                str(one.criterion),
                one.sense,
                one.limit,
                float(worst),
                price if one.sense == ">=" else -price,
                bool(np.max(np.abs(own)) > _ACTIVE),
            )  # fmt: skip
        )
    u = problem.within(jnp.asarray(found.u))
    values, start = (np.asarray(space.shown(space.values(x))) for x in (u, jnp.zeros(len(space))))
    return Optimum(
        machine=problem.machine(u),
        before=problem.machine(jnp.zeros(len(space))),
        values=dict(zip(space.paths, map(float, values))),
        start=dict(zip(space.paths, map(float, start))),
        units={path: problem.bench.unit(path) for path in space.paths},
        name=str(objective),
        unit=objective.unit,
        objective=float(np.max(parts[0])),
        objective_before=float(np.max(before[0])),
        constraints=tuple(held),
        weights=weights,
        history=tuple(tuple(one.history) for one in searches),
        stopped=found.stopped,
        converged=found.converged,
        problem=problem,
        found=found,
        scales=tuple(map(float, scales)),
        interrupted=any(one.interrupted for one in searches),
    )
