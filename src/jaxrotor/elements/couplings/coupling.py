"""Couplings: two hubs that act on each other by their relative position and velocity."""

import abc
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.part import Part
from ...core.protocol import (
    AbstractElastic,
    Energetic,
    Motion,
    Nominal,
    Signalling,
    Stateful,
    Timed,
    Vec6,
)
from ..laws.law import AbstractLaw, each_law, end_to_end, laws_of
from ..rotors.rotor import Imperfection


class Misalignment(Part):
    """How the right shaft's bearings stand to the left shaft's; fixed in space, it does not turn.

    The right shaft's line lies `offset` (m) to the side of the left one's, in the direction `angle`
    from x (parallel misalignment), and is tilted by `inclination` (rad) about the in-plane axis at
    `inclination_angle` (angular misalignment). Each station is measured from its own shaft's line.
    """

    offset: Float[Array, ""] = parameter("m", nonnegative=True, default=0.0)
    angle: Float[Array, ""] = parameter("rad", default=0.0)
    inclination: Float[Array, ""] = parameter("rad", default=0.0)
    inclination_angle: Float[Array, ""] = parameter("rad", default=0.0)


def _aside(shape: Misalignment | Imperfection, turned: Any = 0.0) -> Vec6:
    """Displacement and tilt as six coordinates, turned by an angle (rad)."""
    at, about = turned + shape.angle, turned + shape.inclination_angle
    zero = jnp.zeros_like(at)
    return jnp.stack(
        [
            shape.offset * jnp.cos(at),
            shape.offset * jnp.sin(at),
            zero,
            shape.inclination * jnp.cos(about),
            shape.inclination * jnp.sin(about),
            zero,
        ]
    )


