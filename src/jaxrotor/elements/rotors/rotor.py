"""The rigid rotor with static and dynamic unbalance and geometric imperfection."""

from collections.abc import Iterator
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.gate import takes
from ...core.kinematics import Rows, Tilt, Vector, cross, dot, rotation, rows
from ...core.parameter import parameter
from ...core.part import Part
from ...core.protocol import AbstractInertia, Ended, Nominal, Vec6
from .cylinder import cylinder
from .rigid import rigid_acceleration, rigid_height_energy, rigid_kinetic_energy, rigid_weight
from .unbalance import Unbalance


class Imperfection(Part):
    """A rotor sitting off the shaft's axis, free of stress: eccentric by `offset` (m) at `angle`,
    and tilted by `inclination` (rad) about the in-plane axis at `inclination_angle`.

    It is fixed in the shaft and turns with phi. The elastic elements feel the displacement from that
    shape, so at rest it causes no force, and what turns with phi also acts back on phi.

    Source: Matyja & Łazarz 2014, Fig. 6.
    """

    offset: Float[Array, ""] = parameter("m", nonnegative=True, default=0.0)
    angle: Float[Array, ""] = parameter("rad", default=0.0)
    inclination: Float[Array, ""] = parameter("rad", default=0.0)
    inclination_angle: Float[Array, ""] = parameter("rad", default=0.0)


