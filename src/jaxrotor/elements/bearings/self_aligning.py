"""The self-aligning ball bearing of the paper."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.kinematics import about_axis, rows
from ...core.parameter import parameter
from ...core.protocol import (
    AbstractElement,
    Acting,
    Carried,
    Carrying,
    Energetic,
    Linear,
    Lumping,
    Motion,
    Signalling,
    Vec6,
)

# The radial load is smoothed by this much, or every gradient at zero load would be NaN.
LOAD_SMOOTHING = 1e-3  # N
# Friction reverses over this speed.
FRICTION_SPEED = 1.0  # rad/s


class SelfAligningBearing(Lumping, Carried, Acting, Linear, Energetic, Signalling):
    """A self-aligning ball bearing in a housing on an elastic base.

    The station is the journal with the housing around it. In x and y it has the housing's mass and
    the base's stiffness and damping; z carries the lumped shaft alone and has no spring. The
    rotations are linear and uncoupled (no gyroscopic moment), with swing damping on psi and theta
    and the friction torque `-(friction_arm) N tanh(phi'/w_s)` on phi, where
    `N = sqrt(|bearing_force|² + (1e-3 N)²)` and w_s = 1 rad/s. `friction_arm` is `mu d/2`.

    The lumped shaft (`shaft_mass`, its inertias about the bearing's centre) is taken from half of
    each adjoining shaft section where none of the three is given: together one rod, centred here.
    Shafts with mass of their own carry the bearing instead; nothing is lumped then.

    Source: Matyja & Łazarz 2014, "self-aligning bearing" block; regularisation and lumping are ours.
    """

    housing_mass: Float[Array, ""] = parameter("kg", nonnegative=True)
    stiffness: Float[Array, ""] = parameter("N/m", nonnegative=True)
    damping: Float[Array, ""] = parameter("N*s/m", nonnegative=True)
    swing_damping: Float[Array, ""] = parameter("N*m*s/rad", nonnegative=True, default=0.0)
    friction_arm: Float[Array, ""] = parameter("m", nonnegative=True, default=0.0)
    shaft_mass: Float[Array, ""] | None = parameter(
        "kg", positive=True, optional=True, default=None
    )
    shaft_transverse_inertia: Float[Array, ""] | None = parameter(
        "kg*m^2", positive=True, optional=True, default=None
    )
    shaft_polar_inertia: Float[Array, ""] | None = parameter(
        "kg*m^2", positive=True, optional=True, default=None
    )

    small_tilts: ClassVar[bool] = True
    signals: ClassVar[dict[str, str]] = {"bearing_force": "N"}

    def _shaft(self) -> tuple:
        return self.shaft_mass, self.shaft_transverse_inertia, self.shaft_polar_inertia

    def lumped(self, neighbours: tuple[AbstractElement, ...]) -> "SelfAligningBearing":
        given = [x is not None for x in self._shaft()]
        if all(given):
            return self
        if any(given):
            raise ValueError(
                "shaft_mass, shaft_transverse_inertia and shaft_polar_inertia belong together: "
                "give all three, or none"
            )
        if any(isinstance(n, Carrying) for n in neighbours):
            return self
        halves = [n.half() for n in neighbours if hasattr(n, "half")]  # pyright: ignore
        if not halves:
            raise ValueError(
                "no shaft section adjoins to take the lumped shaft from: give shaft_mass, "
                "shaft_transverse_inertia and shaft_polar_inertia"
            )
        mass = sum(h.mass for h in halves)
        length = sum(h.length for h in halves)
        square = sum(h.mass * h.radii_squared for h in halves)
        return eqx.tree_at(
            lambda b: b._shaft(),
            self,
            (mass, square / 4 + mass * length**2 / 12, square / 2),
            is_leaf=lambda x: x is None,
        )

    def own_mass(self) -> Float[Array, "6 6"] | None:
        return jnp.diag(self._inertia()) if self.shaft_mass is None else None

    def _inertia(self) -> Vec6:
        zero = jnp.zeros_like(self.housing_mass)
        m, jt, jp = (zero if x is None else x for x in self._shaft())
        return jnp.stack([self.housing_mass + m, self.housing_mass + m, m, jt, jt, jp])

    def acceleration(self, q: Vec6, v: Vec6, Q: Vec6) -> Vec6:
        return Q / self._inertia()

    def kinetic_energy(self, q: Vec6, v: Vec6) -> Float[Array, ""]:
        return 0.5 * jnp.sum(self._inertia() * v**2)

    def weight(self, q: Vec6, gravity: Float[Array, "3"]) -> Vec6:
        return jnp.concatenate([self._inertia()[:3] * gravity, jnp.zeros(3)])

    def height_energy(self, q: Vec6, gravity: Float[Array, "3"]) -> Float[Array, ""]:
        return -jnp.sum(self._inertia()[:3] * gravity * q[:3])

    def matrices(self) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
        k, c, s = self.stiffness, self.damping, self.swing_damping
        zero = jnp.zeros_like(k)
        return (
            jnp.diag(jnp.stack([k, k, zero, zero, zero, zero])),
            jnp.diag(jnp.stack([c, c, zero, s, s, zero])),
        )

    def bearing_force(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, "3"]:
        """Force of the bearing on its base, N: (x, y, z)."""
        ((q, v),) = motions
        f = self.stiffness * q[:3] + self.damping * v[:3]
        return f * jnp.array([1.0, 1.0, 0.0])

    def friction_torque(self, motion: Motion) -> Float[Array, ""]:
        """Magnitude with the sign of the speed, N·m; it brakes."""
        q, v = motion
        x, y, *_ = rows(q)
        x_t, y_t, *_, phi_t = rows(v)
        fx = self.stiffness * x + self.damping * x_t
        fy = self.stiffness * y + self.damping * y_t
        load = jnp.sqrt(fx * fx + fy * fy + LOAD_SMOOTHING**2)
        return self.friction_arm * load * jnp.tanh(phi_t / FRICTION_SPEED)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return (about_axis(-self.friction_torque(motions[0])),)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        ((q, _),) = motions
        return 0.5 * self.stiffness * (q[0] ** 2 + q[1] ** 2)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        ((q, v),) = motions
        return (
            self.damping * (v[0] ** 2 + v[1] ** 2)
            + self.swing_damping * (v[3] ** 2 + v[4] ** 2)
            + self.friction_torque((q, v)) * v[5]
        )
