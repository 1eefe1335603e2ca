"""A rigid block on springs, with machines on it."""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.elimination import inverse
from ...core.parameter import parameter
from .base_motion import BaseMotion, carried
from .foundation import DAMPING, STIFFNESS, AbstractFoundation, ReadyFoundation, each
from .mounts import mount_faults


class FoundationBlock(AbstractFoundation):
    """A rigid block (a skid, a concrete foundation, a turbine table) with six degrees of freedom on springs,
    that carries one machine or several.

    Attached to n stations, in the order of `places` (n, 3), m: where each mount stands on the block, from its
    mass centre, in the directions x, y, z of the machine. `stiffness`, `damping` of the mounts and
    `spring_stiffness`, `spring_damping` of what holds the block at `springs` (s, 3), m, to the ground: six
    numbers (x, y, z, psi, theta, phi), the same for all, or a row of six for each, SI. `inertia`, kg·m²:
    about x, y, z through the mass centre, three numbers or the full tensor. `base`: how the ground moves,
    which turns about the block's mass centre; at rest where left out.

    Small motions. The block is measured from where it rests under its own weight alone.
    """

    mass: Float[Array, ""] = parameter("kg", positive=True)
    inertia: Float[Array, "3"] | Float[Array, "3 3"] = parameter("kg*m^2", shapes=((3,), (3, 3)))
    places: Float[Array, "n 3"] = parameter("m", shapes=((None, 3),))
    stiffness: Float[Array, "6"] | Float[Array, "n 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), units=STIFFNESS
    )
    springs: Float[Array, "s 3"] = parameter("m", shapes=((None, 3),))
    spring_stiffness: Float[Array, "6"] | Float[Array, "s 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), units=STIFFNESS
    )
    damping: Float[Array, "6"] | Float[Array, "n 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), default=(0.0,) * 6, units=DAMPING
    )
    spring_damping: Float[Array, "6"] | Float[Array, "s 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), default=(0.0,) * 6, units=DAMPING
    )
    base: BaseMotion | None = None

    def faults(self) -> Iterator[str]:
        J = np.asarray(self.tensor())
        if not np.allclose(J, J.T, rtol=1e-12, atol=0.0):
            yield "inertia must be symmetric, but the matrix given is not"
        elif np.linalg.eigvalsh(J)[0] <= 0:
            yield f"inertia must be positive about every axis, but is {np.linalg.eigvalsh(J)[0]:g} kg*m^2"
        yield from mount_faults(self.places.shape[0], self.stiffness, self.damping)
        yield from mount_faults(
            self.springs.shape[0], self.spring_stiffness, self.spring_damping, "spring_"
        )

    def tensor(self) -> Float[Array, "3 3"]:
        """The inertia as a matrix, kg·m²."""
        return jnp.diag(self.inertia) if self.inertia.ndim == 1 else self.inertia

    def mass_matrix(self) -> Float[Array, "6 6"]:
        """Of its six coordinates: of the mass centre (m), turns about it (rad)."""
        none = jnp.zeros((3, 3))
        return jnp.block([[self.mass * jnp.eye(3), none], [none, self.tensor()]])

    def ground_matrices(self) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
        """Stiffness and damping of the springs in the same coordinates."""
        T, count = jax.vmap(carried)(self.springs), self.springs.shape[0]
        K, C = (
            jnp.einsum("sia,si,sib->ab", T, each(x, count), T)
            for x in (self.spring_stiffness, self.spring_damping)
        )
        return K, C

    def prepared(self) -> ReadyFoundation:
        (K, C), M, n = self.ground_matrices(), self.mass_matrix(), self.places.shape[0]
        T = jax.vmap(carried)(self.places)
        return ReadyFoundation(
            M, inverse(M), C, K, T, T, M,
            each(self.stiffness, n),
            each(self.damping, n),
            None if self.base is None else self.base.prepared(),
        )  # fmt: skip
