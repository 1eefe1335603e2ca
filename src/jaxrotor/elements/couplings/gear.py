"""The gear mesh: two parallel axes."""

from collections.abc import Iterator
from typing import Any, ClassVar

import equinox as eqx
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
from .tooth_mesh import wave_faults, waves


class GearMesh(AbstractElastic, Geared, Energetic, Stateful, Timed, Nominal, Signalling):
    """A gear pair, spur or helical, elastic along its line of action.

    The teeth answer to `delta = n·(u_a - u_b) - e`, how far the flanks would run into each other: u is
    the motion of each gear at the pitch point, n the normal of the flank by which a gear a that turns
    with +phi drives gear b (which then turns with -phi, a ring with +phi), e the transmission error.

    **Arguments:**

    - `radii`: pitch radii of both, m; their ratio is that of the speeds. Where gear b is a ring with teeth
      inside, its radius is negative and the larger; a lies within it.
    - `mesh`: the law along the line of action (N/m, N·s/m): `KelvinVoigt(stiffness, damping)`, or
      `Backlash(gap, stiffness, damping)` with the play measured along that line.
    - `pressure_angle`, `helix_angle`: rad; the helix pushes gear b along +z where positive. A negative
      pressure angle is that of the other flanks, by which a gear a that turns with -phi drives.
    - `orientation`: direction from a's axis to b's, rad from x.
    - `error_amplitudes` (m), `error_phases` (rad): harmonics 1, 2, ... of the transmission error at tooth
      frequency, `e = sum A_k cos(k teeth phi_a + p_k)`; `teeth` is the number on gear a.
    - `stiffness_amplitudes` (pure numbers), `stiffness_phases` (rad): how what the teeth answer varies over
      their engagement. The law is that of the mean; it is multiplied by
      `s = 1 + sum S_k cos(k teeth phi_a + p_k)`, damping as stiffness. `GearPair` finds them by geometry.

    The force follows from the energy `s U(delta)`: where the stiffness varies, gear a bears the torque
    `-U ds/dphi_a` too, by which its shaft pays for what the teeth take up and give back as pairs come and go.
    `helix_angle` is the one of the flank's normal, that on the base cylinder. Both flanks are taken to touch
    along the same line. Each gear is a station (a `Rotor`) of its own
    shaft, measured from its own axis. Source: Lalanne & Ferraris, Rotordynamics Prediction (1998), ch. 8;
    Kahraman & Singh, J. Sound Vib. 142 (1990) 49 (backlash, transmission error); Oh, Grosh & Barber, J. Vib.
    Acoust. 127 (2005) 208 (what the shaft pays).
    """

    radii: Float[Array, "2"] = parameter("m", shapes=((2,),))
    mesh: AbstractLaw = eqx.field(metadata={"straight": True})  # pyright: ignore[reportGeneralTypeIssues]
    pressure_angle: Float[Array, ""] = parameter("rad", default=0.3490658503988659)
    helix_angle: Float[Array, ""] = parameter("rad", default=0.0)
    orientation: Float[Array, ""] = parameter("rad", default=0.0)
    teeth: Float[Array, ""] = parameter(positive=True, default=20.0)
    error_amplitudes: Float[Array, " n"] = parameter("m", shapes=((None,),), default=())
    error_phases: Float[Array, " n"] = parameter("rad", shapes=((None,),), default=())
    stiffness_amplitudes: Float[Array, " m"] = parameter(shapes=((None,),), default=())
    stiffness_phases: Float[Array, " m"] = parameter("rad", shapes=((None,),), default=())

    signals: ClassVar[dict[str, str]] = {"tooth_force": "N", "deflection": "m"}

    def faults(self) -> Iterator[str]:
        a, b = (float(r) for r in self.radii)
        if not (a > 0 and (b > 0 or -b > a)):
            yield (
                f"radii must be positive, or that of gear b negative and the larger where it is a ring with "
                f"teeth inside, but are {a:g} m and {b:g} m"
            )
        for name in ("pressure_angle", "helix_angle"):
            value = float(getattr(self, name))
            if not abs(value) < 1.5:
                yield f"{name} must be below a right angle, but is {value:g} rad: give it in rad"
        yield from wave_faults(self)

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

    def _error(self, phi: Array) -> tuple[Array, Array]:
        """And its slope, m/rad."""
        error, slope = waves(self.error_amplitudes, self.error_phases, self.teeth * phi)
        return error, self.teeth * slope

    def _share(self, phi: Array) -> tuple[Array, Array]:
        """What the teeth answer there, of the mean, and its slope, 1/rad."""
        share, slope = waves(self.stiffness_amplitudes, self.stiffness_phases, self.teeth * phi)
        return 1 + share, self.teeth * slope

    def deflection(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """delta, m: positive where the driving flanks press."""
        return self._stretch(motions)[0]

    def _stretch(self, motions: tuple[Motion, ...]) -> tuple[Array, Array]:
        (qa, va), (qb, vb) = motions
        n, (error, slope) = self._direction(), self._error(qa[5])
        pressed, rate = (n @ jnp.concatenate(pair) for pair in ((qa, qb), (va, vb)))
        return pressed - error, rate - slope * va[5]

    def tooth_force(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Along the line of action, N: positive where gear a drives with +phi."""
        force = self.mesh.force(t, *self._stretch(motions), state)
        return force * self._share(motions[0][0][5])[0]

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        force = self.tooth_force(t, motions, state)
        on = -force * self._direction()
        phi = motions[0][0][5]
        if self.error_amplitudes.shape[0]:  # the error turns with phi_a, so it acts back on it
            on = on.at[5].add(force * self._error(phi)[1])
        if self.stiffness_amplitudes.shape[0]:  # and so does the stiffness
            stored = self.mesh.energy(t, self._stretch(motions)[0], state)
            on = on.at[5].add(-stored * self._share(phi)[1])
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
        stored = self.mesh.energy(t, self._stretch(motions)[0], state)
        return stored * self._share(motions[0][0][5])[0]

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        lost = self.mesh.power_lost(t, *self._stretch(motions), state)
        return lost * self._share(motions[0][0][5])[0]

    def nominal(self) -> "GearMesh":
        """Without transmission error, and of the mean stiffness."""
        return eqx.tree_at(
            lambda g: (g.error_amplitudes, g.stiffness_amplitudes),
            self,
            replace_fn=jnp.zeros_like,
        )
