"""The shaft with mass, by finite elements."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.arguments import whole
from ...core.kinematics import from_turning, spin_speed
from ...core.parameter import parameter
from ...core.part import option
from ...core.protocol import (
    LEFT,
    RIGHT,
    AbstractElastic,
    Carrying,
    Composite,
    Energetic,
    Linear,
    Massive,
    Motion,
    Parts,
    Signalling,
    Vec6,
)
from ..rotors.node import Node
from .material import STEEL, ShaftMaterial, as_parameters
from .segment import MOST_ELEMENTS, Segment
from .twist import TURN, circulatory_forces, twist_torque


class BeamElement(AbstractElastic, Massive, Linear, Energetic, Signalling):
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
        # gyroscopic, beyond what the nodes' spin momentum gives: workless, as G is skew
        (qa, va), (qb, vb) = motions
        spins = [self._spin(q, v) for q, v in motions]
        gyro = -0.5 * (spins[0] + spins[1]) * (self.G @ jnp.concatenate([va, vb]))
        on_a, on_b = gyro[:6], gyro[6:]
        if self.damping == "rotating":
            B = self.rayleigh[1] * self.K
            extra = circulatory_forces(B, motions)
            on_a, on_b = on_a + extra[0], on_b + extra[1]
        return on_a, on_b

    def torque(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Twisting moment, N·m: positive when the right end leads."""
        k = self.K[11, 11]
        return twist_torque(k, self.rayleigh[1] * k, motions)

    def _spin(self, q: Vec6, v: Vec6) -> Array:
        """About the section's own axis, rad/s."""
        if self.twist == "invariant":
            q, v = from_turning(q, v)
        return spin_speed(q, v)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.segment.strain_energy(*(q for q, _ in motions))

    def kinetic_energy(self, motions: tuple[Motion, ...]) -> Array:
        return self.segment.kinetic_energy(motions)

    def height_energy(self, motions: tuple[Motion, ...], gravity: Float[Array, "3"]) -> Array:
        return self.segment.height_energy(motions, gravity)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        rates = []
        for q, v in motions:
            if self.damping == "rotating":
                v = v - v[5] * (TURN[:6, :6] @ q)
            rates.append(v)
        alpha, beta = self.rayleigh
        kinetic = self.segment.kinetic_energy(motions, hat=False)
        return 2 * alpha * kinetic + 2 * beta * self.segment.strain_energy(*rates)


class FiniteElementShaft(Composite, Carrying):
    """A shaft with its own mass between two stations, by finite elements.

    **Arguments:**

    - `length`, `diameter`, `inner_diameter`: m, numbers, or lists for a stepped shaft of several
      sections from left to right. `end_diameter`: where a section tapers, its diameter at the right.
    - `elements`: in each section. Between them are stations of their own, `"shaft.1"`, `"shaft.2"`, ...
      to which supports and loads may be attached.
    - `shear`, `rotary_inertia`: both on is Timoshenko's beam (shear coefficient by Cowper 1966), both off
      Bernoulli's. Gyroscopic moments go with rotary inertia.
    - `material`, `rayleigh`, `damping`, `twist`: as for `Shaft`; M of the damping is the mass itself.

    Mass is consistent: it couples the accelerations of neighbours. Signs: dx/dz = +theta, dy/dz = -psi.
    Source: Nelson, J. Mech. Des. 102 (1980) 793; Friswell et al., Dynamics of Rotating Machines (2010),
    ch. 5; energy with large spin: `docs/physics.md`.
    """

    length: Float[Array, ""] | Float[Array, " n"] = parameter(
        "m", positive=True, shapes=((), (None,))
    )
    diameter: Float[Array, ""] | Float[Array, " n"] = parameter(
        "m", positive=True, shapes=((), (None,))
    )
    inner_diameter: Float[Array, ""] | Float[Array, " n"] = parameter(
        "m", nonnegative=True, shapes=((), (None,)), default=0.0
    )
    end_diameter: Float[Array, ""] | Float[Array, " n"] | None = parameter(
        "m", positive=True, shapes=((), (None,)), optional=True, default=None
    )
    material: ShaftMaterial = eqx.field(
        converter=as_parameters, default=STEEL, metadata=dict(made_by=["STEEL", "Material"])
    )
    rayleigh: Float[Array, "2"] = parameter(
        nonnegative=True, shapes=((2,),), default=(0.0, 0.0), units=("1/s", "s")
    )
    elements: int = option(whole(1, MOST_ELEMENTS), default=8)
    shear: bool = eqx.field(static=True, default=True)
    rotary_inertia: bool = eqx.field(static=True, default=True)
    damping: Literal["fixed", "rotating"] = eqx.field(static=True, default="fixed")
    twist: Literal["invariant", "paper"] = eqx.field(static=True, default="invariant")

    def faults(self) -> Iterator[str]:
        yield from section_faults(self)

    @property
    def inner(self) -> int:
        return sections(self) * self.elements - 1

    def segments(self) -> Segment:
        """All of them, stacked on the last axis."""
        return cut(self, self.elements, self.shear, self.rotary_inertia)

    def parts(self) -> Parts:
        segments = self.segments()
        K, M, G = jax.vmap(lambda s: s.matrices(), in_axes=-1, out_axes=-1)(segments)
        count = self.inner + 1
        rayleigh = jnp.broadcast_to(self.rayleigh[:, None], (2, count))
        element = BeamElement(segments, K, M, G, rayleigh, self.damping, self.twist)
        ends = (LEFT, *range(count - 1)), (*range(count - 1), RIGHT)
        stations = ((Node(), count - 1),) if count > 1 else ()
        return Parts(stations, (("element", element, ends),))


