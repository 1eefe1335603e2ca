"""Torsional vibration dampers: a ring that turns on its hub."""

from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Energetic, Motion, Signalling, Stateful, Vec6


class TorsionalDamper(AbstractAttachment, Stateful, Energetic, Signalling):
    """A ring on a hub: viscous (Houdaille, Lanchester) with `stiffness` 0, else tuned, as of rubber.

    The states are the ring's angle and speed relative to the hub, so it starts turning with it.
    Only the ring's turning about the axis is counted: its mass and the hub belong to the rotor. Its
    kinetic energy counts in `energy`. Source: Den Hartog, Mechanical Vibrations, 4th ed. (1956),
    secs. 3.3 and 5.5.
    """

    inertia: Float[Array, ""] = parameter("kg*m^2", positive=True)
    damping: Float[Array, ""] = parameter("N*m*s/rad", nonnegative=True)
    stiffness: Float[Array, ""] = parameter("N*m/rad", nonnegative=True, default=0.0)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m", "ring_angle": "rad"}

    def initial(self) -> Float[Array, "2"]:
        return jnp.zeros(2)

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, "2"]:
        carried = accelerations[0][5]
        return jnp.stack([state[1], -self.torque(t, motions, state) / self.inertia - carried])

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return (self.torque(t, motions, state) * jnp.array([0.0, 0, 0, 0, 0, 1]),)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        ((_, v),) = motions
        return 0.5 * self.inertia * (v[5] + state[1]) ** 2 + 0.5 * self.stiffness * state[0] ** 2

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.damping * state[1] ** 2

    def torque(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """On the hub, N·m: positive when the ring leads."""
        return self.stiffness * state[0] + self.damping * state[1]

    def ring_angle(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """The ring's angle relative to the hub, rad."""
        return state[0]
