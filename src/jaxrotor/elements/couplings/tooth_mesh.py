"""What the teeth of a mesh answer as they engage: a law, and harmonics of the tooth frequency."""

from collections.abc import Iterator

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.part import Part
from ..laws.law import AbstractLaw


def waves(amplitudes: Array, phases: Array, angle: Array) -> tuple[Array, Array]:
    """`sum A_k cos(k angle + p_k)` of harmonics k = 1, 2, ..., and its slope by the angle."""
    if not amplitudes.shape[0]:
        return jnp.zeros_like(angle), jnp.zeros_like(angle)
    k = jnp.arange(1, amplitudes.shape[0] + 1)
    at = k * angle + phases
    return jnp.sum(amplitudes * jnp.cos(at)), -jnp.sum(k * amplitudes * jnp.sin(at))


def wave_faults(part: Part) -> Iterator[str]:
    """Of whatever has `error_amplitudes`, `stiffness_amplitudes` and their phases."""
    for of in ("error", "stiffness"):
        sizes = [getattr(part, f"{of}_{name}").shape[0] for name in ("amplitudes", "phases")]
        if sizes[0] != sizes[1]:
            yield (
                f"{of}_amplitudes and {of}_phases must be equally long, but have "
                f"{sizes[0]} and {sizes[1]} entries"
            )
            return
    sizes, phases = (np.asarray(getattr(part, f"stiffness_{n}")) for n in ("amplitudes", "phases"))
    k = np.arange(1, sizes.shape[0] + 1)
    angles = np.linspace(0, 2 * np.pi, 16 * k.size + 16)[:, None]
    least = float(np.min(1 + np.cos(angles * k + phases) @ sizes))
    if not least > 0:
        yield (
            f"stiffness_amplitudes must leave the teeth some stiffness, but it falls to {least:g} of its "
            "mean: make them smaller"
        )


class ToothMesh(Part):
    """The teeth of one mesh of a `PlanetaryGear`, elastic along their line of action.

    - `law`: of the mean, along that line (N/m, N·s/m): `KelvinVoigt(stiffness, damping)`, or a `Backlash`.
    - `error_amplitudes` (m), `error_phases` (rad): harmonics 1, 2, ... of the transmission error over the
      mesh angle.
    - `stiffness_amplitudes` (of the mean), `stiffness_phases` (rad): the same of what multiplies the law.

    All as of `GearMesh`; `GearPair.mesh_stiffness` finds those of external teeth.
    """

    law: AbstractLaw = eqx.field(metadata={"straight": True})  # pyright: ignore[reportGeneralTypeIssues]
    error_amplitudes: Float[Array, " n"] = parameter("m", shapes=((None,),), default=())
    error_phases: Float[Array, " n"] = parameter("rad", shapes=((None,),), default=())
    stiffness_amplitudes: Float[Array, " m"] = parameter(shapes=((None,),), default=())
    stiffness_phases: Float[Array, " m"] = parameter("rad", shapes=((None,),), default=())

    def faults(self) -> Iterator[str]:
        yield from wave_faults(self)

    def error(self, angle: Array) -> tuple[Array, Array]:
        """Transmission error at a mesh angle, m, and its slope, m/rad."""
        return waves(self.error_amplitudes, self.error_phases, angle)

    def share(self, angle: Array) -> tuple[Array, Array]:
        """What the teeth answer at a mesh angle, of the mean, and its slope, 1/rad."""
        share, slope = waves(self.stiffness_amplitudes, self.stiffness_phases, angle)
        return 1 + share, slope

    def stretch(
        self, pressed: Array, rate: Array, angle: Array, speed: Array
    ) -> tuple[Array, Array]:
        """How far the flanks run into each other and how fast, less what the error leaves free."""
        error, slope = self.error(angle)
        return pressed - error, rate - slope * speed

    def force_and_torque(
        self, t: Array, pressed: Array, rate: Array, angle: Array, speed: Array, state: Array
    ) -> tuple[Array, Array]:
        """N along the line of action, and what acts on the mesh angle, J: error and stiffness go with it, so
        they act back on what turns it."""
        x, v = self.stretch(pressed, rate, angle, speed)
        share, steep = self.share(angle)
        force = share * self.law.force(t, x, v, state)
        torque = force * self.error(angle)[1]
        if self.stiffness_amplitudes.shape[0]:
            torque = torque - steep * self.law.energy(t, x, state)
        return force, torque

    def rates(
        self, t: Array, pressed: Array, rate: Array, angle: Array, speed: Array, state: Array
    ) -> Array:
        """Of the law's states."""
        return self.law.rates(t, *self.stretch(pressed, rate, angle, speed), state)

    def energy(
        self, t: Array, pressed: Array, rate: Array, angle: Array, speed: Array, state: Array
    ) -> Array:
        """J."""
        return self.share(angle)[0] * self.law.energy(t, pressed - self.error(angle)[0], state)

    def power_lost(
        self, t: Array, pressed: Array, rate: Array, angle: Array, speed: Array, state: Array
    ) -> Array:
        """W."""
        x, v = self.stretch(pressed, rate, angle, speed)
        return self.share(angle)[0] * self.law.power_lost(t, x, v, state)

    def nominal(self) -> "ToothMesh":
        """Without transmission error, and of the mean stiffness."""
        return eqx.tree_at(
            lambda m: (m.error_amplitudes, m.stiffness_amplitudes), self, replace_fn=jnp.zeros_like
        )
