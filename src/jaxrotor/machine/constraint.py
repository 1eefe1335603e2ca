"""A station with mass some of whose coordinates are held."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.protocol import AbstractInertia, Vec6
from .seen import Seen


def held_acceleration(
    element: "AbstractInertia | Seen",
    q: Vec6,
    v: Vec6,
    Q: Vec6,
    held: tuple[int, ...],
    given: Float[Array, " k"],
) -> tuple[Vec6, Vec6]:
    """Accelerations with those of the `held` coordinates as `given`, and the reaction.

    The constraint force λ solves `(M⁻¹)_hh λ = given - a_h(free)`: the same as
    `M_ff a_f = Q_f - h_f - M_fp a_p`, but the closed form of the free body serves, and λ is the
    reaction itself. Setting one acceleration of an unbalanced rotor to zero instead would be wrong
    by the order of its unbalance.
    """

    def response(direction: Vec6) -> tuple[Vec6, Vec6]:
        return jax.jvp(lambda F: element.acceleration(q, v, F), (Q,), (direction,))

    # one trace for both: the acceleration of the free body, and what each reaction adds to it
    free, columns = jax.vmap(response, out_axes=(None, 1))(jnp.eye(6)[np.array(held)])
    at_held = [columns[i] for i in held], [given[k] - free[i] for k, i in enumerate(held)]
    reaction = _solve(*at_held)
    moved = free + sum(columns[:, k] * r for k, r in enumerate(reaction))
    # row by row: a scatter would keep a loop around it from being one kernel
    acceleration = [given[held.index(i)] if i in held else moved[i] for i in range(6)]
    zero = jnp.zeros_like(moved[0])
    return jnp.stack(acceleration), jnp.stack(
        [reaction[held.index(i)] if i in held else zero for i in range(6)]
    )


def _solve(matrix: list[Array], right: list[Array]) -> list[Array]:
    """Gaussian elimination, unrolled: k is 6 at most, and a library call costs more than this."""
    k = len(right)
    # apart, so that a reader of the program sees what of it depends on the motion (linear/degree.py)
    rows, sides = [matrix[i] for i in range(k)], [right[i] for i in range(k)]
    for i in range(k):  # symmetric and positive definite up to scaling: no pivoting needed
        pivot = rows[i][i]
        rows[i], sides[i] = rows[i] / pivot, sides[i] / pivot
        for j in range(k):
            if j != i:
                factor = rows[j][i]
                rows[j], sides[j] = rows[j] - factor * rows[i], sides[j] - factor * sides[i]
    return sides
