"""A user's own stiffness and damping between two stations."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractElastic, Energetic, Linear, Motion


class ElasticMatrix(AbstractElastic, Linear, Energetic):
    """Any 12x12 stiffness `K` and damping `C` (SI: N/m, N, N·m/rad; times s for C).

    Order: x, y, z, psi, theta, phi of the left station, then of the right one; the force is
    `-K q - C v`. Neither needs symmetry, but only the symmetric part of K has a potential: with an
    unsymmetric K the energy audit counts the rest as work lost.
    """

    K: Float[Array, "12 12"] = parameter(shapes=((12, 12),), label="SI units")
    C: Float[Array, "12 12"] = parameter(shapes=((12, 12),), label="SI units")

    def matrices(self) -> tuple[Float[Array, "12 12"], Float[Array, "12 12"]]:
        return self.K, self.C

    def forces(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> None:
        return None

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        q = jnp.concatenate([m[0] for m in motions])
        return 0.5 * q @ self.K @ q

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        q = jnp.concatenate([m[0] for m in motions])
        v = jnp.concatenate([m[1] for m in motions])
        return v @ self.C @ v + 0.5 * v @ (self.K - self.K.T) @ q
