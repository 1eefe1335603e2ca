"""Derivatives of the vector field, single columns of its Jacobian at single instants: as many columns side by
side as there are samples, so that the field stands in the program once."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..machine.field import relative_field
from ..machine.system import System


def picked_slopes(
    system: System,
    instants: tuple[Array, Float[Array, "p d"], Array],
    pairs: tuple[np.ndarray, np.ndarray],
    by_speed: Float[Array, "p d"] | None = None,
    size: int = 64,
) -> tuple[Float[Array, "c d"], Float[Array, "c d"]]:
    """`instants`: the shaft's angles, the states there, and the speed (rad/s). `pairs`: numbers of instants
    and of columns; the column beyond the last is that by the speed, with which the states grow by `by_speed`.
    Returns the field and its derivative for each pair, so many (`size`) at once."""
    angles, states, speed = instants
    d, count = states.shape[1], len(pairs[0])
    chunks = -(-count // size)
    at = [np.resize(x, chunks * size).reshape(chunks, size) for x in pairs]
    zero = jnp.zeros(())

    def field(angle, y, w):
        return relative_field(zero, y, system, (angle, w, zero))

    def some(pair):
        i, column = pair
        way = jnp.asarray(column[:, None] == np.arange(d), float)
        faster = jnp.zeros(size)
        if by_speed is not None:
            own = column == d
            way, faster = jnp.where(own[:, None], by_speed[i], way), jnp.asarray(own, float)

        def fields(y, w):
            return jax.vmap(field)(angles[i], y, w)

        return jax.jvp(fields, (states[i], speed + jnp.zeros(size)), (way, faster))

    found = jax.lax.map(some, tuple(jnp.asarray(x) for x in at))
    values, slopes = (x.reshape(chunks * size, d)[:count] for x in found)
    return values, slopes


def columns_of(n: int, m: int, touched: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Columns of the state y = (u, u', z) that belong to the touched ones of m unknowns: coordinates, their
    rates, internal states; and all others."""
    own = np.array(touched, int)
    u, z = own[own < n], own[own >= n]
    mine = np.concatenate([u, n + u, n + z])
    return mine, np.setdiff1d(np.arange(n + m), mine)


def in_place(
    parts: tuple[Array, Array], columns: tuple[np.ndarray, np.ndarray]
) -> Float[Array, "... d"]:
    """Columns of two kinds beside each other, each in its place."""
    order = np.argsort(np.concatenate(columns))
    return jnp.concatenate(parts, axis=-1)[..., order]
