"""Stiff one way, soft the other."""

import jax.numpy as jnp

from ..parameter import parameter
from ..protocol import NonSmooth
from ..touch import area, contact, depth
from .law import AbstractLaw, Scalar


class Bilinear(AbstractLaw, NonSmooth):
    """`stiffness x` for x > 0 and `other_stiffness x` for x < 0, with a damper beside each.

    A pedestal with loose bolts pressed down (y < 0) stands on its foot, and lifted (y > 0) hangs on what
    its bolts still hold: `LawSupport(y=Bilinear(stiffness=loose, other_stiffness=firm))`. A stop on one
    side has `other_stiffness=0`. `smoothing` (m or rad): both give way to each other over this distance to
    either side of zero; with it the damping is continuous too. Source: Goldman & Muszynska, J. Eng. Gas
    Turbines Power 113 (1991) 567, "Analytical and experimental simulation of loose pedestal dynamic effects".
    """

    stiffness: Scalar = parameter("N*m/rad", nonnegative=True)
    other_stiffness: Scalar = parameter("N*m/rad", nonnegative=True)
    damping: Scalar = parameter("N*m*s/rad", nonnegative=True, default=0.0)
    other_damping: Scalar = parameter("N*m*s/rad", nonnegative=True, default=0.0)
    smoothing: Scalar = parameter("rad", nonnegative=True, default=0.0)

    def _damping(self, x):
        w = self.smoothing
        return self.damping * contact(x, w) + self.other_damping * contact(-x, w)

    def force(self, t, x, v, state):
        w = self.smoothing
        spring = self.stiffness * depth(x, w) - self.other_stiffness * depth(-x, w)
        return spring + self._damping(x) * v

    def energy(self, t, x, state):
        w = self.smoothing
        return self.stiffness * area(x, w) + self.other_stiffness * area(-x, w)

    def power_lost(self, t, x, v, state):
        return self._damping(x) * jnp.square(v)
