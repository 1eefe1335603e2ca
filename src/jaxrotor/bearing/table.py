"""A bearing given by its measured or computed characteristic."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..centres import direction, pushed, relative
from ..elastic.law import AbstractLaw
from ..protocol import AbstractAttachment, Energetic, Motion, NonSmooth, Vec6


class RadialBearing(AbstractAttachment, Energetic, NonSmooth):
    """The same law in every radial direction: `RadialBearing(TabulatedLaw(deflections, forces))` is a rolling
    bearing by its table of stiffness, `RadialBearing(Backlash(...))` one with clearance (`gap` is the
    diametral).

    Attached to the journal's station, or to `(journal, housing)`. The law's force acts along the line of
    centres, its `x` is their distance (m); its damping acts there too, none across. Laws with states are
    refused.
    """

    law: AbstractLaw = eqx.field(metadata={"straight": True})

    def faults(self):
        if self.law.initial().shape[0]:
            yield "law must be without a memory: the direction of the line of centres changes"

    def _line(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, Array]:
        """Distance, its rate and the direction."""
        e, e_t = relative(motions)
        r, n = direction(e)
        return r, e_t @ n, n

    def forces(self, t, motions: tuple[Motion, ...], state) -> tuple[Vec6, ...]:
        r, r_t, n = self._line(motions)
        f = -self.law.force(t, r, r_t, jnp.zeros(0)) * n
        zero = jnp.zeros_like(r)
        return pushed(motions, f, zero, zero)

    def energy(self, t, motions: tuple[Motion, ...], state) -> Array:
        return self.law.energy(t, self._line(motions)[0], jnp.zeros(0))

    def power_lost(self, t, motions: tuple[Motion, ...], state) -> Array:
        r, r_t, _ = self._line(motions)
        return self.law.power_lost(t, r, r_t, jnp.zeros(0))
