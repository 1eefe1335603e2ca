"""The shaft with mass, by finite elements."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import number, whole
from ...core.errors import InputError
from ...core.kinematics import from_turning, spin_speed
from ...core.part import option
from ...core.protocol import (
    LEFT,
    RIGHT,
    AbstractElastic,
    Carrying,
    Composite,
    Condensable,
    Energetic,
    Motion,
    Parts,
    Signalling,
    Vec6,
)
from ...core.turning import turning_forces
from ..rotors.node import Node
from .material import ShaftMaterial, steel, undamped
from .mesh import elements_for, mesh_error
from .segment import MOST_ELEMENTS, Segment
from .stepped import Sections, by_section, cut, section_faults, sections
from .twist import damped_rates, twist_torque


class BeamElement(AbstractElastic, Condensable, Energetic, Signalling):
    """One finite element with its matrices computed: made by `FiniteElementShaft`."""

    segment: Segment
    K: Float[Array, "12 12"]
    M: Float[Array, "12 12"]
    G: Float[Array, "12 12"]
    rayleigh: Float[Array, "2"]
    damping: str = eqx.field(static=True)
    twist: str = eqx.field(static=True)

    signals: ClassVar[dict[str, str]] = {"torque": "N*m"}

    def matrices(self) -> tuple[Array, Array]:
        return self.K, self.rayleigh[0] * self.M + self.rayleigh[1] * self.K

    def mass_matrix(self) -> Float[Array, "12 12"]:
        return self.M

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        G, rotating = self.turning()
        q, v = (jnp.stack([m[i] for m in motions], axis=1) for i in (0, 1))
        angles = from_turning(q, v) if self.twist == "invariant" else (q, v)
        on = turning_forces(G, rotating, q, v, spin_speed(*angles))
        return on[:, 0], on[:, 1]

    def turning(self) -> tuple[Array, Array | None]:
        return self.G, self.rayleigh[1] * self.K if self.damping == "rotating" else None

    def torque(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Twisting moment, N·m: positive when the right end leads."""
        k = self.K[11, 11]
        return twist_torque(k, self.rayleigh[1] * k, motions)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.segment.strain_energy(*(q for q, _ in motions))

    def kinetic_energy(self, motions: tuple[Motion, ...]) -> Array:
        return self.segment.kinetic_energy(motions)

    def height_energy(self, motions: tuple[Motion, ...], gravity: Float[Array, "3"]) -> Array:
        return self.segment.height_energy(motions, gravity)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        rates = damped_rates(motions, self.damping)
        alpha, beta = self.rayleigh
        kinetic = self.segment.kinetic_energy(motions, hat=False)
        return 2 * alpha * kinetic + 2 * beta * self.segment.strain_energy(*rates)


_whole = whole(1, MOST_ELEMENTS)


def _count(value: Any, place: str) -> Any:
    if isinstance(value, str) and value == "auto":
        return value
    try:
        return _whole(value, place)
    except InputError as error:
        raise InputError(str(error).replace(", but is", ' or "auto", but is', 1)) from None


class FiniteElementShaft(Composite, Carrying):
    """A shaft with its own mass between two stations, by finite elements.

    **Arguments:**

    - `length`, `diameter`, `inner_diameter`: m, numbers, or lists for a stepped shaft of several
      sections from left to right. `end_diameter`: where a section tapers, its diameter at the right.
    - `elements`: in each section. Between them are stations of their own, `"shaft.1"`, `"shaft.2"`, ...
      to which supports and loads may be attached. `"auto"`: so many that natural frequencies below `up_to`
      (Hz) are met to 0.1 %; what it found stands in their place. `mesh_error(up_to)` says how well any
      number serves, `jr.linear.convergence` how well the whole machine is met.
    - `shear`, `rotary_inertia`: both on is Timoshenko's beam (shear coefficient by Cowper 1966), both off
      Bernoulli's. Gyroscopic moments go with rotary inertia.
    - `material`, `rayleigh`, `damping`, `twist`: as for `Shaft`; M of the damping is the mass itself.

    Mass is consistent: it couples the accelerations of neighbours. Signs: dx/dz = +theta, dy/dz = -psi.
    Source: Nelson, J. Mech. Des. 102 (1980) 793; Friswell et al., Dynamics of Rotating Machines (2010),
    ch. 5; energy with large spin: `docs/physics.md`.
    """

    length: Sections = by_section(positive=True)
    diameter: Sections = by_section(positive=True)
    inner_diameter: Sections = by_section(nonnegative=True, default=0.0)
    end_diameter: Sections | None = by_section(positive=True, optional=True, default=None)
    material: ShaftMaterial = steel()
    rayleigh: Float[Array, "2"] = undamped()
    elements: int | Literal["auto"] = option(_count, default=8)
    shear: bool = eqx.field(static=True, default=True)
    rotary_inertia: bool = eqx.field(static=True, default=True)
    damping: Literal["fixed", "rotating"] = eqx.field(static=True, default="fixed")
    twist: Literal["invariant", "paper"] = eqx.field(static=True, default="invariant")
    up_to: float | None = option(number("Hz", above=0.0), metadata={"quantity": "Hz"}, default=None)

    def __post_init__(self) -> None:
        if self.elements == "auto":
            self.elements = elements_for(self, self.up_to)

    def mesh_error(self, up_to: float) -> float:
        """By what part cutting raises a natural frequency at `up_to` (Hz), estimated from the length of waves
        in the thinnest section: (kh)^4/1440 in bending and more with shear, (kh)^2/24 in torsion, kh radians
        of a wave in an element (Strang & Fix 1973)."""
        return mesh_error(self, int(self.elements), number("Hz", above=0.0)(up_to, "up_to"))

    def faults(self) -> Iterator[str]:
        yield from section_faults(self)

    @property
    def inner(self) -> int:
        return sections(self) * int(self.elements) - 1

    def segments(self) -> Segment:
        """All of them, stacked on the last axis."""
        return cut(self, int(self.elements), self.shear, self.rotary_inertia)

    def parts(self) -> Parts:
        segments = self.segments()
        K, M, G = jax.vmap(lambda s: s.matrices(), in_axes=-1, out_axes=-1)(segments)
        count = self.inner + 1
        rayleigh = jnp.broadcast_to(self.rayleigh[:, None], (2, count))
        element = BeamElement(segments, K, M, G, rayleigh, self.damping, self.twist)
        ends = (LEFT, *range(count - 1)), (*range(count - 1), RIGHT)
        stations = ((Node(), count - 1),) if count > 1 else ()
        return Parts(stations, (("element", element, ends),))
