"""A place on a shaft with mass, without inertia of its own."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.protocol import Carried, Vec6


class Node(Carried):
    """A station without mass: where shafts with mass meet, end, or are held.

    It takes no parameters. Its motion is that of the shafts beside it, so one of them at least must be
    a `FiniteElementShaft` or `RigidElementShaft`.
    """

    def own_mass(self) -> Float[Array, "6 6"]:
        return jnp.zeros((6, 6))

    def kinetic_energy(self, q: Vec6, v: Vec6) -> Float[Array, ""]:
        return jnp.zeros(())

    def height_energy(self, q: Vec6, gravity: Float[Array, "3"]) -> Float[Array, ""]:
        return jnp.zeros(())