def sections(shaft: Any) -> int:
    """How many sections a shaft's dimensions give."""
    given = (shaft.length, shaft.diameter, shaft.inner_diameter, shaft.end_diameter)
    return max(1, *(jnp.size(x) for x in given if x is not None))


def section_faults(shaft: Any):
    if not isinstance(shaft.elements, int) or shaft.elements < 1:
        yield f"elements must be a whole number, one at least, but is {shaft.elements!r}"
        return
    count = sections(shaft)
    given = {
        name: np.shape(getattr(shaft, name))
        for name in ("length", "diameter", "inner_diameter", "end_diameter")
        if getattr(shaft, name) is not None
    }
    for name, shape in given.items():
        if shape not in ((), (count,)):
            yield (
                "length, diameter, inner_diameter and end_diameter must be numbers or equally long "
                f"lists, but {name} has {shape[0]} entries where another has {count}"
            )
            return
    end = shaft.diameter if shaft.end_diameter is None else shaft.end_diameter
    outer = np.minimum(np.broadcast_to(shaft.diameter, count), np.broadcast_to(end, count))
    inner = np.broadcast_to(shaft.inner_diameter, count)
    if np.any(inner >= outer):
        k = int(np.argmax(inner >= outer))
        yield (
            f"inner_diameter must be smaller than the diameter, but is {inner[k]:g} against "
            f"{outer[k]:g} m"
        )


def cut(shaft: Any, pieces: int, shear: bool, rotary_inertia: bool) -> Segment:
    """Each section cut into equal pieces: segments stacked on the last axis."""
    count = sections(shaft)

    def per_piece(x):
        return jnp.repeat(jnp.broadcast_to(x, (count,)), pieces)

    n = count * pieces
    left = jnp.tile(jnp.arange(pieces) / pieces, count)
    start = per_piece(shaft.diameter)
    end = start if shaft.end_diameter is None else per_piece(shaft.end_diameter)
    diameters = jnp.stack([start + (end - start) * s for s in (left, left + 1 / pieces)])
    inside = jnp.broadcast_to(per_piece(shaft.inner_diameter), (2, n))
    m = shaft.material
    E, G, rho = (jnp.broadcast_to(x, (n,)) for x in (m.youngs_modulus, m.shear_modulus, m.density))
    return Segment(
        per_piece(shaft.length) / pieces, diameters, inside, E, G, rho, shear, rotary_inertia
    )
