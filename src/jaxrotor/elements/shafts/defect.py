"""What turns with a shaft section and changes how it bends: bows, unequal stiffness, cracks."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.part import Part, as_tuple
from ...core.protocol import Vec6

# Bending of a section, seen from the frame that turns with it: how much the slope grows from end to
# end, and how far both slopes together exceed the chord's twice; each towards x and towards y, rad.
# The moment at `s` of its length is `N[0:2] + (2 s - 1) N[2:4]`, with N conjugate to it, N·m.
Bend = Float[Array, "4"]


class Section(NamedTuple):
    """The sound section: length and diameters (m), Young's modulus (Pa), Poisson's ratio, bending
    rigidity EI (N·m²) and `yields` = 12 EI/(kappa G A L²), 0 where it does not yield to shear."""

    length: Array
    diameter: Array
    inner_diameter: Array
    youngs_modulus: Array
    poisson_ratio: Array
    rigidity: Array
    yields: Array

    def stiffness(self) -> Bend:
        """N·m/rad: diagonal in these coordinates."""
        k = self.rigidity / self.length
        sway = 3 * k / (1 + self.yields)
        return jnp.stack([k, k, sway, sway])


def towards(position: Array, angle: Array) -> Bend:
    """The bend that a unit kink towards `angle` (rad, in the shaft) at `position` (0 to 1) makes; its
    product with N is the moment there."""
    c, s, r = jnp.cos(angle), jnp.sin(angle), 2 * position - 1
    return jnp.stack([c, s, r * c, r * s])


class AbstractShaftDefect(Part):
    """Turns with a shaft section. To write your own, give what it adds to the section's unloaded shape,
    to its flexibility, or both: so several in one section add up exactly, in any order.

    The force follows from the strain energy `(b - b0)' (F0 + F)⁻¹ (b - b0)/2` of the bend b, on phi too.
    """

    def shape(self, section: Section) -> Bend | None:
        """The bend b0 of the unloaded section, rad."""
        return None

    def flexibility(
        self, section: Section, carried: Bend, angle: Float[Array, ""]
    ) -> Float[Array, "4 4"] | None:
        """F, rad/(N·m), symmetric: what is added to the sound section's F0.

        `angle`: that of the shaft, rad. `carried`: the moments N that the sound section would carry.
        """
        return None

    def misfits(self, shaft: Any) -> Iterator[str]:
        """Sentences on what does not go with `shaft`."""
        yield from ()


class ShaftDefects(AbstractShaftDefect):
    """Several defects of one section: a tuple of them given to a shaft becomes this."""

    parts: tuple[AbstractShaftDefect, ...] = eqx.field(converter=as_tuple)

    def faults(self) -> Iterator[str]:
        if not self.parts:
            yield "parts must hold one defect at least, but is empty"

    def misfits(self, shaft: Any) -> Iterator[str]:
        for part in self.parts:
            if isinstance(part, AbstractShaftDefect):  # what is none is refused by name
                yield from part.misfits(shaft)

    def shape(self, section: Section) -> Bend | None:
        return _sum(part.shape(section) for part in self.parts)

    def flexibility(
        self, section: Section, carried: Bend, angle: Float[Array, ""]
    ) -> Float[Array, "4 4"] | None:
        return _sum(part.flexibility(section, carried, angle) for part in self.parts)


def as_defect(given: Any) -> Any:
    """A defect from one, several or none; what is neither stays as it is, to be refused by name."""
    return ShaftDefects(given) if isinstance(given, (list, tuple)) else given


def defect_energy(
    defect: AbstractShaftDefect, section: Section, qa: Vec6, qb: Vec6
) -> Float[Array, ""]:
    """Strain energy beyond the sound section's, J, of the coordinates of both ends.

    The frame turns with the mean of how far both ends have turned.
    """
    bend, loaded, F = _seen(defect, section, qa, qb)
    return 0.5 * (solved(F, loaded) @ loaded - jnp.sum(section.stiffness() * bend**2))


def defect_forces(
    defect: AbstractShaftDefect, section: Section, qa: Vec6, qb: Vec6
) -> tuple[Vec6, Vec6]:
    """Minus the slope of the energy: lateral forces, moments, and the torque on phi."""

    def seen(qa, qb):
        return _seen(defect, section, qa, qb)

    # of y'Fy/2 with y = F⁻¹ b: y by b and -y y'/2 by F, a third of what differentiating the solve costs
    (bend, loaded, F), back = jax.vjp(seen, qa, qb)
    y = solved(F, loaded)
    slopes = back((-section.stiffness() * bend, y, -0.5 * y[:, None] * y))
    return -slopes[0], -slopes[1]


def _seen(defect: AbstractShaftDefect, section: Section, qa: Vec6, qb: Vec6):
    """The bend, what of it is loaded, and the flexibility."""
    turned = 0.5 * (qa[5] + qb[5])
    bend = _bend(qa, qb, section.length, turned)
    k = section.stiffness()
    shape = defect.shape(section)
    loaded = bend if shape is None else bend - shape
    more = defect.flexibility(section, k * loaded, turned)
    sound = jnp.diag(1 / k)
    return bend, loaded, sound if more is None else sound + more


def _bend(qa: Vec6, qb: Vec6, length: Array, turned: Array) -> Bend:
    # slopes along z: dx/dz = +theta, dy/dz = -psi
    slope_a, slope_b = (jnp.stack([q[4], -q[3]]) for q in (qa, qb))
    grows = slope_b - slope_a
    sways = slope_a + slope_b - 2 * (qb[:2] - qa[:2]) / length
    c, s = jnp.cos(turned), jnp.sin(turned)
    return jnp.stack(
        [
            c * grows[0] + s * grows[1],
            c * grows[1] - s * grows[0],
            c * sways[0] + s * sways[1],
            c * sways[1] - s * sways[0],
        ]
    )


def solved(F: Float[Array, "n n"], b: Float[Array, " n"]) -> Float[Array, " n"]:
    """`F⁻¹ b` of a definite matrix by elimination, written out: LAPACK has no place in a vector field."""
    both = jnp.concatenate([F, b[:, None]], axis=1)
    for i in range(b.shape[0]):
        row = both[i] / both[i, i]
        both = both - both[:, i].at[i].add(-1.0)[:, None] * row
    return both[:, -1]


def _sum(parts) -> Any:
    found = [part for part in parts if part is not None]
    return sum(found[1:], found[0]) if found else None
