"""The gear mesh: two parallel axes."""

from collections.abc import Iterator
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import (
    AbstractElastic,
    Energetic,
    Geared,
    Motion,
    Nominal,
    Signalling,
    Stateful,
    Timed,
    Vec6,
)
from ..laws.law import AbstractLaw


class GearMesh(AbstractElastic, Geared, Energetic, Stateful, Timed, Nominal, Signalling):
    """An external gear pair, spur or helical, elastic along its line of action.

    The teeth answer to `delta = n·(u_a - u_b) - e`, how far the flanks would run into each other: u is
    the motion of each gear at the pitch point, n the normal of the flank by which a gear a that turns
    with +phi drives gear b (which then turns with -phi), e the transmission error.

    **Arguments:**

    - `radii`: pitch radii of both, m; their ratio is that of the speeds.
    - `mesh`: the law along the line of action (N/m, N·s/m): `KelvinVoigt(stiffness, damping)`, or
      `Backlash(gap, stiffness, damping)` with the play measured along that line.
    - `pressure_angle`, `helix_angle`: rad; the helix pushes gear b along +z where positive.
    - `orientation`: direction from a's axis to b's, rad from x.
    - `error_amplitudes` (m), `error_phases` (rad): harmonics 1, 2, ... of the transmission error at tooth
      frequency, `e = sum A_k cos(k teeth phi_a + p_k)`; `teeth` is the number on gear a.

    Both flanks are taken to touch along the same line. Each gear is a station (a `Rotor`) of its own
    shaft, measured from its own axis. Source: Lalanne & Ferraris, Rotordynamics Prediction (1998), ch. 8;
    Kahraman & Singh, J. Sound Vib. 142 (1990) 49 (backlash, transmission error).
    """

    radii: Float[Array, "2"] = parameter("m", positive=True, shapes=((2,),))
    mesh: AbstractLaw = eqx.field(metadata={"straight": True})  # pyright: ignore[reportGeneralTypeIssues]
    pressure_angle: Float[Array, ""] = parameter("rad", default=0.3490658503988659)
    helix_angle: Float[Array, ""] = parameter("rad", default=0.0)
    orientation: Float[Array, ""] = parameter("rad", default=0.0)
    teeth: Float[Array, ""] = parameter(positive=True, default=20.0)
    error_amplitudes: Float[Array, " n"] = parameter("m", shapes=((None,),), default=())
    error_phases: Float[Array, " n"] = parameter("rad", shapes=((None,),), default=())

    signals: ClassVar[dict[str, str]] = {"tooth_force": "N", "deflection": "m"}

    def faults(self) -> Iterator[str]:
        for name in ("pressure_angle", "helix_angle"):
            value = float(getattr(self, name))
            if not abs(value) < 1.5:
                yield f"{name} must be below a right angle, but is {value:g} rad: give it in rad"
        if self.error_amplitudes.shape != self.error_phases.shape:
            yield (
                f"error_amplitudes and error_phases must be equally long, but have "
                f"{self.error_amplitudes.shape[0]} and {self.error_phases.shape[0]} entries"
            )

    def ratio(self) -> Float[Array, ""]:
        return -self.radii[0] / self.radii[1]

    def _direction(self) -> Float[Array, "12"]:
        """delta by each coordinate of both stations."""
        out = jnp.stack([jnp.cos(self.orientation), jnp.sin(self.orientation), 0.0])
        across = jnp.stack([-out[1], out[0], 0.0])
        sin, cos = jnp.sin(self.pressure_angle), jnp.cos(self.pressure_angle)
        n = jnp.cos(self.helix_angle) * (cos * across + sin * out)
        n = n.at[2].set(jnp.sin(self.helix_angle))
        arm_a, arm_b = jnp.cross(self.radii[0] * out, n), jnp.cross(-self.radii[1] * out, n)
        return jnp.concatenate([n, arm_a, -n, -arm_b])

    def _error(self, phi: Array) -> Array:
        k = jnp.arange(1, self.error_amplitudes.shape[0] + 1)
        return jnp.sum(self.error_amplitudes * jnp.cos(k * self.teeth * phi + self.error_phases))

    def deflection(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """delta, m: positive where the driving flanks press."""
        (qa, _), (qb, _) = motions
        return self._pressed(qa, qb)

    def _pressed(self, qa: Vec6, qb: Vec6) -> Array:
        return self._direction() @ jnp.concatenate([qa, qb]) - self._error(qa[5])

    def _stretch(self, motions: tuple[Motion, ...]) -> tuple[Array, Array]:
        (qa, va), (qb, vb) = motions
        return jax.jvp(self._pressed, (qa, qb), (va, vb))

    def tooth_force(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Along the line of action, N: positive where gear a drives with +phi."""
        return self.mesh.force(t, *self._stretch(motions), state)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        force = self.tooth_force(t, motions, state)
        on = -force * self._direction()
        if self.error_amplitudes.shape[0]:  # the error turns with phi_a, so it acts back on it
            on = on.at[5].add(force * jax.grad(self._error)(motions[0][0][5]))
        return on[:6], on[6:]

    def initial(self) -> Array:
        return self.mesh.initial()

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Array:
        return self.mesh.rates(t, *self._stretch(motions), state)

    def times(self) -> Array:
        return self.mesh.times()

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.mesh.energy(t, self._stretch(motions)[0], state)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.mesh.power_lost(t, *self._stretch(motions), state)

    def nominal(self) -> "GearMesh":
        """Without transmission error."""
        return eqx.tree_at(
            lambda g: g.error_amplitudes, self, jnp.zeros_like(self.error_amplitudes)
        )
