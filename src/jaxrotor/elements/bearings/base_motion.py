"""How the ground moves, and what that is at its points."""

from collections.abc import Iterator

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.kinematics import COORDINATES
from ...core.protocol import Vec6
from ...profiles.base import LARGEST_TURN, AbstractBase
from ...profiles.motion import AbstractMotion, differentiate


class BaseMotion(AbstractBase):
    """The motion of the ground under a machine, in the coordinates of a station: `x`, `y`, `z` (m) of its
    origin and small turns `psi`, `theta`, `phi` (rad) about it, each an `AbstractMotion` such as an
    `AccelerationRecord`; what is left out stays zero.

    Coordinates are those of space that stands still, so that what a turning ground does to a spinning rotor
    (gyroscopic moments, centrifugal and Coriolis forces) needs no terms of its own. Turns are of first order
    and may come to 0.02 rad: beyond that they are refused, or, of a motion that does not know its `reach`,
    told after a run. What is left out is the weight's part along a floor that leans, and forces that lean
    with it.
    """

    x: AbstractMotion | None = eqx.field(default=None, metadata={"straight": True})
    y: AbstractMotion | None = eqx.field(default=None, metadata={"straight": True})
    z: AbstractMotion | None = eqx.field(default=None, metadata={"straight": True})
    psi: AbstractMotion | None = None
    theta: AbstractMotion | None = None
    phi: AbstractMotion | None = None

    def faults(self) -> Iterator[str]:
        if all(motion is None for motion in self._each()):
            yield f"a motion must be given for one of {', '.join(COORDINATES)}, but there is none"
        for name, motion in zip(COORDINATES[3:], self._each()[3:]):
            reach = None if motion is None else motion.reach()
            if reach is not None and float(reach) > LARGEST_TURN:
                yield (
                    f"{name} must not exceed {LARGEST_TURN} rad, of which first order is right, but comes to "
                    f"{float(reach):.3g} rad: leave it out, and give what it does at the machine as motions "
                    "along x, y, z, or a turned gravity"
                )

    def at(self, t: Float[Array, ""]) -> tuple[Vec6, Vec6, Vec6]:
        """Coordinates, rates and accelerations at the time t (s)."""

        def coordinates(s: Array) -> Vec6:
            each = [jnp.zeros_like(s) if m is None else m.position(s) for m in self._each()]
            return jnp.stack(each)

        return differentiate(coordinates, t)  # pyright: ignore[reportReturnType]

    def jumps(self) -> Float[Array, " n"]:
        """Instants at which an acceleration jumps or kinks, s."""
        given = [motion.jumps() for motion in self._each() if motion is not None]
        return jnp.concatenate([jnp.zeros(0), *given])

    def prepared(self) -> "BaseMotion":
        """With the work done once that its motions have."""
        return BaseMotion(*(None if m is None else m.prepared() for m in self._each()))

    def _each(self) -> tuple[AbstractMotion | None, ...]:
        return self.x, self.y, self.z, self.psi, self.theta, self.phi


def carried(place: Float[Array, "3"]) -> Float[Array, "6 6"]:
    """What a rigid body's six coordinates make of a point at `place` (m) from its origin, to first order."""
    x, y, z = place
    none, one = jnp.zeros_like(x), jnp.ones_like(x)
    arm = jnp.stack([jnp.stack([none, z, -y]), jnp.stack([-z, none, x]), jnp.stack([y, -x, none])])
    unit = one * jnp.eye(3)
    return jnp.block([[unit, arm], [jnp.zeros((3, 3)), unit]])
