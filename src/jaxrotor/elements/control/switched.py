"""Semi-active damping: a damper that is switched, and puts no energy in."""

from collections.abc import Iterator
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Energetic, Motion, Signalling, Vec6
from .loop import shared


class SwitchedDamper(AbstractAttachment, Energetic, Signalling):
    """A torsional damper between two stations, beside their shaft or coupling, that is switched between
    `lowest` and `highest` (N·m·s/rad): `highest` while shaft and damper pull against each other (twist
    and its rate of opposite sign), so that little is transmitted; `lowest` while they pull together.

    The switch is smooth, `(1 - tanh(twist/width) tanh(rate/rate_width))/2` of the way; `width` in rad,
    `rate_width` in rad/s. Signals: `torque` on the first station (N·m), `damping` (N·m·s/rad).
    Source: Rakheja & Sankar, ASME J. Vib. Acoust. 107 (1985) 398 (balance logic).
    """

    lowest: Float[Array, ""] = parameter("N*m*s/rad", nonnegative=True)
    highest: Float[Array, ""] = parameter("N*m*s/rad", positive=True)
    width: Float[Array, ""] = parameter("rad", positive=True)
    rate_width: Float[Array, ""] = parameter("rad/s", positive=True)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m", "damping": "N*m*s/rad"}

    def faults(self) -> Iterator[str]:
        if not self.lowest < self.highest:
            yield (
                f"lowest must be less than highest, {float(self.highest):g} N*m*s/rad, but is "
                f"{float(self.lowest):g} N*m*s/rad"
            )

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return shared(self.torque(t, motions, state), len(motions), between=True)

    def torque(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """On the first station, N·m."""
        return -self.damping(t, motions, state) * _twist(motions)[1]

    def damping(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """As it is switched, N·m·s/rad."""
        twist, rate = _twist(motions)
        opposed = -jnp.tanh(twist / self.width) * jnp.tanh(rate / self.rate_width)
        return self.lowest + (self.highest - self.lowest) * 0.5 * (1 + opposed)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return jnp.zeros(())

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        (_, a), (_, b) = motions
        return self.damping(t, motions, state) * (a[5] - b[5]) ** 2


def _twist(motions: tuple[Motion, ...]) -> tuple[Array, Array]:
    (qa, va), (qb, vb) = motions
    return qa[5] - qb[5], va[5] - vb[5]
