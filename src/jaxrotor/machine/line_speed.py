"""How fast a line turns now."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .system import System


def line_speed(t: Float[Array, ""], y: Float[Array, " d"], system: System) -> Float[Array, ""]:
    """rad/s: the reference's, and the mean of what free spins add."""
    free = np.array(system.layout.free, int)
    spins = np.flatnonzero(free // system.layout.n_mass == 5)
    w = system.reference(t)[1]
    if not spins.size:
        return w
    own = y[free.size + spins]
    if system.turn is not None:
        own = own / system.turn[free[spins] % system.layout.n_mass]
    return w + jnp.mean(own)
