"""The design problem in numbers: a vector of all that is judged, over the place of the search."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..machine.machine import Machine
from ..objectives.criterion import Constraint, Criterion
from ..search.instrumented import Instrumented
from ..search.space import Space
from .experiment import AbstractExperiment, NoRun

# How far the search's own numbers of positive and bounded parameters count: a factor of 5e8, 2e-9 of the
# range. Beyond, where a bound that holds the design draws them ever further, powers would overflow.
_FAR = 20.0


class Row(NamedTuple):
    """One criterion by what it is a sum of: (weight, experiment's number, measure's number, over)."""

    terms: tuple[tuple[float, int, int, str], ...]


class Problem(eqx.Module):
    """`rows`: the objective first, then the constraints. Each experiment is made once for all of them."""

    bench: Instrumented
    space: Space
    experiments: tuple[AbstractExperiment, ...]
    measures: tuple[tuple[Any, ...], ...]
    rows: tuple[Row, ...] = eqx.field(static=True)
    reverse: bool = eqx.field(static=True)

    def within(self, u: Float[Array, " n"]) -> Float[Array, " n"]:
        tailed = np.array([kind in ("positive", "bounded") for kind in self.space.kinds])
        return jnp.where(tailed, jnp.clip(u, -_FAR, _FAR), u)

    def machine(self, u: Float[Array, " n"]) -> Machine:
        return self.space.placed(self.bench, self.within(u)).machine

    def judged(self, machine: Machine) -> list[Float[Array, " k"]]:
        """Each criterion as a vector: one entry, or one for each machine, peak, ... that counts."""
        found = [e.judged(machine, list(m)) for e, m in zip(self.experiments, self.measures)]
        rows = []
        for row in self.rows:
            parts = []
            for weight, experiment, measure, over in row.terms:
                value = found[experiment][measure]
                if over == "mean":
                    value = jnp.mean(value, axis=0)
                parts.append(weight * value.ravel())
            rows.append(sum(parts[1:], parts[0]))
        return rows

    def vector(self, u: Float[Array, " n"]) -> Float[Array, " m"]:
        return jnp.concatenate(self.judged(self.machine(u)))

    def sizes(self) -> list[int]:
        """Entries of each criterion."""
        shapes = jax.eval_shape(self.judged, self.bench.machine)
        return [shape.shape[0] for shape in shapes]


def pose(
    bench: Instrumented,
    space: Space,
    criteria: Sequence[Criterion | Constraint],
    reverse: bool,
) -> Problem:
    """Gathers experiments that several criteria share, and gets them ready."""
    start = space.placed(bench, jnp.zeros(len(space))).machine
    experiments: list[AbstractExperiment] = []
    measures: list[list[Any]] = []
    rows = []
    for one in criteria:
        criterion = one.criterion if isinstance(one, Constraint) else one
        terms = []
        for weight, given, measure, over in criterion.terms:
            experiment = NoRun() if given is None else given
            k = next((i for i, e in enumerate(experiments) if _same(e, experiment)), None)
            if k is None:
                k = len(experiments)
                experiments.append(experiment)
                measures.append([])
            measures[k].append(measure)
            # without a batch there is nothing to be averaged
            how = over if experiment.variations is not None else ""
            terms.append((weight, k, len(measures[k]) - 1, how))
        rows.append(Row(tuple(terms)))
    ready = tuple(e.ready(start, reverse) for e in experiments)
    return Problem(bench, space, ready, tuple(map(tuple, measures)), tuple(rows), reverse)


def _same(a: AbstractExperiment, b: AbstractExperiment) -> bool:
    """The same object, or no run at all with the same batch."""
    if a is b:
        return True
    alike = type(a) is type(b) and not jax.tree.leaves((a, b))
    return bool(alike and a == b)


def in_parts(vector: np.ndarray, sizes: Sequence[int]) -> list[np.ndarray]:
    return np.split(np.asarray(vector), np.cumsum(sizes)[:-1])
