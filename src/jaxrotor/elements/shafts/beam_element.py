"""One finite element of a shaft, with its matrices computed."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.kinematics import from_turning, spin_speed
from ...core.protocol import (
    AbstractElastic,
    Condensable,
    Energetic,
    Linear,
    Massive,
    Motion,
    Powered,
    Signalling,
    Vec6,
)
from ...core.turning import turning_forces
from .preload import Preload
from .segment import Segment
from .twist import damped_rates, twist_torque


class AbstractBeamElement(Massive, Linear, Energetic, Signalling):
    """Made by `FiniteElementShaft`. K is the elastic stiffness, which damps and bears; what `preload` adds to
    it is neither."""

    segment: Segment
    K: Float[Array, "12 12"]
    M: Float[Array, "12 12"]
    G: Float[Array, "12 12"]
    rayleigh: Float[Array, "2"]
    preload: Preload | None
    damping: str = eqx.field(static=True)
    twist: str = eqx.field(static=True)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m"}

    def matrices(self) -> tuple[Array, Array]:
        K = self.K if self.preload is None else self.K + self.preload.stiffness(self.segment)
        return K, self.rayleigh[0] * self.M + self.rayleigh[1] * self.K

    def mass_matrix(self) -> Float[Array, "12 12"]:
        return self.M

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        G, rotating = self.turning()
        q, v = (jnp.stack([m[i] for m in motions], axis=1) for i in (0, 1))
        angles = from_turning(q, v) if self.twist == "invariant" else (q, v)
        on = turning_forces(G, rotating, q, v, spin_speed(*angles))
        return on[:, 0], on[:, 1]

    def turning(self) -> tuple[Array, Array | None]:
        return self.G, self.rayleigh[1] * self.K if self.damping == "rotating" else None

    def torque(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Twisting moment, N·m: positive when the right end leads."""
        k = self.K[11, 11]
        return twist_torque(k, self.rayleigh[1] * k, motions)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        a, b = (q for q, _ in motions)
        strain = self.segment.strain_energy(a, b)
        return strain if self.preload is None else strain + self.preload.energy(self.segment, a, b)

    def kinetic_energy(self, motions: tuple[Motion, ...]) -> Array:
        return self.segment.kinetic_energy(motions)

    def height_energy(self, motions: tuple[Motion, ...], gravity: Float[Array, "3"]) -> Array:
        return self.segment.height_energy(motions, gravity)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        rates = damped_rates(motions, self.damping)
        alpha, beta = self.rayleigh
        kinetic = self.segment.kinetic_energy(motions, hat=False)
        return 2 * alpha * kinetic + 2 * beta * self.segment.strain_energy(*rates)


class BeamElement(AbstractBeamElement, AbstractElastic, Condensable):
    """Whose two planes of bending do not couple: without a torque in its `preload`."""


class TwistedBeamElement(AbstractBeamElement, AbstractElastic, Powered):
    """With a torque in its `preload`, by which each plane of bending pushes the other."""

    def power_in(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return jnp.zeros(()) if self.preload is None else self.preload.power_in(motions)
