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
        own = own / system.turn[free[spins] % system.layout.n_mass]
    return jnp.mean(own)
