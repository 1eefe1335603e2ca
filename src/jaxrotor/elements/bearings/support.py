"""Springs and dampers to the ground."""

from collections.abc import Iterator
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import (
    AbstractAttachment,
    Energetic,
    Inertial,
    Linear,
    Massive,
    Motion,
    Tabulated,
    Vec6,
)
from ...profiles.monotone import interpolate, table_faults

# The coordinates (x, y, z, psi, theta, phi) in a mirror upright along the shaft, phi of the table being
# positive.
_MIRROR = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
# What turns backward by less than this part of the table's highest speed is at rest.
_AT_REST = 1e-9


class LinearSupport(AbstractAttachment, Linear, Massive, Energetic):
    """Holds a station to the ground: the force is `-stiffness (q - offset) - damping v - mass a`.

    Stiffness and damping are six numbers (x, y, z, psi, theta, phi) or a full 6x6, SI. Only the
    symmetric part of the stiffness has a potential; cross-coupling counts as work lost (or fed) in
    the energy audit. `offset`, six numbers (m and rad), is where the support holds the station
    without a force: a bearing or base out of line. Left out it is zero, and costs nothing.

    `mass`: what moves along without weighing on the rotor, the inertia of the fluid in a seal or bearing:
    six numbers (kg, then kg·m²) or a symmetric 6x6. Its skew part has no energy: a `SpeedDependentSupport`
    takes any. What results call its force is that of stiffness and damping. Source: Childs, Turbomachinery
    Rotordynamics (1993), ch. 4 (direct added mass of annular seals).
    """

    stiffness: Float[Array, "6"] | Float[Array, "6 6"] = parameter(
        shapes=((6,), (6, 6)), units=("N/m",) * 3 + ("N*m/rad",) * 3
    )
    damping: Float[Array, "6"] | Float[Array, "6 6"] = parameter(
        shapes=((6,), (6, 6)),
        default=(0.0,) * 6,
        units=("N*s/m",) * 3 + ("N*m*s/rad",) * 3,
    )
    offset: Float[Array, "6"] | None = parameter(
        shapes=((6,),), optional=True, default=None, units=("m",) * 3 + ("rad",) * 3
    )
    mass: Float[Array, "6"] | Float[Array, "6 6"] | None = parameter(
        shapes=((6,), (6, 6)),
        optional=True,
        default=None,
        units=("kg",) * 3 + ("kg*m^2",) * 3,
    )

    weighs: ClassVar[bool] = False

    def faults(self) -> Iterator[str]:
        if self.mass is None:
            return
        M = np.diag(self.mass) if self.mass.ndim == 1 else np.asarray(self.mass)
        if not np.allclose(M, M.T, rtol=1e-12, atol=0.0):
            yield (
                "mass must be symmetric, but the matrix given is not: a SpeedDependentSupport takes any "
                "(two rows alike, for one that does not change with the speed)"
            )
        elif np.linalg.eigvalsh(M)[0] < -1e-12 * np.abs(M).max():
            yield f"mass must not be negative along any line, but is {np.linalg.eigvalsh(M)[0]:g}"

    def mass_matrix(self) -> Float[Array, "6 6"] | None:
        return None if self.mass is None else _matrix(self.mass)

    def kinetic_energy(self, motions: tuple[Motion, ...]) -> Array:
        if self.mass is None:
            return jnp.zeros(())
        ((q, v),) = motions
        v = v.at[5].add(v[3] * jnp.sin(q[4]))
        return 0.5 * (jnp.sum(self.mass * v**2) if self.mass.ndim == 1 else v @ self.mass @ v)

    def height_energy(self, motions: tuple[Motion, ...], gravity: Float[Array, "3"]) -> Array:
        return jnp.zeros(())

    def matrices(self) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
        return _matrix(self.stiffness), _matrix(self.damping)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...] | None:
        return None if self.offset is None else (_matrix(self.stiffness) @ self.offset,)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        d, k = self._stretch(motions), self.stiffness
        return 0.5 * jnp.sum(k * d**2) if k.ndim == 1 else 0.5 * d @ k @ d

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        ((_, v),) = motions
        d, k, c = self._stretch(motions), self.stiffness, self.damping
        lost = jnp.sum(c * v**2) if c.ndim == 1 else v @ c @ v
        return lost if k.ndim == 1 else lost + 0.5 * v @ (k - k.T) @ d

    def _stretch(self, motions: tuple[Motion, ...]) -> Vec6:
        ((q, _),) = motions
        return q if self.offset is None else q - self.offset


