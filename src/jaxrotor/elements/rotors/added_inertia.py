"""Mass fixed to a station that has its own equations: a flange, a half coupling, a load's inertia."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Massive, Motion


class AddedInertia(AbstractAttachment, Massive):
    """Balanced inertia added to a station, or to a `Node` of a shaft with mass.

    `mass` kg, or three numbers where it differs along x, y and z, as that of a pedestal that stands for a
    casing does; `polar_inertia` and `transverse_inertia` kg·m² about its own mass centre; `offset` (m)
    places that centre along the axis from the station. With `mass` 0 it is the reduced inertia of what
    the machine drives. Small tilts, as shafts with mass are: a large rotor is a `Rotor`.
    """

    mass: Float[Array, ""] | Float[Array, "3"] = parameter(
        "kg", nonnegative=True, shapes=((), (3,)), default=0.0
    )
    polar_inertia: Float[Array, ""] = parameter("kg*m^2", nonnegative=True, default=0.0)
    transverse_inertia: Float[Array, ""] = parameter("kg*m^2", nonnegative=True, default=0.0)
    offset: Float[Array, ""] = parameter("m", default=0.0)

    def forces(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> None:
        return None

    def mass_matrix(self) -> Float[Array, "6 6"]:
        s, zero = self.offset, jnp.zeros(())
        mx, my, mz = self._along()
        # x + s theta and y - s psi are the mass centre's displacements
        return jnp.stack(
            [
                jnp.stack([mx, zero, zero, zero, mx * s, zero]),
                jnp.stack([zero, my, zero, -my * s, zero, zero]),
                jnp.stack([zero, zero, mz, zero, zero, zero]),
                jnp.stack([zero, -my * s, zero, self.transverse_inertia + my * s**2, zero, zero]),
                jnp.stack([mx * s, zero, zero, zero, self.transverse_inertia + mx * s**2, zero]),
                jnp.stack([zero, zero, zero, zero, zero, self.polar_inertia]),
            ]
        )

    def kinetic_energy(self, motions: tuple[Motion, ...]) -> Array:
        ((q, v),) = motions
        x, y = v[0] + self.offset * v[4], v[1] - self.offset * v[3]
        spin = v[5] + v[3] * jnp.sin(q[4])
        return 0.5 * (
            self._along() @ jnp.stack([x**2, y**2, v[2] ** 2])
            + self.transverse_inertia * (v[3] ** 2 + v[4] ** 2)
            + self.polar_inertia * spin**2
        )

    def height_energy(self, motions: tuple[Motion, ...], gravity: Float[Array, "3"]) -> Array:
        ((q, _),) = motions
        s = self.offset
        place = jnp.stack([q[0] + s * q[4], q[1] - s * q[3], q[2]])
        return -(self._along() * gravity) @ place

    def _along(self) -> Float[Array, "3"]:
        return jnp.broadcast_to(self.mass, (3,))
