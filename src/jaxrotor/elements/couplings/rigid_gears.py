"""A pair of gears that does not yield: the ratio of speeds as a constraint."""

from collections.abc import Iterator
from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractInertia, Ended, Geared, Vec6


class RigidGears(AbstractInertia, Ended, Geared):
    """Two gears in mesh, rigid, as one station that turns: torsion alone, their axes stand still.

    The station turns as gear a does; port `"name.b"` is gear b, which turns `-r_a/r_b` times as fast. In
    `Machine.in_line` the line goes in at a and out at b. No fast vibration of stiff teeth is left to be
    resolved, and the inertia is that of both seen at a, `J_a + (r_a/r_b)² J_b`. The other five coordinates
    are held by themselves; moments and forces on these are borne by the housing and show in `reaction`.
    What the teeth carry follows from the balance of either gear.

    - `radii`: pitch radii of both, m, or anything in their ratio, teeth; that of a ring with teeth inside
      is negative, as in `GearMesh`.
    - `inertias`: of both about their axes, kg·m².

    Source: Den Hartog, Mechanical Vibrations, 4th ed. (1956), sec. 1.3 (geared systems).
    """

    radii: Float[Array, "2"] = parameter("m", shapes=((2,),))
    inertias: Float[Array, "2"] = parameter("kg*m^2", nonnegative=True, shapes=((2,),))

    ports: ClassVar[tuple[str, ...]] = ("b",)
    small_tilts: ClassVar[bool] = True
    turns_only: ClassVar[bool] = True

    def faults(self) -> Iterator[str]:
        a, b = (float(r) for r in self.radii)
        if not (a > 0 and (b > 0 or -b > a)):
            yield (
                f"radii must be positive, or that of gear b negative and the larger where it is a ring with "
                f"teeth inside, but are {a:g} m and {b:g} m"
            )
        if not float(jnp.sum(self.inertias)) > 0:
            yield "inertias must be positive for one gear at least, but are both 0 kg*m^2"

    def ratio(self) -> Float[Array, ""]:
        return -self.radii[0] / self.radii[1]

    def turns(self, port: str) -> Float[Array, ""]:
        return self.ratio() if port == "b" else jnp.ones(())

    def inertia(self) -> Float[Array, ""]:
        """Of both, seen at gear a, kg·m²."""
        a, b = self.inertias
        return a + self.ratio() ** 2 * b

    def acceleration(self, q: Vec6, v: Vec6, Q: Vec6) -> Vec6:
        # the other five are held, whatever their inertia
        return Q.at[5].divide(self.inertia())

    def shift(self, port: str, q: Vec6) -> Vec6 | None:
        if port != "b":
            return None
        return jnp.zeros(6).at[5].set((self.ratio() - 1) * q[5])

    def end(self, side: str) -> str:
        return ".b" if side == "right" else ""

    def kinetic_energy(self, q: Vec6, v: Vec6) -> Float[Array, ""]:
        own, driven = v[5], self.ratio() * v[5]
        return 0.5 * (self.inertias[0] * own**2 + self.inertias[1] * driven**2)

    def weight(self, q: Vec6, gravity: Float[Array, "3"]) -> Vec6:
        return jnp.zeros(6)

    def height_energy(self, q: Vec6, gravity: Float[Array, "3"]) -> Float[Array, ""]:
        return jnp.zeros(())
