"""A station with mass some of whose coordinates are held."""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.kinematics import rows
from ..core.protocol import Vec6


def held_acceleration(
    acceleration: Callable[[Vec6], Vec6],
    Q: Vec6,
    held: tuple[int, ...],
    given: Float[Array, " k"],
) -> tuple[Vec6, Vec6]:
    """Accelerations with those of the `held` coordinates as `given`, and the reaction. `acceleration`: of the
    free body under a force.

    The constraint force λ solves `(M⁻¹)_hh λ = given - a_h(free)`: the same as
    `M_ff a_f = Q_f - h_f - M_fp a_p`, but the closed form of the free body serves, and λ is the
    reaction itself. Setting one acceleration of an unbalanced rotor to zero instead would be wrong
    by the order of its unbalance.
    """

    def response(direction: Vec6) -> tuple[Vec6, Vec6]:
        return jax.jvp(acceleration, (Q,), (direction,))

    # one trace for both: the acceleration of the free body, and what each reaction adds to it
    free, columns = jax.vmap(response, out_axes=(None, 1))(jnp.eye(6)[np.array(held)])
    # number by number: a scatter would keep a loop around it from being one kernel
    free, by, values = rows(free), [rows(x) for x in rows(columns)], rows(given)
    reaction = _solve([by[i] for i in held], [values[k] - free[i] for k, i in enumerate(held)])
    found = [
        given[held.index(i)] if i in held else free[i] + sum(c * r for c, r in zip(by[i], reaction))
        for i in range(6)
    ]
    zero = jnp.zeros_like(free[0])
    return jnp.stack(found), jnp.stack(
        [reaction[held.index(i)] if i in held else zero for i in range(6)]
    )


def _solve(matrix: Sequence[Sequence[Array]], right: Sequence[Array]) -> list[Array]:
    """Gaussian elimination, unrolled: k is 6 at most, and a library call costs more than this.

    Differentiated as the equation that it solves: the elimination's own derivative would be a third of the
    program of a train that only turns.
    """
    if len(right) == 1:
        return [right[0] / matrix[0][0]]
    eliminated = _eliminated([[jax.lax.stop_gradient(x) for x in line] for line in matrix])

    def product(x: Sequence[Array]) -> list[Array]:
        return [
            sum(m * each for m, each in zip(line[1:], x[1:])) + line[0] * x[0] for line in matrix
        ]

    return jax.lax.custom_linear_solve(
        product,
        list(right),
        lambda _, b: _substituted(eliminated, b),
        lambda _, b: _substituted([list(line) for line in zip(*eliminated)], b, turned=True),
    )


def _eliminated(lines: list[list[Array]]) -> list[list[Array]]:
    """Factors below the diagonal, what is left of the matrix on it and above."""
    k = len(lines)
    for i in range(k):  # symmetric and positive definite up to scaling: no pivoting needed
        for j in range(i + 1, k):
            lines[j][i] = lines[j][i] / lines[i][i]
            for c in range(i + 1, k):
                lines[j][c] = lines[j][c] - lines[j][i] * lines[i][c]
    return lines


def _substituted(lines: list[list[Array]], right: Sequence[Array], turned=False) -> list[Array]:
    """The solution by what `_eliminated` left; `turned`: of the transposed equation, by its transpose."""
    k, sides = len(right), list(right)
    # the diagonal goes with what stands above it, which `turned` is passed first
    for i in range(k):
        for c in range(i):
            sides[i] = sides[i] - lines[i][c] * sides[c]
        if turned:
            sides[i] = sides[i] / lines[i][i]
    for i in reversed(range(k)):
        for c in range(i + 1, k):
            sides[i] = sides[i] - lines[i][c] * sides[c]
        if not turned:
            sides[i] = sides[i] / lines[i][i]
    return sides
