"""A law of one's own, for rk4_rig.toml: `kind = "microslip:Microslip"`."""

import jax
import jax.numpy as jnp

import jaxrotor as jr
from jaxrotor.elements import AbstractLaw


class Microslip(AbstractLaw):
    """A joint that slips the more the further it moves: (k x + c v)/(1 + (x/reach)²)."""

    stiffness: jax.Array = jr.parameter("N*m/rad", positive=True)
    damping: jax.Array = jr.parameter("N*m*s/rad", nonnegative=True)
    reach: jax.Array = jr.parameter("rad", positive=True)

    def force(self, t, x, v, state):
        return (self.stiffness * x + self.damping * v) / (1 + (x / self.reach) ** 2)

    def energy(self, t, x, state):
        return 0.5 * self.stiffness * self.reach**2 * jnp.log1p((x / self.reach) ** 2)

    def power_lost(self, t, x, v, state):
        return self.damping * v**2 / (1 + (x / self.reach) ** 2)