class Rotor(AbstractInertia, Ended, Nominal):
    """A rigid axisymmetric rotor, thin or long: six degrees of freedom, exact for large angles.

    `ends`: distances (left, right), m, from its geometric centre to the end points on its own axis
    where shafts are fixed. In a line the shafts go to the ends; elsewhere they are ports
    `"main.left"` and `"main.right"`. Without `ends` it is thin: all act at the centre.

    `angle` is the rotor's angular position on the shaft: it is added to the angles of its unbalance
    and of its imperfection. Port `"main.mass_centre"` of a rotor `main` is its mass centre: a force
    there has the moment that its eccentricity gives it.

    Source: Matyja & Łazarz 2014, eqs. of motion, solved in closed form (docs/physics.md, rigid rotor).
    """

    mass: Float[Array, ""] = parameter("kg", positive=True)
    polar_inertia: Float[Array, ""] = parameter("kg*m^2", positive=True)
    transverse_inertia: Float[Array, ""] = parameter("kg*m^2", positive=True)
    unbalance: Unbalance = eqx.field(default_factory=Unbalance)
    imperfection: Imperfection | None = None
    angle: Float[Array, ""] = parameter("rad", default=0.0)
    ends: Float[Array, "2"] | None = parameter(
        "m", nonnegative=True, shapes=((2,),), optional=True, default=None
    )

    ports: ClassVar[tuple[str, ...]] = ("mass_centre", "left", "right")
    falls_freely: ClassVar[bool] = True

    @classmethod
    @takes(unbalance=None, imperfection=None)
    def from_dimensions(
        cls,
        diameter: Any,
        length: Any,
        material: Any,
        bore: Any = 0.0,
        mass: Any = None,
        unbalance: Unbalance | None = None,
        imperfection: Imperfection | None = None,
        angle: Any = 0.0,
        ends: Any = None,
    ) -> "Rotor":
        """A cylinder, solid or with a `bore` along its axis, its geometric centre in the middle.

        **Arguments:**

        - `diameter`, `length`, `bore`: m. - `material`: a `Material` such as `STEEL`, of which the density
          counts, or a density in kg/m³.
        - `mass`: kg, where it was weighed: the inertias are those of the cylinder with this mass. A warning
          tells where it is off by over 3 % from what dimensions and density make.
        - `unbalance`, `imperfection`, `angle`, `ends`: as for `Rotor`; shafts that end at its faces:
          `ends=(length / 2, length / 2)`.

        Differentiable by all dimensions. Raises `InputError` where they cannot be those of a cylinder.
        """
        figures = cylinder(diameter, length, material, bore, mass)
        balance = Unbalance() if unbalance is None else unbalance
        return cls(*figures, balance, imperfection, angle, ends)

    def faults(self) -> Iterator[str]:
        jp, jt = float(self.polar_inertia), float(self.transverse_inertia)
        if jp > 2 * jt:
            yield (
                f"polar_inertia must be at most twice the transverse_inertia (no body is flatter "
                f"than a thin disc), but is {jp:g} against {jt:g} kg*m^2"
            )

    def acceleration(self, q: Vec6, v: Vec6, Q: Vec6) -> Vec6:
        u, jt, jp = self.unbalance, self.transverse_inertia, self.polar_inertia
        at = rows(q)
        at_g = at[5] + self.angle + u.inclination_angle
        sin_g, cos_g = jnp.sin(u.inclination), jnp.cos(u.inclination)
        n = (jnp.sin(at_g) * sin_g, -jnp.cos(at_g) * sin_g, cos_g + jnp.zeros_like(at_g))

        # I = Jt 1 + (Jp - Jt) n nᵀ, whose inverse has the same form
        def gyroscopic(w: Vector) -> Vector:
            x, y, z = cross(w, n)
            momentum = (jp - jt) * dot(n, w)
            return momentum * x, momentum * y, momentum * z

        def inverse(a: Vector) -> Vector:
            extra = (jt / jp - 1) * dot(n, a)
            return (
                (a[0] + extra * n[0]) / jt,
                (a[1] + extra * n[1]) / jt,
                (a[2] + extra * n[2]) / jt,
            )

        return rigid_acceleration(
            at,
            v,
            Q,
            self.mass,
            self._offset(at),
            gyroscopic,
            inverse,
        )

    def _offset(self, q: Rows) -> tuple[Array, Array]:
        """Mass centre less geometric centre in the frame that tilts but does not spin, m."""
        at, e = q[5] + self.angle + self.unbalance.angle, self.unbalance.eccentricity
        return e * jnp.cos(at), e * jnp.sin(at)

    def mass_centre(self) -> Float[Array, "3"]:
        """Mass centre less geometric centre in the frame that turns with phi, m."""
        at = self.angle + self.unbalance.angle
        e = self.unbalance.eccentricity
        return jnp.stack([e * jnp.cos(at), e * jnp.sin(at), jnp.zeros_like(e)])

    def tensor(self) -> Float[Array, "3 3"]:
        """Inertia tensor about the mass centre in the frame that turns with phi, kg·m²."""
        at = self.angle + self.unbalance.inclination_angle
        s, c = jnp.sin(self.unbalance.inclination), jnp.cos(self.unbalance.inclination)
        axis = jnp.stack([jnp.sin(at) * s, -jnp.cos(at) * s, c])
        jt, jp = self.transverse_inertia, self.polar_inertia
        return jt * jnp.eye(3) + (jp - jt) * jnp.outer(axis, axis)

    def kinetic_energy(self, q: Vec6, v: Vec6) -> Float[Array, ""]:
        return rigid_kinetic_energy(q, v, self.mass, self.mass_centre(), self.tensor())

    def weight(self, q: Vec6, gravity: Float[Array, "3"]) -> Vec6:
        at = rows(q)
        return rigid_weight(at, self.mass, self._offset(at), gravity)

    def height_energy(self, q: Vec6, gravity: Float[Array, "3"]) -> Float[Array, ""]:
        return rigid_height_energy(q, self.mass, self.mass_centre(), gravity)

    def shift(self, port: str, q: Vec6) -> Vec6 | None:
        if port == "mass_centre":
            return jnp.concatenate([rotation(q) @ self.mass_centre(), jnp.zeros(3)])
        place = rows(q)
        along = jnp.zeros_like(place[0])
        if port in ("left", "right") and self.ends is not None:
            along = -self.ends[0] if port == "left" else self.ends[1]
        shape = self._shape(place, along)
        if port == "":
            return shape
        zero = jnp.zeros_like(place[0])
        sp, cp, st, ct = Tilt.of(place[3], place[4])
        # the axis, tilted, less itself
        end = jnp.stack([along * st, -along * sp * ct, along * (cp * ct - 1.0), zero, zero, zero])
        return end if shape is None else end + shape

    def end(self, side: str) -> str:
        return "" if self.ends is None else f".{side}"

    def _shape(self, q: Rows, along: Array) -> Vec6 | None:
        """Less the stress-free displacement of the imperfect rotor, `along` its axis from C."""
        if self.imperfection is None:
            return None
        d = self.imperfection
        at_d = q[5] + self.angle + d.angle
        at_i = q[5] + self.angle + d.inclination_angle
        zero = jnp.zeros_like(at_d)
        # dx/dz = +theta, dy/dz = -psi
        return -jnp.stack(
            [
                d.offset * jnp.cos(at_d) + along * d.inclination * jnp.sin(at_i),
                d.offset * jnp.sin(at_d) - along * d.inclination * jnp.cos(at_i),
                zero,
                d.inclination * jnp.cos(at_i),
                d.inclination * jnp.sin(at_i),
                zero,
            ]
        )

    def nominal(self) -> "Rotor":
        return eqx.tree_at(
            lambda r: (r.unbalance, r.imperfection, r.angle),
            self,
            (Unbalance(), None if self.imperfection is None else Imperfection(), jnp.zeros(())),
            is_leaf=lambda x: x is None,
        )
