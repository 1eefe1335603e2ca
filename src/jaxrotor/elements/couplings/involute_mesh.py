"""A gear mesh whose stiffness follows from the drawing of its gears."""

from collections.abc import Iterator
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import whole
from ...core.parameter import parameter
from ...core.part import option
from ...core.protocol import (
    AbstractElastic,
    Energetic,
    Geared,
    Motion,
    Nominal,
    Prepared,
    Signalling,
    Vec6,
)
from ..laws.law import KelvinVoigt
from .gear import GearMesh
from .gear_pair import GearPair


class InvoluteMesh(AbstractElastic, Geared, Prepared, Energetic, Nominal, Signalling):
    """A `GearMesh` by the geometry of its gears: radii, angles, and the stiffness over the engagement, found
    once a run. A change of the geometry changes all of them; derivatives pass through.

    - `pair`: the gears.
    - `force`: along the flanks' normal, N, at which the teeth are linearised.
    - `damping`: N·s/m along that normal, in the mean; it varies as the stiffness does.
    - `orientation`, `error_amplitudes`, `error_phases`: as of `GearMesh`.
    - `varying`: the share of what varies by the pair's own doing, stiffness and the error that its tip relief
      makes, that is kept; 0 leaves the mean alone.
    - `harmonics`: how many of the tooth frequency it is given by.

    Teeth that may part: `GearPair.gear_mesh` with a `gap`.
    """

    pair: GearPair
    force: Float[Array, ""] = parameter("N", positive=True)
    damping: Float[Array, ""] = parameter("N*s/m", nonnegative=True, default=0.0)
    orientation: Float[Array, ""] = parameter("rad", default=0.0)
    error_amplitudes: Float[Array, " n"] = parameter("m", shapes=((None,),), default=())
    error_phases: Float[Array, " n"] = parameter("rad", shapes=((None,),), default=())
    varying: Float[Array, ""] = parameter(nonnegative=True, default=1.0)
    harmonics: int = option(whole(0, 64), default=8)

    signals: ClassVar[dict[str, str]] = {"tooth_force": "N", "deflection": "m"}

    def faults(self) -> Iterator[str]:
        sizes = self.error_amplitudes.shape[0], self.error_phases.shape[0]
        if sizes[0] != sizes[1]:
            yield (
                f"error_amplitudes and error_phases must be equally long, but have {sizes[0]} and "
                f"{sizes[1]} entries"
            )
        if not float(self.varying) <= 1:
            yield f"varying must be from 0 to 1, but is {float(self.varying):g}"

    def prepared(self) -> GearMesh:
        found, (sizes, phases) = self.pair.found(self.force, self.harmonics)
        found = found._replace(amplitudes=self.varying * found.amplitudes)
        return self.pair.joining(
            found,
            (self.varying * sizes, phases),
            KelvinVoigt(found.mean, self.damping),
            self.orientation,
            self.error_amplitudes,
            self.error_phases,
        )

    @property
    def teeth(self) -> Float[Array, ""]:
        """Of gear a."""
        return self.pair.teeth[0]

    def ratio(self) -> Float[Array, ""]:
        return -self.pair.teeth[0] / self.pair.teeth[1]

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return self.prepared().forces(t, motions, state)

    def deflection(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """As of `GearMesh`, m."""
        return self.prepared().deflection(t, motions, state)

    def tooth_force(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """As of `GearMesh`, N."""
        return self.prepared().tooth_force(t, motions, state)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.prepared().energy(t, motions, state)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.prepared().power_lost(t, motions, state)

    def nominal(self) -> "InvoluteMesh":
        """Without transmission error, and of the mean stiffness."""
        return eqx.tree_at(
            lambda g: (g.error_amplitudes, g.varying), self, replace_fn=jnp.zeros_like
        )
