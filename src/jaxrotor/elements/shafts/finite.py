"""The shaft with mass, by finite elements."""

from collections.abc import Iterator
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import choice, number, positive, whole
from ...core.errors import InputError
from ...core.gate import takes
from ...core.part import option
from ...core.protocol import LEFT, RIGHT, Carrying, Composite, Parts
from ..rotors.node import Node
from .beam_element import BeamElement, TwistedBeamElement
from .material import AnyMaterial, steel, undamped
from .mesh import elements_for, mesh_error
from .preload import Preload, TorqueKind
from .profile import Between, Rows, as_profile, rows_or_file, sections_between, within
from .segment import MOST_ELEMENTS, Segment
from .stepped import Sections, by_piece, by_section, cut, section_faults, sections

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
      sections from left to right. `end_diameter`, `end_inner_diameter`: where a section or its bore tapers,
      the diameter at its right end.
    - `elements`: in each section. Between them are stations of their own, `"shaft.1"`, `"shaft.2"`, ...
      to which supports and loads may be attached. `"auto"`: so many that natural frequencies below `up_to`
      (Hz) are met to 0.1 %; what it found stands in their place. `mesh_error(up_to)` says how well any
      number serves, `jr.linear.convergence` how well the whole machine is met.
    - `shear`, `rotary_inertia`: both on is Timoshenko's beam (shear coefficient by Cowper 1966), both off
      Bernoulli's. `gyroscopic`: whether its gyroscopic moments are taken; left out, as its rotary inertia.
    - `axial_force` (N, tension positive), `torque` (N·m, positive where the right end is turned ahead):
      constant loads, one for all sections or one for each, by what they do to bending: the force changes
      its stiffness, the torque couples its planes. Neither stretches nor twists it: `Force` and `Torque` do,
      and what is told of stress and torque is of these alone.
    - `torque_kind`: what the moments at both ends become where these tilt. `"semi-tangential"`: as all drives
      and loads here turn, conservative. `"axial"`: fixed in space along z (Greenhill 1883; Zorzi & Nelson
      1980; ROSS). `"follower"`: along the shaft's own end. The latter two do work on the tilts, which the
      energy audit counts as put in; a cantilever under them flutters.
    - `material`, `rayleigh`, `damping`, `twist`: as for `Shaft`; M of the damping is the mass itself.

    Mass is consistent: it couples the accelerations of neighbours. Signs: dx/dz = +theta, dy/dz = -psi.
    Damping `beta K` is of the elastic stiffness alone. A shaft with a torque keeps all its stations
    (`Machine.reduced`). Source: Nelson, J. Mech. Des. 102 (1980) 793; Zorzi & Nelson, ibid. 158; Friswell et
    al., Dynamics of Rotating Machines (2010), ch. 5; energy with large spin, loads: `docs/physics.md`.
    """

    length: Sections = by_section(positive=True)
    diameter: Sections = by_section(positive=True)
    inner_diameter: Sections = by_section(nonnegative=True, default=0.0)
    end_diameter: Sections | None = by_section(positive=True, optional=True, default=None)
    material: AnyMaterial = steel()
    rayleigh: Float[Array, "2"] = undamped()
    elements: int | Literal["auto"] = option(_count, default=8)
    shear: bool = eqx.field(static=True, default=True)
    rotary_inertia: bool = eqx.field(static=True, default=True)
    damping: Literal["fixed", "rotating"] = eqx.field(static=True, default="fixed")
    twist: Literal["invariant", "paper"] = eqx.field(static=True, default="invariant")
    up_to: float | None = option(number("Hz", above=0.0), metadata={"quantity": "Hz"}, default=None)
    end_inner_diameter: Sections | None = by_section(nonnegative=True, optional=True, default=None)
    axial_force: Sections | None = by_section("N", optional=True, default=None)
    torque: Sections | None = by_section("N*m", optional=True, default=None)
    torque_kind: TorqueKind = eqx.field(static=True, default="semi-tangential")
    gyroscopic: bool | None = eqx.field(static=True, default=None)

    def __post_init__(self) -> None:
        if self.elements == "auto":
            self.elements = elements_for(self, self.up_to)

    @classmethod
    @takes(
        profile=None,
        start=number("m"),
        stop=number("m"),
        between=choice("cones", "cylinders"),
        longest=positive("m"),
    )
    def from_profile(
        cls,
        profile: Rows,
        start: float | None = None,
        stop: float | None = None,
        between: Between = "cones",
        longest: float | None = None,
        **options: Any,
    ) -> "FiniteElementShaft":
        """The shaft of a drawing's table.

        **Arguments:**

        - `profile`: rows of (position, diameter) or (position, diameter, bore), m, from left to right, or a
          file of them (`jr.elements.read_profile`). Two rows at one position make a step.
        - `between`: what stands between two rows: `"cones"`, straight from one to the next, or `"cylinders"`,
          each row's diameters up to the next one's position (the last row ends it).
        - `start`, `stop`: positions, m, where a part of it is wanted.
        - `longest`: m; sections that are longer are divided evenly.
        - `options`: all others of `FiniteElementShaft`; `elements` in each section, 1 where it is left out.

        Differentiable by diameters and bores. Raises `InputError` for rows that fall back, for a third one at
        a position, for diameters that cannot be, and for positions off the profile, with the row.
        """
        rows = as_profile(rows_or_file(profile))
        low, high = float(rows.positions[0]), float(rows.positions[-1])
        low = low if start is None else within(rows, start, "start")
        high = high if stop is None else within(rows, stop, "stop")
        if not high > low:
            raise InputError(f"stop must lie behind start, but is {high:g} after {low:g} m")
        found = sections_between(rows, low, high, between, longest)
        for name in found:
            if name in options:
                raise InputError(f"{name} comes from the profile: leave it out")
        return cls(**found, **({"elements": 1} | options))

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
        return cut(self, int(self.elements), self.shear, self.rotary_inertia, self.gyroscopic)

    def _preload(self) -> Preload | None:
        """Of all segments, stacked."""
        if self.axial_force is None and self.torque is None:
            return None
        count, pieces = sections(self), int(self.elements)
        force, torque = (
            None if x is None else by_piece(x, count, pieces)
            for x in (self.axial_force, self.torque)
        )
        return Preload(force, torque, self.torque_kind)

    def parts(self) -> Parts:
        segments = self.segments()
        K, M, G = jax.vmap(lambda s: s.matrices(), in_axes=-1, out_axes=-1)(segments)
        count = self.inner + 1
        rayleigh = jnp.broadcast_to(self.rayleigh[:, None], (2, count))
        kind: Any = BeamElement if self.torque is None else TwistedBeamElement
        element = kind(segments, K, M, G, rayleigh, self._preload(), self.damping, self.twist)
        ends = (LEFT, *range(count - 1)), (*range(count - 1), RIGHT)
        stations = ((Node(), count - 1),) if count > 1 else ()
        return Parts(stations, (("element", element, ends),))
