"""A support by laws: stops, loose pedestals, measured characteristics."""

from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.kinematics import COORDINATES
from ...core.protocol import AbstractAttachment, Energetic, Motion, Stateful, Timed, Vec6
from ..laws.law import AbstractLaw, each_law, end_to_end, laws_of


class LawSupport(AbstractAttachment, Energetic, Stateful, Timed):
    """Holds a station to the ground by a law for each coordinate that has one.

    `LawSupport(x=Backlash(...), y=Backlash(...))` is a pair of clearance stops,
    `LawSupport(y=Bilinear(...))` a pedestal that lifts off. A law sees the coordinate and its rate; its
    positive force pulls the station back. Between two stations the same laws belong in a `Coupling`.
    """

    x: AbstractLaw | None = eqx.field(default=None, metadata={"straight": True})
    y: AbstractLaw | None = eqx.field(default=None, metadata={"straight": True})
    z: AbstractLaw | None = eqx.field(default=None, metadata={"straight": True})
    psi: AbstractLaw | None = None
    theta: AbstractLaw | None = None
    phi: AbstractLaw | None = None

    def faults(self) -> Iterator[str]:
        if not laws_of(self):
            yield f"a law must be given for one of {', '.join(COORDINATES)}, but there is none"

    def _each(self, motions: tuple[Motion, ...], state: Any) -> Iterator[tuple]:
        """Number, law, coordinate, rate and states of each."""
        ((q, v),) = motions
        for i, law, own in each_law(self, state):
            yield i, law, q[i], v[i], own

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        total = jnp.zeros(6)
        for i, law, x, v, own in self._each(motions, state):
            total = total.at[i].add(-law.force(t, x, v, own))
        return (total,)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        each = [law.energy(t, x, own) for _, law, x, _, own in self._each(motions, state)]
        return sum(each, jnp.zeros(()))

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        each = [law.power_lost(t, x, v, own) for _, law, x, v, own in self._each(motions, state)]
        return sum(each, jnp.zeros(()))

    def initial(self) -> Float[Array, " k"]:
        return end_to_end([law.initial() for law in laws_of(self).values()])

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        return end_to_end([law.rates(t, x, v, s) for _, law, x, v, s in self._each(motions, state)])

    def times(self) -> Float[Array, " n"]:
        return end_to_end([law.times() for law in laws_of(self).values()])
