"""Springs and dampers to the ground."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..parameter import parameter
from ..protocol import AbstractAttachment, Energetic, Linear, Motion


class LinearSupport(AbstractAttachment, Linear, Energetic):
    """Holds a station to the ground: the force is `-stiffness q - damping v`.

    Each is six numbers (x, y, z, psi, theta, phi) or a full 6x6, SI. Only the symmetric part of the
    stiffness has a potential; cross-coupling counts as work lost (or fed) in the energy audit.
    """

    stiffness: Float[Array, "6"] | Float[Array, "6 6"] = parameter(
        shapes=((6,), (6, 6)), units=("N/m",) * 3 + ("N*m/rad",) * 3
    )
    damping: Float[Array, "6"] | Float[Array, "6 6"] = parameter(
        shapes=((6,), (6, 6)),
        default=(0.0,) * 6,
        units=("N*s/m",) * 3 + ("N*m*s/rad",) * 3,
    )

    def matrices(self) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
        k, c = self.stiffness, self.damping
        return (jnp.diag(k) if k.ndim == 1 else k), (jnp.diag(c) if c.ndim == 1 else c)

    def forces(self, t, motions: tuple[Motion, ...], state) -> None:
        return None

    def energy(self, t, motions: tuple[Motion, ...], state) -> Array:
        ((q, _),) = motions
        k = self.stiffness
        return 0.5 * jnp.sum(k * q**2) if k.ndim == 1 else 0.5 * q @ k @ q

    def power_lost(self, t, motions: tuple[Motion, ...], state) -> Array:
        ((q, v),) = motions
        k, c = self.stiffness, self.damping
        lost = jnp.sum(c * v**2) if c.ndim == 1 else v @ c @ v
        return lost if k.ndim == 1 else lost + 0.5 * v @ (k - k.T) @ q
