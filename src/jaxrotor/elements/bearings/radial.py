"""A bearing given by its measured or computed characteristic."""

from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.protocol import AbstractAttachment, Energetic, Motion, NonSmooth, Vec6
from ..laws.centres import direction, pushed, radially, relative
from ..laws.law import AbstractLaw


class RadialBearing(AbstractAttachment, Energetic, NonSmooth):
    """The same law in every radial direction: `RadialBearing(TabulatedLaw(deflections, forces))` is a rolling
    bearing by its table of stiffness, `RadialBearing(Backlash(...))` one with clearance (`gap` is the
    diametral).

    Attached to the journal's station, or to `(journal, housing)`. The law's `x` is the distance of the
    centres (m). Its spring, and the damping of what touches only beyond some distance, act along their line.
    The damping that it has with the centres together acts against the velocity itself, whatever its
    direction: so `KelvinVoigt(k, c)` is the isotropic support of k and c. Laws with states are refused, and
    laws that push with the centres together.
    """

    law: AbstractLaw = eqx.field(metadata={"straight": True})

    def faults(self) -> Iterator[str]:
        if self.law.initial().shape[0]:
            yield "law must be without a memory: the direction of the line of centres changes"
            return
        start = jnp.zeros(())
        push = float(self.law.force(start, start, start, jnp.zeros(0)))
        if push != 0:
            yield f"law must not push where x is zero, but does with {push:g} N: it has no direction there"

    def _line(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, Array]:
        """Distance, its rate and the direction."""
        e, e_t = relative(motions)
        r, n = direction(e)
        return r, e_t @ n, n

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        e, e_t = relative(motions)
        _, r_t, _ = self._line(motions)
        zero, none = jnp.zeros_like(r_t), jnp.zeros(0)
        together = self.law.force(t, zero, r_t, none)
        along = radially(lambda r: self.law.force(t, r, r_t, none) - together, e)
        damped = radially(lambda rate: self.law.force(t, zero, rate, none), e_t)
        return pushed(motions, -along - damped, zero, zero)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.law.energy(t, self._line(motions)[0], jnp.zeros(0))

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        r, r_t, _ = self._line(motions)
        e_t = relative(motions)[1]
        zero, none = jnp.zeros_like(r), jnp.zeros(0)
        together = [self.law.power_lost(t, zero, x, none) for x in (r_t, direction(e_t)[0])]
        return self.law.power_lost(t, r, r_t, none) - together[0] + together[1]
