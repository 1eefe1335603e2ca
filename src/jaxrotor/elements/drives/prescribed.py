"""The kinematic drive: an end of the line whose motion is given."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractPrescribed, Timed, Vec6
from ...profiles.motion import AbstractMotion


class PrescribedSpin(AbstractPrescribed, Timed):
    """A driven end in a thrust bearing: it spins as `profile` says, all else stays at zero.

    `angle` (rad) is phi at the profile's zero. The drive's torque and power are the station's
    `reaction` in the results.
    """

    profile: AbstractMotion
    angle: Float[Array, ""] = parameter("rad", default=0.0)

    spin_only: ClassVar[bool] = True

    def motion(self, t: Float[Array, ""]) -> Vec6:
        phi = self.angle + self.profile.position(t)
        zero = jnp.zeros_like(phi)
        return jnp.stack([zero, zero, zero, zero, zero, phi])

    def times(self) -> Float[Array, " n"]:
        return self.profile.jumps()
