"""The shaft with mass, by rigid pieces joined by springs: the rigid finite element method."""

from collections.abc import Iterator
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import whole
from ...core.part import option
from ...core.protocol import LEFT, RIGHT, Carrying, Composite, Parts
from ..rotors.added_inertia import AddedInertia
from ..rotors.body import RigidBody
from .material import AnyMaterial, ShaftMaterial, steel, undamped
from .section import Shaft
from .segment import MOST_ELEMENTS
from .stepped import Sections, by_section, cut, section_faults, sections


class RigidElementShaft(Composite, Carrying):
    """A shaft with its own mass between two stations, by rigid finite elements: each section is cut
    into `elements` equal pieces whose elasticity is gathered in a spring and damper in the middle of
    each, so that between two springs there is a rigid body, and half of one at either end.

    The springs have the bending, shear, axial and torsional compliance of their piece (12 EI/L³ across
    and EI/L about a spring in the middle is the beam's own matrix), so statics is exact; masses are
    rigid rods with six exact degrees of freedom each, the end ones added to the adjoining stations.
    Converges with the square of the piece's length. Arguments as for `FiniteElementShaft`, which alone
    takes loads; tapered sections become steps; without `rotary_inertia` the sections' own is left out of the
    bodies (what is left is that of their length, which vanishes with it). Inner stations are `"shaft.1"`,
    `"shaft.2"`, ...

    Source: Kruszewski et al., Metoda sztywnych elementów skończonych (1975); Wittbrodt, Adamiec-Wójcik,
    Wojciech, Dynamics of Flexible Multibody Systems: Rigid Finite Element Method (2006), ch. 2.
    """

    length: Sections = by_section(positive=True)
    diameter: Sections = by_section(positive=True)
    inner_diameter: Sections = by_section(nonnegative=True, default=0.0)
    end_diameter: Sections | None = by_section(positive=True, optional=True, default=None)
    material: AnyMaterial = steel()
    rayleigh: Float[Array, "2"] = undamped()
    elements: int = option(whole(1, MOST_ELEMENTS), default=8)
    shear: bool = eqx.field(static=True, default=True)
    rotary_inertia: bool = eqx.field(static=True, default=True)
    damping: Literal["fixed", "rotating"] = eqx.field(static=True, default="fixed")
    twist: Literal["invariant", "paper"] = eqx.field(static=True, default="invariant")
    end_inner_diameter: Sections | None = by_section(nonnegative=True, optional=True, default=None)

    def faults(self) -> Iterator[str]:
        yield from section_faults(self)

    @property
    def inner(self) -> int:
        return sections(self) * self.elements - 1

    def parts(self) -> Parts:
        segments = cut(self, self.elements, self.shear, True)
        n = segments.length.shape[0]
        area, moment = segments.section(0.5)
        outer = jnp.mean(segments.diameters, axis=0)
        inside = jnp.mean(segments.inner_diameters, axis=0)
        springs = Shaft(
            segments.length,
            outer,
            inside,
            ShaftMaterial(segments.youngs_modulus, segments.shear_modulus, segments.density),
            jnp.broadcast_to(self.rayleigh[:, None], (2, n)),
            self.damping,
            self.twist,
            self.shear,
        )
        # each spring has half of its piece on either side
        half = segments.length / 2
        m = segments.density * area * half
        polar = 2 * segments.density * moment * half
        across = (polar / 2 if self.rotary_inertia else 0.0) + m * half**2 / 12
        ends = [
            AddedInertia(m[k], polar[k], across[k], sign * half[k] / 2)
            for k, sign in ((slice(0, 1), 1.0), (slice(-1, None), -1.0))
        ]
        parts = [
            ("spring", springs, ((LEFT, *range(n - 1)), (*range(n - 1), RIGHT))),
            ("left piece", ends[0], ((LEFT,),)),
            ("right piece", ends[1], ((RIGHT,),)),
        ]
        bodies = ((_bodies(m, half / 2, across, polar), n - 1),) if n > 1 else ()
        return Parts(bodies, tuple(parts))


def _bodies(m: Array, arm: Array, across: Array, polar: Array) -> RigidBody:
    """The right half of one piece and the left half of the next, as one body about its mass centre."""
    a, b = slice(None, -1), slice(1, None)
    mass = m[a] + m[b]
    centre = (m[b] * arm[b] - m[a] * arm[a]) / mass
    about = across[a] + across[b] + m[a] * (arm[a] + centre) ** 2 + m[b] * (arm[b] - centre) ** 2
    zero = jnp.zeros_like(mass)
    return RigidBody(
        mass, jnp.stack([about, about, polar[a] + polar[b]]), jnp.stack([zero, zero, centre])
    )
