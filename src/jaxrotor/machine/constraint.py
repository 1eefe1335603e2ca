"""A station with mass some of whose coordinates are held."""

import jax
import jax.numpy as jnp
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

    index = jnp.array(held)
    # one trace for both: the acceleration of the free body, and what each reaction adds to it
    free, columns = jax.vmap(response, out_axes=(None, 1))(jnp.eye(6)[index])
    reaction = _solve(columns[index], given - free[index])
    acceleration = (free + columns @ reaction).at[index].set(given)
    return acceleration, jnp.zeros(6).at[index].set(reaction)


def _solve(matrix: Float[Array, "k k"], right: Float[Array, " k"]) -> Float[Array, " k"]:
    """Gaussian elimination, unrolled: k is 6 at most, and a library call costs more than this."""
    k = right.shape[0]
    # apart, so that a reader of the program sees what of it depends on the motion (linear/degree.py)
    rows, sides = [matrix[i] for i in range(k)], [right[i] for i in range(k)]
    for i in range(k):  # symmetric and positive definite up to scaling: no pivoting needed
        pivot = rows[i][i]
        rows[i], sides[i] = rows[i] / pivot, sides[i] / pivot
        for j in range(k):
            if j != i:
                factor = rows[j][i]
                rows[j], sides[j] = rows[j] - factor * rows[i], sides[j] - factor * sides[i]
    return jnp.stack(sides)
