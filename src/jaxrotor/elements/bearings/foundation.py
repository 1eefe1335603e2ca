"""What machines stand on: mounts from their stations to points of a foundation that may move by itself and
with the ground."""

import abc
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import (
    AbstractAttachment,
    Energetic,
    Motion,
    Powered,
    Prepared,
    Settling,
    Signalling,
    Timed,
    Vec6,
)
from ...profiles.base import AbstractBase

# Units of six stiffnesses and dampings.
STIFFNESS = ("N/m",) * 3 + ("N*m/rad",) * 3
DAMPING = ("N*s/m",) * 3 + ("N*m*s/rad",) * 3


class ReadyFoundation(AbstractAttachment, Settling, Energetic, Powered, Timed):
    """The law of all foundations: `M a'' + C a' + K a = sum S' F - P b''` of its amplitudes a, m of them,
    with the ground's motion b. Point k moves by `S a + T b`; its mount pulls it by `F = k d + c d'`, d what
    the station moves against it. States: a, then a'.

    `flexible`: M⁻¹. `shapes`: S. `carried`: T. `participation`: P.
    """

    mass: Float[Array, "m m"] = parameter(shapes=((None, None),))
    flexible: Float[Array, "m m"] = parameter(shapes=((None, None),))
    damping: Float[Array, "m m"] = parameter(shapes=((None, None),))
    stiffness: Float[Array, "m m"] = parameter(shapes=((None, None),))
    shapes: Float[Array, "n 6 m"] = parameter(shapes=((None, 6, None),))
    carried: Float[Array, "n 6 6"] = parameter(shapes=((None, 6, 6),))
    participation: Float[Array, "m 6"] = parameter(shapes=((None, 6),))
    mount_stiffness: Float[Array, "n 6"] = parameter(shapes=((None, 6),))
    mount_damping: Float[Array, "n 6"] = parameter(shapes=((None, 6),))
    base: AbstractBase | None

    def initial(self) -> Float[Array, " k"]:
        return jnp.zeros(2 * self.mass.shape[0])

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return tuple(-pull for pull in self._pull(t, motions, state)[0])

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        pull, (_, _, ground) = self._pull(t, motions, state)
        a, a_t = jnp.split(state, 2)
        load = jnp.einsum("nim,ni->m", self.shapes, pull) - self.participation @ ground
        return jnp.concatenate(
            [a_t, self.flexible @ (load - self.damping @ a_t - self.stiffness @ a)]
        )

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        d, _, _ = self._stretch(t, motions, state)
        a, a_t = self._amplitudes(state)
        return 0.5 * (
            jnp.sum(self.mount_stiffness * d**2) + a_t @ self.mass @ a_t + a @ self.stiffness @ a
        )

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        _, d_t, _ = self._stretch(t, motions, state)
        _, a_t = self._amplitudes(state)
        return jnp.sum(self.mount_damping * d_t**2) + a_t @ self.damping @ a_t

    def power_in(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Of the ground: what it takes to carry the points along, and the amplitudes' inertia."""
        d, d_t, (_, rate, acceleration) = self._stretch(t, motions, state)
        _, a_t = self._amplitudes(state)
        along = jnp.einsum("nij,j->ni", self.carried, rate)
        pull = self.mount_stiffness * d + self.mount_damping * d_t
        return -jnp.sum(pull * along) - a_t @ self.participation @ acceleration

    def times(self) -> Float[Array, " n"]:
        return jnp.zeros(0) if self.base is None else self.base.jumps()

    def _amplitudes(self, state: Any) -> tuple[Array, Array]:
        if state is None:  # a machine hands none to what has none
            return jnp.zeros(0), jnp.zeros(0)
        a, a_t = jnp.split(state, 2)
        return a, a_t

    def _stretch(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Array, Array, tuple[Vec6, Vec6, Vec6]]:
        """d and d' of the mounts, (n, 6), and the ground's motion."""
        still = jnp.zeros(6)
        ground = (still, still, still) if self.base is None else self.base.at(t)
        parts = []
        for i, amplitude in enumerate(self._amplitudes(state)):
            points = self.shapes @ amplitude + self.carried @ ground[i]
            parts.append(jnp.stack([motion[i] for motion in motions]) - points)
        return parts[0], parts[1], ground

    def _pull(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Array, tuple[Vec6, Vec6, Vec6]]:
        """On the points, (n, 6), and the ground's motion."""
        d, d_t, ground = self._stretch(t, motions, state)
        return self.mount_stiffness * d + self.mount_damping * d_t, ground


class AbstractFoundation(
    AbstractAttachment, Prepared, Settling, Energetic, Powered, Timed, Signalling
):
    """Carries as many stations as it has points, in the order in which it is attached to them, each by a
    mount of stiffness and damping. To write your own, give `prepared`: its matrices."""

    signals: ClassVar[dict[str, str]] = {"ground": "m", "amplitudes": ""}

    @abc.abstractmethod
    def prepared(self) -> ReadyFoundation:
        """Its matrices, found once a run."""

    # Below is the same for every foundation.

    def initial(self) -> Float[Array, " k"]:
        return self.prepared().initial()

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        ready = self.prepared()
        points = ready.shapes.shape[0]
        if len(motions) != points:  # nothing on as many as are needed: the machine says so
            return (jnp.zeros(6),) * points
        return ready.forces(t, motions, state)

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        return self.prepared().rates(t, motions, accelerations, state)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.prepared().energy(t, motions, state)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.prepared().power_lost(t, motions, state)

    def power_in(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.prepared().power_in(t, motions, state)

    def times(self) -> Float[Array, " n"]:
        return self.prepared().times()

    def ground(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, "3"]:
        """Where the ground's origin is, m."""
        base = self.prepared().base
        return jnp.zeros(3) if base is None else base.at(t)[0][:3]

    def amplitudes(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, " m"]:
        """Of its own motion against the ground: a block's six coordinates (m, rad), a modal one's modes."""
        return jnp.zeros(0) if state is None else jnp.split(state, 2)[0]


def each(given: Array, points: int) -> Float[Array, "n 6"]:
    """Of each of so many points, where all may have the same."""
    return jnp.broadcast_to(given, (points, 6))
