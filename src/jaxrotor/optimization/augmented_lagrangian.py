"""The augmented Lagrangian: objective, constraints and a minimax's level as one smooth function."""

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.quick import lightly_compiled
from .problem import Problem


class Terms(eqx.Module):
    """The numbers of the Lagrangian, so that others need no new compilation.

    - `limits`: of each constraint. - `scales`: of the objective, then of each constraint: entries and limits
      are divided by them, so that a violation of 1 is a whole one.
    - `prices`: multipliers, one for each entry that is held to something, of scaled objective per scaled
      entry; `penalty`: on the squares of what is beyond bounds.
    """

    limits: Float[Array, " c"]
    scales: Float[Array, " c1"]
    prices: Float[Array, " held"]
    penalty: Float[Array, ""]


class Told(NamedTuple):
    """At one place: the merit and its slope, and everything that is judged."""

    merit: Array
    slope: Array
    vector: Array


@dataclasses.dataclass(frozen=True)
class Layout:
    """How the judged vector is read: entries of the objective and of each constraint, and the constraints'
    senses. Of an objective with several entries the largest is minimised: the search gets one more
    coordinate, a level that all of them must stay below (epigraph form)."""

    sizes: tuple[int, ...]
    senses: tuple[str, ...]

    @property
    def minimax(self) -> bool:
        return self.sizes[0] > 1

    @property
    def held(self) -> int:
        """Entries that are held to something."""
        return sum(self.sizes[1:]) + (self.sizes[0] if self.minimax else 0)

    @property
    def equal(self) -> np.ndarray:
        """Which of them are equations."""
        first = [False] * self.sizes[0] if self.minimax else []
        rest = [[s == "=="] * n for s, n in zip(self.senses, self.sizes[1:])]
        return np.array(first + [e for row in rest for e in row], bool)

    def split(self, vector: Any) -> list[Any]:
        return jnp.split(jnp.asarray(vector), np.cumsum(self.sizes)[:-1])

    def beyond(self, vector: Array, level: Any, terms: Terms) -> Float[Array, " held"]:
        """How far each held entry is beyond its bound, scaled; negative is within."""
        objective, *rest = self.split(vector)
        parts = [objective / terms.scales[0] - level] if self.minimax else []
        for k, (values, sense) in enumerate(zip(rest, self.senses)):
            over = (values - terms.limits[k]) / terms.scales[k + 1]
            parts.append(-over if sense == ">=" else over)
        return jnp.concatenate(parts)

    def pushed(self, vector: Array, level: Any, terms: Terms) -> Float[Array, " held"]:
        """The prices behind a search that came to rest; within their bounds entries cost nothing."""
        raw = terms.prices + terms.penalty * self.beyond(vector, level, terms)
        return jnp.where(self.equal, raw, jnp.maximum(raw, 0.0))

    def merit(self, vector: Array, level: Any, terms: Terms) -> Float[Array, ""]:
        """Powell's, Hestenes' and Rockafellar's function: Nocedal & Wright, Numerical Optimization, 2nd ed.,
        sec. 17.4."""
        value = level if self.minimax else vector[0] / terms.scales[0]
        if not self.held:
            return value
        pushed = self.pushed(vector, level, terms)
        return value + jnp.sum(pushed**2 - terms.prices**2) / (2 * terms.penalty)

    def violation(self, vector: Array, level: Any, terms: Terms) -> float:
        """The largest, scaled; of a minimax's level too."""
        if not self.held:
            return 0.0
        beyond = np.asarray(self.beyond(vector, level, terms))
        return float(np.max(np.where(self.equal, np.abs(beyond), np.maximum(beyond, 0.0))))

    def begun(self, limits: Sequence[float], first: Any, penalty: float) -> Terms:
        """Scales from the judged vector at the start of the search."""
        parts = [np.abs(np.asarray(part)) for part in self.split(first)]
        sizes = [np.max(parts[0])]
        sizes += [abs(limit) or np.max(part) for limit, part in zip(limits, parts[1:])]
        scales = [size if 0 < size < np.inf else 1.0 for size in sizes]
        return Terms(
            jnp.asarray(limits, float).reshape(-1),
            jnp.asarray(scales, float),
            jnp.zeros(self.held),
            jnp.asarray(penalty, float),
        )


@lightly_compiled
def tell(problem: Problem, layout: Layout, x: Float[Array, " n"], terms: Terms) -> Told:
    """Forward mode costs half a run for each unknown, reverse mode four or five runs in all."""
    n = len(problem.space)
    u, level = x[:n], (x[n] if layout.minimax else jnp.zeros(()))
    vector, slopes, pull = jnp.zeros(0), None, None
    if problem.reverse:
        vector, pull = jax.vjp(problem.vector, u)
    else:
        slopes, vector = jax.jacfwd(lambda u: (problem.vector(u),) * 2, has_aux=True)(u)
    merit, (by_vector, by_level) = jax.value_and_grad(
        lambda v, s: layout.merit(v, s, terms), argnums=(0, 1)
    )(vector, level)
    slope = by_vector @ slopes if pull is None else pull(by_vector)[0]
    if layout.minimax:
        slope = jnp.concatenate([slope, by_level[None]])
    return Told(merit, slope, vector)
