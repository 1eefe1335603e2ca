"""A rigid floor that moves as it is told."""

from collections.abc import Iterator
from typing import ClassVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from .base_motion import BaseMotion, carried
from .foundation import DAMPING, STIFFNESS, AbstractFoundation, ReadyFoundation, each
from .mounts import mount_faults


class MovingBase(AbstractFoundation):
    """Holds stations to a rigid floor that moves as `base` says: an earthquake, a ship, a shaker's table.

    Attached to n stations, in the order of `places` (n, 3), m: where each mount stands on the floor, from the
    origin about which the floor turns, in the directions x, y, z of the machine. `stiffness` and `damping` of
    the mounts: six numbers (x, y, z, psi, theta, phi), the same for all, or (n, 6), SI. What the stations do
    is told in space; `ground` (m) is a signal of this part.
    """

    base: BaseMotion
    places: Float[Array, "n 3"] = parameter("m", shapes=((None, 3),))
    stiffness: Float[Array, "6"] | Float[Array, "n 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), units=STIFFNESS
    )
    damping: Float[Array, "6"] | Float[Array, "n 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), default=(0.0,) * 6, units=DAMPING
    )

    signals: ClassVar[dict[str, str]] = {"ground": "m"}

    def faults(self) -> Iterator[str]:
        yield from mount_faults(self.places.shape[0], self.stiffness, self.damping)

    def prepared(self) -> ReadyFoundation:
        n, none = self.places.shape[0], jnp.zeros((0, 0))
        return ReadyFoundation(
            none, none, none, none,
            jnp.zeros((n, 6, 0)),
            jax.vmap(carried)(self.places),
            jnp.zeros((0, 6)),
            each(self.stiffness, n),
            each(self.damping, n),
            self.base.prepared(),
        )  # fmt: skip
