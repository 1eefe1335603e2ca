"""The kinematic drive: an end of the line whose motion is given."""

from typing import ClassVar

from jaxtyping import Array, Float

from ...core.kinematics import about_axis
from ...core.parameter import parameter
from ...core.protocol import AbstractPrescribed, Timed, Vec6
from ...profiles.motion import AbstractMotion


class PrescribedSpin(AbstractPrescribed, Timed):
    """A driven end that spins as `profile` says and is clamped otherwise: x, y, z, psi and theta stay zero,
    so it carries weight and bending moment. A shaft end that is driven but free to whirl is a `Node()` with
    `prescribed={"end": {"phi": profile}}` of the `Machine` (and `fixed={"end": ["z"]}` where nothing else
    holds it along z), or has a `Coupling` between.

    `profile`: a motion over the angle, such as `CosineRamp` (speeds in rad/s). `angle` (rad) is phi at the
    profile's zero. The drive's torque and power are the station's `reaction` in the results.
    """

    profile: AbstractMotion
    angle: Float[Array, ""] = parameter("rad", default=0.0)

    spin_only: ClassVar[bool] = True

    def motion(self, t: Float[Array, ""]) -> Vec6:
        return about_axis(self.angle + self.profile.position(t))

    def times(self) -> Float[Array, " n"]:
        return self.profile.jumps()