class AbstractCoupling(AbstractElastic, Energetic, Stateful, Signalling, Nominal):
    """Two hubs, the stations at its ends, acting on each other in all six directions.

    To write your own, give `law`, `stored` and `lost`; with states of its own `initial` and
    `law_rates` too. The kinematics are done here: a law sees `d`, the right hub's six coordinates
    less the left one's, and its rate `d_t`, in directions fixed in space; the sixth is the twist,
    measured by chi (protocol). Forces reach the stations by virtual work, so energy is
    kept exactly. A hub with mass is a `Rotor` in the line.

    - `misalignment`: of the two shafts, fixed in space.
    - `imperfection`: the left hub is bored eccentrically, or askew: it sits `offset` off its shaft's
      axis. That turns with phi and therefore acts on phi too. (Other than a rotor's imperfection this
      is a displacement of the hub itself, and it pulls at the right one.)

    Source: Matyja & Łazarz 2014, Fig. 8; the misalignments are ours.
    """

    misalignment: Misalignment | None = eqx.field(default=None, kw_only=True)
    imperfection: Imperfection | None = eqx.field(default=None, kw_only=True)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m"}

    @abc.abstractmethod
    def law(self, t: Float[Array, ""], d: Vec6, d_t: Vec6, state: Array) -> Vec6:
        """Forces and moments between the hubs, N and N·m: positive pulls the left one along."""

    @abc.abstractmethod
    def stored(self, t: Float[Array, ""], d: Vec6, state: Array) -> Array:
        """Energy stored, J; written without using `law`."""

    @abc.abstractmethod
    def lost(self, t: Float[Array, ""], d: Vec6, d_t: Vec6, state: Array) -> Array:
        """Power turned into heat, W."""

    def initial(self) -> Float[Array, " k"]:
        return jnp.zeros(0)

    def law_rates(
        self, t: Float[Array, ""], d: Vec6, d_t: Vec6, state: Array
    ) -> Float[Array, " k"]:
        """Time derivatives of the states."""
        return jnp.zeros(0)

    # Below is the same for every coupling.

    def relative(self, qa: Vec6, qb: Vec6) -> Vec6:
        """Right hub less left hub."""
        d = qb - qa
        if self.misalignment is not None:
            d = d + _aside(self.misalignment)
        if self.imperfection is not None:
            d = d - _aside(self.imperfection, qa[5])
        return d

    def _relative(self, motions: tuple[Motion, ...]) -> tuple[Vec6, Vec6]:
        (qa, va), (qb, vb) = motions
        return jax.jvp(self.relative, (qa, qb), (va, vb))

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        (qa, _), (qb, _) = motions
        pull = self.law(t, *self._relative(motions), _given(state))
        _, work = jax.vjp(self.relative, qa, qb)
        return work(-pull)

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        return self.law_rates(t, *self._relative(motions), state)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        d, _ = self._relative(motions)
        return self.stored(t, d, _given(state))

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.lost(t, *self._relative(motions), _given(state))

    def torque(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """Twisting moment, N·m: positive when the right end leads; it pulls the left end along."""
        return self.law(t, *self._relative(motions), _given(state))[5]

    def nominal(self) -> "AbstractCoupling":
        if self.imperfection is None:
            return self
        return eqx.tree_at(lambda c: c.imperfection, self, Imperfection())


def _given(state: Array | None) -> Array:
    """Without states a machine passes `None`."""
    return jnp.zeros(0) if state is None else state


class Coupling(AbstractCoupling, Timed):
    """Springs and dampers as in a data sheet, and a law of its own for any direction.

    - `stiffness`, `damping`: six numbers (x, y, z, psi, theta, phi) or 6x6, SI.
    - `x`, `y`, `z`, `psi`, `theta`, `phi`: an `AbstractLaw` each, added to these.

    The directions are fixed in space. A coupling that turns should have the same numbers for x and y
    and for psi and theta; laws with a memory across the axis keep it in space, not in the hub.
    """

    stiffness: Float[Array, "6"] | Float[Array, "6 6"] = parameter(
        shapes=((6,), (6, 6)), default=(0.0,) * 6, units=("N/m",) * 3 + ("N*m/rad",) * 3
    )
    damping: Float[Array, "6"] | Float[Array, "6 6"] = parameter(
        shapes=((6,), (6, 6)), default=(0.0,) * 6, units=("N*s/m",) * 3 + ("N*m*s/rad",) * 3
    )
    # `straight`: a law in m and N instead of rad and N·m
    x: AbstractLaw | None = eqx.field(default=None, metadata={"straight": True})
    y: AbstractLaw | None = eqx.field(default=None, metadata={"straight": True})
    z: AbstractLaw | None = eqx.field(default=None, metadata={"straight": True})
    psi: AbstractLaw | None = None
    theta: AbstractLaw | None = None
    phi: AbstractLaw | None = None

    def law(self, t: Float[Array, ""], d: Vec6, d_t: Vec6, state: Array) -> Vec6:
        k, c = self.stiffness, self.damping
        total = (k * d if k.ndim == 1 else k @ d) + (c * d_t if c.ndim == 1 else c @ d_t)
        for i, law, own in each_law(self, state):
            total = total.at[i].add(law.force(t, d[i], d_t[i], own))
        return total

    def stored(self, t: Float[Array, ""], d: Vec6, state: Array) -> Array:
        k = self.stiffness
        total = 0.5 * jnp.sum(k * d**2) if k.ndim == 1 else 0.5 * d @ k @ d
        return total + sum(law.energy(t, d[i], own) for i, law, own in each_law(self, state))

    def lost(self, t: Float[Array, ""], d: Vec6, d_t: Vec6, state: Array) -> Array:
        k, c = self.stiffness, self.damping
        total = jnp.sum(c * d_t**2) if c.ndim == 1 else d_t @ c @ d_t
        if k.ndim == 2:  # only the symmetric part has a potential
            total = total + 0.5 * d_t @ (k - k.T) @ d
        return total + sum(
            law.power_lost(t, d[i], d_t[i], own) for i, law, own in each_law(self, state)
        )

    def initial(self) -> Float[Array, " k"]:
        return end_to_end([law.initial() for law in laws_of(self).values()])

    def law_rates(
        self, t: Float[Array, ""], d: Vec6, d_t: Vec6, state: Array
    ) -> Float[Array, " k"]:
        return end_to_end([law.rates(t, d[i], d_t[i], s) for i, law, s in each_law(self, state)])

    def times(self) -> Float[Array, " n"]:
        return end_to_end([law.times() for law in laws_of(self).values()])
