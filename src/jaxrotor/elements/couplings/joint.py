"""The universal joint: two shafts that meet at an angle."""

from collections.abc import Iterator
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractElastic, Energetic, Motion, Signalling, Vec6


class UniversalJoint(AbstractElastic, Energetic, Signalling):
    """A Cardan (Hooke's) joint between shafts whose lines meet at `angle`: the right yoke runs unevenly,
    twice in a turn, `tan g = tan(phi - plane) cos(angle)` where the left one stands at phi.

    The yokes' twist `phi_b - g(phi_a)` is held by `stiffness` and `damping`; by virtual work the left shaft
    bears `g'` times the right one's torque. Everything else stays free: guide both shafts by bearings. Each
    station is measured along its own shaft.

    - `stiffness`: N·m/rad, `damping`: N·m·s/rad, of the cross and its yokes in twist.
    - `angle`: rad, between the shafts' lines, below 80 degrees. `plane`: rad, where the left yoke stands as
      it lies in the plane of both shafts.

    Sources: Porat, J. Mechanisms 15 (1980) 403; Xu & Marangoni, J. Sound Vib. 176 (1994) 663 (misalignment).
    """

    stiffness: Float[Array, ""] = parameter("N*m/rad", positive=True)
    damping: Float[Array, ""] = parameter("N*m*s/rad", nonnegative=True, default=0.0)
    angle: Float[Array, ""] = parameter("rad", nonnegative=True, default=0.0)
    plane: Float[Array, ""] = parameter("rad", default=0.0)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m"}

    def faults(self) -> Iterator[str]:
        if float(self.angle) > np.deg2rad(80):
            yield f"angle must be below 80 degrees, but is {np.rad2deg(float(self.angle)):.4g} degrees"

    def _follows(self, phi: Array) -> Array:
        """The right yoke's angle, without a jump in any turn."""
        a = phi - self.plane
        c = jnp.cos(self.angle)
        # what it is ahead by: the angle between (cos a, c sin a) and (cos a, sin a), never a half turn
        ahead = jnp.arctan2(
            (c - 1) * jnp.sin(a) * jnp.cos(a), jnp.cos(a) ** 2 + c * jnp.sin(a) ** 2
        )
        return phi + ahead

    def _twist(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, Array]:
        """Twist, its rate, and how fast the right yoke turns for the left one's turning."""
        (qa, va), (qb, vb) = motions
        g, ratio = jax.jvp(self._follows, (qa[5],), (jnp.ones_like(qa[5]),))
        return qb[5] - g, vb[5] - ratio * va[5], ratio

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        x, x_t, ratio = self._twist(motions)
        torque = self.stiffness * x + self.damping * x_t
        about = jnp.zeros(6).at[5].set(1.0)
        return ratio * torque * about, -torque * about

    def torque(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """On the right yoke's side, N·m: positive when the right end leads."""
        x, x_t, _ = self._twist(motions)
        return self.stiffness * x + self.damping * x_t

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        x, _, _ = self._twist(motions)
        return 0.5 * self.stiffness * x**2

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        _, x_t, _ = self._twist(motions)
        return self.damping * x_t**2
