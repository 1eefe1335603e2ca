"""Torques and forces from outside."""

from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Energetic, Motion, Tabulated, Timed, Vec6
from ...profiles.monotone import interpolate, table_faults
from ...profiles.schedule import AbstractSchedule, as_schedule


def about_axis(torque) -> tuple[Vec6, ...]:
    """The torque (N·m) about the axis, as the forces on one station."""
    return (torque * jnp.array([0.0, 0, 0, 0, 0, 1]),)


class Torque(AbstractAttachment, Timed):
    """A torque about the axis of rotation on a station, N·m: a number or a schedule in time.

    Positive drives in the sense of phi. Its power is the torque times chi', chi = phi + psi theta/2: on a
    tilted station it lies half-way between a torque along z and one along the disc's axis.
    """

    value: AbstractSchedule = eqx.field(converter=as_schedule, metadata={"drives": "N*m"})

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return about_axis(self.value.value(t))

    def times(self) -> Float[Array, " n"]:
        return self.value.jumps()


class Force(AbstractAttachment, Timed):
    """A force fixed in direction on a station or port, N: `direction` times a number or schedule.

    On `"main"` it acts at the geometric centre, on `"main.mass_centre"` at the mass centre, whose
    moment about the geometric centre it then has.
    """

    value: AbstractSchedule = eqx.field(converter=as_schedule, metadata={"drives": "N"})
    direction: Float[Array, "3"] = parameter(shapes=((3,),), default=(0.0, -1.0, 0.0))

    def faults(self) -> Iterator[str]:
        if not np.any(self.direction):
            yield "direction must point somewhere, but is zero: give (0, -1, 0) for downwards"

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return (jnp.concatenate([self.direction * self.value.value(t), jnp.zeros(3)]),)

    def times(self) -> Float[Array, " n"]:
        return self.value.jumps()


class Moment(AbstractAttachment, Timed):
    """A moment fixed in direction on a station, N·m: `direction` times a number or schedule.

    About x or y it bends the shaft, as a misaligned coupling or a side load on an overhung disc does; about
    z it drives. Its power is the moment times the angular velocity; the generalized forces follow from the
    angles 1-2-3 (docs/physics.md), exact for any tilt, but in the paper's machines (`twist="paper"`), where
    what it gives to psi and theta is off by half its part along z times the tilt.
    """

    value: AbstractSchedule = eqx.field(converter=as_schedule, metadata={"drives": "N*m"})
    direction: Float[Array, "3"] = parameter(shapes=((3,),), default=(1.0, 0.0, 0.0))

    def faults(self) -> Iterator[str]:
        if not np.any(self.direction):
            yield "direction must point somewhere, but is zero: give (1, 0, 0) for a moment about x"

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        ((q, _),) = motions
        along_x, along_y, along_z = self.direction * self.value.value(t)
        psi, theta = q[3], q[4]
        upright = along_z * jnp.cos(psi) - along_y * jnp.sin(psi)
        turning = along_x * jnp.sin(theta) + upright * jnp.cos(theta)
        # phi' = chi' - (psi theta)'/2
        on_psi = along_x - 0.5 * theta * turning
        on_theta = along_y * jnp.cos(psi) + along_z * jnp.sin(psi) - 0.5 * psi * turning
        zero = jnp.zeros_like(turning)
        return (jnp.stack([zero, zero, zero, on_psi, on_theta, turning]),)

    def times(self) -> Float[Array, " n"]:
        return self.value.jumps()


class FanLoad(AbstractAttachment):
    """A fan or a centrifugal pump: the torque `-coefficient |phi'| phi'` on its station, N·m.

    `coefficient` in N·m·s²/rad². It opposes either sense of turning. Source: the affinity laws of
    turbomachines, torque over the square of the speed.
    """

    coefficient: Float[Array, ""] = parameter("N*m*s^2/rad^2", nonnegative=True)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        ((_, v),) = motions
        return about_axis(-self.coefficient * v[5] * jnp.abs(v[5]))


class SpeedTorque(AbstractAttachment, Tabulated):
    """A torque given over the speed phi' of its station by a table, constant outside it.

    `speeds` (rad/s) increase and may be negative; `torques` in N·m are positive where they drive in
    the sense of phi, so that a load that brakes forward running has negative ones. Between the
    rows a monotone cubic (Fritsch & Butland): the curve has no kink and does not overshoot. A run that
    leaves the table says so.
    """

    speeds: Float[Array, " n"] = parameter("rad/s", shapes=((None,),))
    torques: Float[Array, " n"] = parameter("N*m", shapes=((None,),))

    def faults(self) -> Iterator[str]:
        yield from table_faults(self.speeds, self.torques, ("speeds", "torques"), "rad/s")

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        ((_, v),) = motions
        return about_axis(interpolate(self.speeds, self.torques, v[5]))

    def looked_up(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, str]:
        return motions[0][1][5], self.speeds, "rad/s"


class Brake(AbstractAttachment, Energetic, Timed):
    """A friction brake on the ground: `-torque tanh(phi'/reversal_speed)`, N·m.

    `torque` is the magnitude, zero or positive, a number or a schedule in time. Coulomb's law is
    smoothed: within some `reversal_speed` (rad/s) of rest the torque falls off, so that the brake
    creeps under a load rather than holding it.
    """

    torque: AbstractSchedule = eqx.field(converter=as_schedule, metadata={"drives": "N*m"})
    reversal_speed: Float[Array, ""] = parameter("rad/s", positive=True, default=1.0)

    def faults(self) -> Iterator[str]:
        for t in (0.0, *map(float, self.torque.jumps())):
            torque = float(self.torque.value(jnp.asarray(t)))
            if torque < 0:
                yield (
                    f"torque must be zero or positive at all times, but is {torque:g} N*m at "
                    f"{t:g} s: give the magnitude, it opposes either sense of turning"
                )
                return

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        ((_, v),) = motions
        return about_axis(-self.torque.value(t) * jnp.tanh(v[5] / self.reversal_speed))

    def times(self) -> Float[Array, " n"]:
        return self.torque.jumps()

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return jnp.zeros(())

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        ((_, v),) = motions
        return self.torque.value(t) * jnp.tanh(v[5] / self.reversal_speed) * v[5]
