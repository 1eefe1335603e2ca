"""Linear equations whose rows and columns differ by orders."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def bordered_solution(
    slope: Array, by_speed: Array, plane: Array, right: Float[Array, "s1 r"]
) -> Float[Array, "s1 r"]:
    """[[slope, by_speed], [plane]] x = right."""
    top = jnp.concatenate([slope, by_speed[:, None]], axis=1)
    return scaled_solution(jnp.concatenate([top, plane[None]], axis=0), right)


def scaled_solution(matrix: Array, right: Array) -> Array:
    """Rows and columns scaled to a like size."""
    rows = jax.lax.stop_gradient(jnp.max(jnp.abs(matrix), axis=1))
    scaled = matrix / rows[:, None]
    columns = jax.lax.stop_gradient(jnp.max(jnp.abs(scaled), axis=0))
    return jnp.linalg.solve(scaled / columns, right / rows[:, None]) / columns[:, None]
