"""How fast a line turns now."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .system import System


def line_speed(t: Float[Array, ""], y: Float[Array, " d"], system: System) -> Float[Array, ""]:
    """rad/s: the drive's; where none leads, the mean of the free spins. (What these add to a drive's speed is
    little, and is each member's own in a batch of machines, which then could not share what goes by it.)"""
    if system.ground or system.lead is not None:
        return system.reference(t)[1]
    free = np.array(system.layout.free, int)
    spins = np.flatnonzero(free // system.layout.n_mass == 5)
    if not spins.size:
        return jnp.zeros_like(t)
    own = y[free.size + spins]
    if system.turn is not None:
        turn = system.turn[free[spins] % system.layout.n_mass]
        turns = turn != 0  # what stands still where the line turns tells nothing of it
        own = jnp.where(turns, own / jnp.where(turns, turn, 1.0), 0.0)
        return jnp.sum(own) / jnp.sum(turns)
    return jnp.mean(own)