class SpeedDependentSupport(AbstractAttachment, Tabulated, Inertial):
    """Holds a station to the ground with coefficients that depend on a speed: a fluid bearing.

    Attached to a station, it goes by that station's speed; attached to `(station, rotor)`, by the speed of
    the second, on which it does not act: a pedestal does not turn, but its table is over the rotor's speed.

    The force is `-K(|phi'|) q - C(|phi'|) v - M(|phi'|) a`. `speeds` (rad/s) are zero or positive and
    increase; `stiffness`, `damping` and `mass` (none, where it is left out) have a row for each, of six
    numbers (x, y, z, psi, theta, phi) or a full 6x6, SI; `mass` neither weighs on the rotor nor turns with
    it, so that its rows of phi are zero. Each entry follows a monotone cubic over the speed, constant
    outside the table; a run that leaves the table says so.

    A table is that of a shaft turning towards +phi. Turning the other way it is seen in a mirror that stands
    upright along the shaft (x, theta and phi become -x, -theta and -phi): `k_xy` and `k_yx` change their
    sign, `k_xx` and `k_yy` do not, so that the whirl in the sense of the spin is the one that is driven.

    It keeps no account of its energy: a stiffness that changes with the speed has no potential, and
    its work counts as that of a load in the energy audit. Source of such tables: the linearised
    coefficients of journal bearings, Lund, ASME J. Tribology 109 (1987) 37.
    """

    speeds: Float[Array, " n"] = parameter("rad/s", nonnegative=True, shapes=((None,),))
    stiffness: Float[Array, "n 6"] | Float[Array, "n 6 6"] = parameter(
        shapes=((None, 6), (None, 6, 6)), label="N/m and N*m/rad"
    )
    damping: Float[Array, "n 6"] | Float[Array, "n 6 6"] = parameter(
        shapes=((None, 6), (None, 6, 6)), label="N*s/m and N*m*s/rad"
    )
    mass: Float[Array, "n 6"] | Float[Array, "n 6 6"] | None = parameter(
        shapes=((None, 6), (None, 6, 6)), optional=True, default=None, label="kg and kg*m^2"
    )

    def faults(self) -> Iterator[str]:
        for name in ("stiffness", "damping", "mass"):
            table = getattr(self, name)
            if table is None:
                continue
            found = list(table_faults(self.speeds, table, ("speeds", name), "rad/s"))
            yield from found
            if found:
                return
        if self.mass is not None and (np.any(self.mass[..., 5]) or np.any(self.mass[:, 5])):
            yield "mass must be zero for phi, which the support does not turn with"

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        q, v = motions[0]
        turning = motions[-1][1][5]
        speed = jnp.abs(turning)
        # in one: of both parts, what curves cost to compile is half
        both = [x.reshape(len(self.speeds), -1) for x in (self.stiffness, self.damping)]
        both = jnp.split(
            interpolate(self.speeds, jnp.concatenate(both, axis=1), speed), [both[0].shape[1]]
        )
        k, c = (
            x.reshape(shape.shape[1:]) for x, shape in zip(both, (self.stiffness, self.damping))
        )
        seen = self._seen(turning)
        force = -seen * (_matrix(k) @ (seen * q) + _matrix(c) @ (seen * v))
        return (force, *(jnp.zeros(6) for _ in motions[1:2]))

    def inertia(
        self, t: Float[Array, ""], motions: tuple[Motion, ...]
    ) -> Float[Array, "6 6"] | None:
        if self.mass is None:
            return None
        turning = motions[-1][1][5]
        seen = self._seen(turning)
        found = _matrix(interpolate(self.speeds, self.mass, jnp.abs(turning)))
        return seen[:, None] * found * seen

    def _seen(self, turning: Array) -> Array:
        """Signs of the coordinates in the mirror; at rest the sign of a speed is that of its rounding."""
        return jnp.where(turning < -_AT_REST * self.speeds[-1], _MIRROR, 1.0)

    def looked_up(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, str]:
        return jnp.abs(motions[-1][1][5]), self.speeds, "rad/s"


def _matrix(given: Array) -> Array:
    return jnp.diag(given) if given.ndim == 1 else given


def in_six(pairs: Float[Array, "*n 2 2"]) -> Float[Array, "*n 6 6"]:
    """What acts in x and y among all six coordinates."""
    return jnp.pad(pairs, ((0, 0),) * (pairs.ndim - 2) + ((0, 4),) * 2)
