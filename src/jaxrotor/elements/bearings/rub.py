"""A rotor that touches its stator."""

from collections.abc import Iterator
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractAttachment, Energetic, Motion, NonSmooth, Signalling, Vec6
from ..laws.centres import direction, pushed, radially, relative
from ..laws.touch import area, pressed, pressed_lost


class Rub(AbstractAttachment, Energetic, Signalling, NonSmooth):
    """Contact of a rotor with a ring around it: a seal, a casing, a retainer bearing.

    Attached to the rotor's station the ring is fixed in the ground; with a stator of its own mass,
    `(rub, ("rotor", "stator"))`. The rotor overlaps the ring by `u = |e| - gap`, e its centre less the
    ring's. The normal force is `N = stiffness u (1 + hysteresis u') + damping u'`, never below zero, after
    Hunt & Crossley or of a spring and a damper, and Coulomb friction `friction N tanh(slip / slip_speed)`
    opposes the sliding of the surfaces, `slip = radius phi' + e' · t` with t a quarter turn on from the
    normal: at each angle of contact in the direction that takes energy out. It brakes the spin with `radius`
    for its arm.

    - `gap`: m, radial. `stiffness`: N/m. `radius`: m, of the rotor's surface.
    - `friction`: Coulomb's coefficient. `slip_speed`: m/s, within which friction reverses (smoothing).
    - `damping`: N·s/m, of a ring on a resilient mount: it acts at once where they touch, and never pulls.
    - `hysteresis`: s/m; for a coefficient of restitution r at the impact speed v about `1.5 (1 - r)/v`.
    - `smoothing`: m, contact builds up over this distance to either side of the touch; 0 is sharp.
    - `offset`: (x, y) m, the ring's centre in its station, where it is out of line.

    Sources: Hunt & Crossley, J. Appl. Mech. 42 (1975) 440; Muszynska, Rotordynamics (2005), ch. 5.
    """

    gap: Float[Array, ""] = parameter("m", nonnegative=True)
    stiffness: Float[Array, ""] = parameter("N/m", positive=True)
    radius: Float[Array, ""] = parameter("m", nonnegative=True)
    friction: Float[Array, ""] = parameter(nonnegative=True, default=0.0)
    hysteresis: Float[Array, ""] = parameter("s/m", nonnegative=True, default=0.0)
    slip_speed: Float[Array, ""] = parameter("m/s", positive=True, default=1e-2)
    smoothing: Float[Array, ""] = parameter("m", nonnegative=True, default=0.0)
    offset: Float[Array, "2"] = parameter("m", shapes=((2,),), default=(0.0, 0.0))
    damping: Float[Array, ""] = parameter("N*s/m", nonnegative=True, default=0.0)

    signals: ClassVar[dict[str, str]] = {
        "normal_force": "N",
        "friction_force": "N",
        "overlap": "m",
        "slip": "m/s",
    }

    def faults(self) -> Iterator[str]:
        if float(self.smoothing) > float(self.gap) and float(self.gap) > 0:
            yield (
                f"smoothing must not exceed the gap, or the rotor would touch in the middle, but is "
                f"{float(self.smoothing):g} against {float(self.gap):g} m"
            )

    def _place(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, Array, Array, Array]:
        """Distance of the centres, the normal outwards, the tangent, u' and the slip."""
        e, e_t = relative(motions)
        size, normal = direction(e - self.offset)
        tangent = jnp.stack([-normal[1], normal[0]])
        slip = self.radius * motions[0][1][5] + e_t @ tangent
        if len(motions) > 1:
            slip = slip - (size + self.radius) * motions[1][1][5]
        return size, normal, tangent, e_t @ normal, slip

    def _how(self) -> tuple:
        return self.stiffness, self.damping, self.hysteresis, self.smoothing

    def _normal(self, size: Array, closing: Array) -> Array:
        return pressed(size - self.gap, closing, *self._how())

    def _friction(self, normal: Array, slip: Array) -> Array:
        return -self.friction * normal * jnp.tanh(slip / self.slip_speed)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        size, n, _, closing, slip = self._place(motions)
        e = relative(motions)[0] - self.offset
        normal = radially(lambda size: self._normal(size, closing), e)
        share = self._friction(jnp.ones_like(slip), slip)
        f = share * jnp.stack([-normal[1], normal[0]]) - normal
        along = share * (normal @ n)
        # the stator feels it where they touch, further out than the rotor's surface is from its own centre
        return pushed(motions, f, self.radius * along, -(size + self.radius) * along)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        size, *_ = self._place(motions)
        return self.stiffness * area(size - self.gap, self.smoothing)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        size, _, _, closing, slip = self._place(motions)
        lost = pressed_lost(size - self.gap, closing, *self._how())
        return lost + jnp.abs(self._friction(self._normal(size, closing), slip) * slip)

    def normal_force(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """N, positive: it pushes the rotor inwards."""
        size, _, _, closing, _ = self._place(motions)
        return self._normal(size, closing)

    def friction_force(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """On the rotor, N, along the tangent (a quarter turn on from the outward normal)."""
        size, _, _, closing, slip = self._place(motions)
        return self._friction(self._normal(size, closing), slip)

    def overlap(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """m, negative where they are apart."""
        return self._place(motions)[0] - self.gap

    def slip(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """Speed of the rotor's surface over the stator's, m/s, along the tangent."""
        return self._place(motions)[4]
