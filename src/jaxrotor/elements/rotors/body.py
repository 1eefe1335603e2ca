"""A rigid body with any inertia: three distinct moments, any mass centre."""

from collections.abc import Iterator
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.kinematics import Rows, Vector, cross, rotation, rows
from ...core.parameter import parameter
from ...core.protocol import AbstractInertia, Ported, Vec6
from .rigid import rigid_acceleration, rigid_height_energy, rigid_kinetic_energy, rigid_weight


class RigidBody(AbstractInertia, Ported):
    """A rigid body without symmetry: a bladed hub, a crank, a casing.

    `inertia` is the tensor about the mass centre, kg·m², in the frame that turns with phi: three
    principal moments along its axes, or the full symmetric 3x3. `mass_centre` (m) lies in the same
    frame, seen from the station's centre; port `"name.mass_centre"` is there.
    """

    mass: Float[Array, ""] = parameter("kg", positive=True)
    inertia: Float[Array, "3"] | Float[Array, "3 3"] = parameter("kg*m^2", shapes=((3,), (3, 3)))
    mass_centre: Float[Array, "3"] = parameter("m", shapes=((3,),), default=(0.0, 0.0, 0.0))

    ports: ClassVar[tuple[str, ...]] = ("mass_centre",)
    falls_freely: ClassVar[bool] = True

    def faults(self) -> Iterator[str]:
        J = np.diag(self.inertia) if self.inertia.ndim == 1 else self.inertia
        if not np.allclose(J, J.T, rtol=1e-12, atol=0.0):
            yield "inertia must be symmetric, but the matrix given is not"
            return
        least, middle, most = np.linalg.eigvalsh(J)
        if least <= 0 or most > (1 + 1e-12) * (least + middle):
            yield (
                "inertia must have positive principal moments, none larger than the sum of the "
                f"other two, but they are {least:g}, {middle:g}, {most:g} kg*m^2"
            )

    def tensor(self) -> Float[Array, "3 3"]:
        """The tensor as a matrix."""
        return jnp.diag(self.inertia) if self.inertia.ndim == 1 else self.inertia

    def acceleration(self, q: Vec6, v: Vec6, Q: Vec6) -> Vec6:
        at = rows(q)
        s, c = jnp.sin(at[5]), jnp.cos(at[5])

        def back(a: Vector) -> Vector:
            return c * a[0] + s * a[1], c * a[1] - s * a[0], a[2]

        def times(matrix: Float[Array, "3 3"], a: Vector) -> Vector:
            b = back(a)
            x, y, z = (m[0] * b[0] + m[1] * b[1] + m[2] * b[2] for m in map(rows, rows(matrix)))
            return _spun(at, (x, y, z))

        J = self.tensor()
        inverse = _inverse_symmetric(J)
        return rigid_acceleration(
            at,
            v,
            Q,
            self.mass,
            self._offset(at),
            lambda w: cross(w, times(J, w)),
            lambda a: times(inverse, a),
        )

    def _offset(self, q: Rows) -> Vector:
        """Mass centre less the station's centre in the frame that tilts but does not spin, m."""
        x, y, z = rows(self.mass_centre)
        return _spun(q, (x, y, z))

    def shift(self, port: str, q: Vec6) -> Vec6 | None:
        if port != "mass_centre":
            return None
        return jnp.concatenate([rotation(q) @ self.mass_centre, jnp.zeros(3)])

    def kinetic_energy(self, q: Vec6, v: Vec6) -> Float[Array, ""]:
        return rigid_kinetic_energy(q, v, self.mass, self.mass_centre, self.tensor())

    def weight(self, q: Vec6, gravity: Float[Array, "3"]) -> Vec6:
        at = rows(q)
        return rigid_weight(at, self.mass, self._offset(at), gravity)

    def height_energy(self, q: Vec6, gravity: Float[Array, "3"]) -> Float[Array, ""]:
        return rigid_height_energy(q, self.mass, self.mass_centre, gravity)


def _spun(q: Rows, a: Vector) -> Vector:
    """From the body's frame to the one that tilts but does not spin."""
    s, c = jnp.sin(q[5]), jnp.cos(q[5])
    return c * a[0] - s * a[1], s * a[0] + c * a[1], a[2]


def _inverse_symmetric(J: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """By cofactors: elementwise, where a library inverse would be a call per evaluation."""
    rows = [jnp.cross(J[1], J[2]), jnp.cross(J[2], J[0]), jnp.cross(J[0], J[1])]
    return jnp.stack(rows) / (J[0] @ rows[0])
