"""Transverse cracks, open, or breathing as the shaft turns."""

import abc
from collections.abc import Iterator
from typing import Any, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import NonSmooth
from .crack_compliance import crack_compliance
from .defect import AbstractShaftDefect, Bend, Section, towards

# The moment, as a turn of the section by so many rad, below which a crack does not know its side.
_UNLOADED = 1e-9


class AbstractCrack(AbstractShaftDefect):
    """A hinge at `position`, whose compliance is that of an open crack, in series with the section.

    Between closed (the sound section) and open the stiffness is mixed: K = K_closed - opening (K_closed -
    K_open). Your own kind gives `opening`.
    """

    depth: Float[Array, ""] = parameter(nonnegative=True)
    position: Float[Array, ""] = parameter(nonnegative=True, default=0.5)
    angle: Float[Array, ""] = parameter("rad", default=0.0)
    opens_at: Float[Array, ""] = parameter("rad", default=-np.pi / 2)

    @abc.abstractmethod
    def opening(self, facing: Array, tension: Array) -> Array:
        """0 closed to 1 open. `facing`: cosine of the angle between the crack's side and `opens_at`;
        `tension`: cosine of that between it and the side on which the section's moment pulls."""

    def faults(self) -> Iterator[str]:
        if float(self.depth) > 0.5:
            yield (
                f"depth must be at most 0.5 of the diameter (fracture mechanics by strips knows no deeper "
                f"crack), but is {float(self.depth):g}"
            )
        if float(self.position) > 1:
            yield (
                f"position must lie between 0 and 1 along the section, but is {float(self.position):g}"
            )

    def misfits(self, shaft: Any) -> Iterator[str]:
        if float(shaft.inner_diameter) > 0:
            yield (
                f"a crack's compliance is known for a solid section alone, but inner_diameter is "
                f"{float(shaft.inner_diameter):g} m: leave out the bore or the crack"
            )

    def flexibility(
        self, section: Section, carried: Bend, angle: Float[Array, ""]
    ) -> Float[Array, "4 4"]:
        towards_it = towards(self.position, self.angle)
        beside = towards(self.position, self.angle + jnp.pi / 2)
        pull, side = -jnp.sum(towards_it * carried), jnp.sum(beside * carried)
        least = _UNLOADED * section.rigidity / section.length
        tension = pull / jnp.sqrt(pull**2 + side**2 + least**2)
        opening = self.opening(jnp.cos(angle + self.angle - self.opens_at), tension)
        c = crack_compliance(
            self.depth, section.diameter, section.youngs_modulus, section.poisson_ratio
        )
        # what mixes the stiffness of the hinge in series linearly, K - opening K c K/(1 + c k)
        k = jnp.sum(section.stiffness() * towards_it**2)
        c = opening * c / (1 + (1 - opening) * c * k)
        return c[0] * jnp.outer(towards_it, towards_it) + c[1] * jnp.outer(beside, beside)


class Crack(AbstractCrack):
    """A transverse crack with a straight front, `depth` of the diameter deep (0 to 0.5), at `position` (0 to
    1 along the section), on the side of the shaft at `angle` (rad, in the shaft, from its x axis).

    - `breathing`: `"cosine"`, opening and closing smoothly once a turn, (1 + cos)/2 (Mayes & Davies), for
      machines whose sag is large against their vibration; `"open"`, a notch or a gaping crack.
    - `opens_at`: where in space (rad, from x) its side must point to be open. Weight opens it below, -pi/2,
      the default, on shafts between bearings; above, pi/2, on an overhang.

    It bends more easily towards its side than across: vibration at once, twice and three times per turn, with
    resonances at a half and a third of the critical speed, that grow with the depth. Its effect on torsion,
    tension and shear, and friction of its faces, are left out. Sources: `crack_compliance`; Mayes & Davies,
    J. Vib. Acoust. 106 (1984) 139; Gasch, J. Sound Vib. 160 (1993) 313.
    """

    breathing: Literal["cosine", "open"] = eqx.field(static=True, default="cosine")

    def opening(self, facing: Array, tension: Array) -> Array:
        return jnp.ones_like(facing) if self.breathing == "open" else 0.5 * (1 + facing)


class SwitchingCrack(AbstractCrack, NonSmooth):
    """A `Crack` that is either open or closed, (1 + tanh(cosine/width))/2.

    - `follows`: `"weight"`, open while its side faces `opens_at` (rad, in space; default: below);
      `"moment"`, open while the section's own moment pulls on that side, whatever loads it: vibration may
      then hold it open or closed (Gasch's hinge).
    - `width`: of the switch, as an angle in rad. What is of interest should not depend on it: try half.

    Source: Gasch, J. Sound Vib. 160 (1993) 313.
    """

    follows: Literal["weight", "moment"] = eqx.field(static=True, default="weight")
    width: Float[Array, ""] = parameter("rad", positive=True, default=0.1)

    def opening(self, facing: Array, tension: Array) -> Array:
        cosine = facing if self.follows == "weight" else tension
        return 0.5 * (1 + jnp.tanh(cosine / self.width))
