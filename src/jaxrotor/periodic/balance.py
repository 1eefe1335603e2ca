"""What is left of the equations of motion order by order, and how it changes with the motion.

The unknowns are the coefficients (2 K + 1, m) of the m = n + k free coordinates and internal states over the
shaft's angle; rates follow from them exactly. Forces are evaluated in all instants at once, in time, and
resolved into orders (alternating frequency/time; Cameron & Griffin, J. Appl. Mech. 56 (1989) 149). The
Jacobian is that of the vector field in each instant, resolved likewise: n_waves times fewer columns are
differentiated than by one through all of it.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..machine.field import n_free, relative_field
from ..machine.system import System
from .waves import Waves


class Balance(NamedTuple):
    """`left`: (size,), size = (2 K + 1) m, what is left, row after row; `slope`: (size, size), its derivative
    by the coefficients; `by_speed`: (size,), by the speed."""

    left: Float[Array, " s"]
    slope: Float[Array, "s s"]
    by_speed: Float[Array, " s"]


def fields(
    system: System, angles: Array, states: Float[Array, "N d"], speed: Array
) -> Float[Array, "N d"]:
    """dy/dt at each of the shaft's angles (rad), turning at `speed` (rad/s); states measured from the turning
    line."""
    zero = jnp.zeros(())

    def one(angle, y):
        return relative_field(zero, y, system, (angle, speed, zero))

    return jax.vmap(one)(angles, states)


def states_of(
    coefficients: Float[Array, "w m"], speed: Array, n: int, basis: np.ndarray, waves: Waves
) -> Float[Array, "N d"]:
    """y = (u, u', z) at the angles of `basis`."""
    along = basis @ coefficients
    rates = speed * ((basis @ waves.derivative) @ coefficients[:, :n])
    return _beside(along[:, :n], rates, along[:, n:])


def left_over(
    system: System, coefficients: Float[Array, "w m"], speed: Array, waves: Waves
) -> Float[Array, "w m"]:
    """Accelerations (m/s^2, rad/s^2) and rates of internal states that the motion has, less those that the
    machine gives it."""
    n, D = n_free(system), waves.derivative
    y = states_of(coefficients, speed, n, waves.at(waves.angles), waves)
    given = fields(system, jnp.asarray(waves.angles), y, speed)[:, n:]
    own = _beside(speed**2 * (D @ D @ coefficients[:, :n]), speed * (D @ coefficients[:, n:]))
    return own - waves.from_samples @ given


def balance(
    system: System, coefficients: Float[Array, "w m"], speed: Array, waves: Waves
) -> Balance:
    n, m = n_free(system), coefficients.shape[1]
    basis, D = waves.at(waves.angles), waves.derivative
    y = states_of(coefficients, speed, n, basis, waves)
    found, J, of_speed = slopes(system, jnp.asarray(waves.angles), y, speed)
    found, J, of_speed = found[:, n:], J[:, n:], of_speed[:, n:]
    rates = (basis @ D) @ coefficients[:, :n]  # by which u' grows with the speed
    of_speed = of_speed + jnp.einsum("jmc,jc->jm", J[..., n : 2 * n], rates)
    u, z = D @ D @ coefficients[:, :n], D @ coefficients[:, n:]
    left = _beside(speed**2 * u, speed * z) - waves.from_samples @ found
    by_speed = _beside(2 * speed * u, z) - waves.from_samples @ of_speed

    def resolved(slopes: Array, wave: np.ndarray) -> Any:
        """(N, m, c) -> (w, m, w, c)."""
        both = (waves.from_samples.T[:, :, None] * wave[:, None, :]).reshape(waves.samples, -1)
        found = both.T @ slopes.reshape(waves.samples, -1)
        return found.reshape(waves.count, waves.count, m, -1).transpose(0, 2, 1, 3)

    of_u = resolved(J[..., :n], basis) + speed * resolved(J[..., n : 2 * n], basis @ D)
    parts = [of_u] if m == n else [of_u, resolved(J[..., 2 * n :], basis)]
    slope = -jnp.concatenate(parts, axis=-1)
    i, k = np.arange(n), np.arange(n, m)
    slope = slope.at[:, i, :, i].add(speed**2 * (D @ D))
    if m > n:
        slope = slope.at[:, k, :, k].add(speed * D)
    size = waves.count * m
    return Balance(left.ravel(), slope.reshape(size, size), by_speed.ravel())


def slopes(
    system: System, angles: Array, states: Float[Array, "N d"], speed: Array
) -> tuple[Float[Array, "N d"], Float[Array, "N d d"], Float[Array, "N d"]]:
    """The vector field at each angle, its Jacobian by the state, and its derivative by the speed: column
    after column, all instants at once, so that the field stands in the program once."""
    d = states.shape[1]

    def along(direction):
        by = jnp.broadcast_to(direction[:d], states.shape)
        return jax.jvp(
            lambda y, w: fields(system, angles, y, w), (states, speed), (by, direction[d])
        )

    values, found = jax.lax.map(along, jnp.eye(d + 1))
    return values[0], jnp.moveaxis(found[:d], 0, -1), found[d]


def _beside(*parts: Any) -> Array:
    return jnp.concatenate([x for x in parts if x.shape[1]], axis=1)
