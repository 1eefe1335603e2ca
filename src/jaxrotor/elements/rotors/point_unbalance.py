"""Unbalance at one place of a shaft."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Acting, Energetic, Inertial, Motion, Nominal, Vec6


class PointUnbalance(AbstractAttachment, Acting, Inertial, Energetic, Nominal):
    """A small mass at a radius, stuck on a station: a `Node` of a shaft with mass, a `Rotor`, anything that
    turns. Of a rotor that is unbalanced itself it is what is added.

    `amount` is mass times radius, kg·m (1 g·mm is 1e-6 kg·m), at `angle` from the station's x axis; it turns
    with phi. It pulls on the shaft with `amount (phi'^2 e_r - phi'' e_t)`, and its inertia acts back on the
    turning: `T = amount phi' (y' cos - x' sin)`. What it adds to mass and inertia is left out, and its
    weight. Source: Matyja & Łazarz (2014), eq. of the static unbalance, without tilts.
    """

    amount: Float[Array, ""] = parameter("kg*m", nonnegative=True)
    angle: Float[Array, ""] = parameter("rad", default=0.0)

    answers: ClassVar[tuple[int, ...]] = (0, 1, 5)

    def nominal(self) -> "PointUnbalance":
        return eqx.tree_at(lambda e: e.amount, self, jnp.zeros_like(self.amount))

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        ((q, v),) = motions
        at = q[5] + self.angle
        out = self.amount * v[5] ** 2
        zero = jnp.zeros_like(out)
        return (jnp.stack([out * jnp.cos(at), out * jnp.sin(at), zero, zero, zero, zero]),)

    def inertia(self, t: Float[Array, ""], motions: tuple[Motion, ...]) -> Float[Array, "6 6"]:
        ((q, _),) = motions
        across = self.amount * self._across(q)
        zero = jnp.zeros(6)
        row = jnp.concatenate([across, jnp.zeros(4)])
        return jnp.stack([zero.at[5].set(across[0]), zero.at[5].set(across[1]), *[zero] * 3, row])

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        ((q, v),) = motions
        return self.amount * v[5] * (self._across(q) @ v[:2])

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return jnp.zeros(())

    def _across(self, q: Vec6) -> Float[Array, "2"]:
        """The direction in which it moves as the shaft turns."""
        at = q[5] + self.angle
        return jnp.stack([-jnp.sin(at), jnp.cos(at)])
