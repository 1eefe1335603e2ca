"""Stiffness and damping as matrices: between two stations, and of a whole machine."""

from collections.abc import Iterator
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, AbstractElastic, Energetic, Linear, Motion


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


class DampingMatrix(AbstractAttachment, Linear, Energetic):
    """Damping that couples any stations: the force is `-damping v`, v the rates of x, y, z, psi, theta, phi
    of the first station, then of the next. The symmetric (6 n, 6 n) matrix (SI: N·s/m, N·s, N·m·s) must not
    feed energy. Attached to n stations in this order. `linear.with_modal_damping` makes one.
    """

    damping: Float[Array, "n n"] = parameter(shapes=((None, None),), label="SI units")

    def faults(self) -> Iterator[str]:
        C = np.asarray(self.damping)
        n = len(C)
        if C.shape != (n, n) or n % 6 or not n:
            yield f"damping must be square, six rows for each station, but has the shape {C.shape}"
        elif not np.allclose(C, C.T, rtol=1e-9, atol=1e-12 * np.abs(C).max()):
            yield "damping must be symmetric, but is not"
        elif np.linalg.eigvalsh(C)[0] < -1e-9 * np.abs(C).max():
            yield f"damping must not feed energy, but has the eigenvalue {np.linalg.eigvalsh(C)[0]:g}"

    def matrices(self) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
        return jnp.zeros_like(self.damping), self.damping

    def forces(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> None:
        return None

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return jnp.zeros(())

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        v = jnp.concatenate([m[1] for m in motions])
        return v @ self.damping @ v
