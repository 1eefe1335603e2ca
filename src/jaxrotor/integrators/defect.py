"""What the steps of a run leave over: forces that the machine does not have.

A method's result solves `y' = A y + N + r` exactly. The defect r is told, without a look at the field beyond
those of the step, by how far the method's parts differ:

- ETD4RK: `(N_1' - N_4)/6`, the last stage beside the next step's first; and Simpson's remainder, the
  fourth difference of N over two steps, over 180.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


class Defect(eqx.Module):
    """`seen`: what the next step's r is told by, three rows of N's length, good from `steps` on; `total`
    and `square`: sums of r and r² over `count` steps of an interval."""

    seen: Float[Array, "3 m"]
    steps: Any
    total: Float[Array, " m"]
    square: Float[Array, " m"]
    count: Any

    @classmethod
    def none(cls, m: int) -> "Defect":
        zero = jnp.zeros((), int)
        return cls(jnp.zeros((3, m)), zero, jnp.zeros(m), jnp.zeros(m), zero)

    def afresh(self, where: Any = True) -> "Defect":
        """Without what was seen: r is not known behind a jump."""
        return eqx.tree_at(lambda d: d.steps, self, jnp.where(where, 0, self.steps))

    def _add(self, seen: Array, r: Array, known: Any) -> "Defect":
        seen, r = jax.lax.stop_gradient((seen, r))
        r = jnp.where(known, r, 0.0)
        count = self.count + jnp.where(known, 1, 0)
        return Defect(seen, self.steps + 1, self.total + r, self.square + r**2, count)

    def runge_kutta(self, stages: Float[Array, "4 m"]) -> "Defect":
        """At a step with N at its stages."""
        first, middle, last = self.seen
        fourth = first - 4 * middle + 6 * stages[0] - 4 * stages[2] + stages[3]
        r = (stages[0] - last) / 6 + fourth / 180
        return self._add(stages[np.array([0, 2, 3])], r, self.steps >= 1)

    def told(self) -> tuple["Defect", Float[Array, " m"]]:
        """Ready for the next interval; and r of this one: its root mean square, with the mean's sign. (The
        mean itself is lost where r turns within the interval.)"""
        count = jnp.maximum(self.count, 1)
        r = jnp.where(self.total < 0, -1.0, 1.0) * jnp.sqrt(self.square / count)
        zero = jnp.zeros_like(self.total)
        return Defect(self.seen, self.steps, zero, zero, jnp.zeros_like(self.count)), r
