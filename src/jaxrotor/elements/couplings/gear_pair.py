"""A pair of involute gears by its drawing: how the teeth meet, and how stiff they are as they do."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.arguments import numbers, positive, whole
from ...core.errors import refuse
from ...core.gate import takes
from ...core.parameter import parameter, problems
from ...core.part import Part
from ...core.quick import lightly_compiled, quickly_compiled
from ..laws.law import AbstractLaw, Backlash, KelvinVoigt
from .engagement import LoadedMesh, MeshStiffness, added, harmonics, loaded, over_angles
from .gear import GearMesh
from .iso_stiffness import IsoStiffness, iso_stiffness
from .line_of_action import Contact, contact
from .tooth import Tooth, cut, flattening, tooth_compliance

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)


class GearPair(Part):
    """Two external involute gears, spur or helical, of steel unless told otherwise. First gear a, then b.

    - `teeth`: of both. `module`: normal, m. `face_width`: common, m.
    - `pressure_angle` (normal) and `helix_angle` (on the reference cylinder): rad.
    - `profile_shifts`, `addenda`, `dedenda` of the teeth, `corners` (tip radius of the rack that cuts them):
      in modules. Tips are at `(teeth/(2 cos helix) + addendum + shift) module`.
    - `centre_distance`: m; `None` is the one without play.
    - `bores`: diameters, m, of gears that are rings; `None`: the bodies are taken for half-planes. With
      bores meshes come out a third softer and more (62 teeth of 2 mm: 3.5e8 in place of 5.3e8 N/m, ISO 6336
      has 4.6e8 for solid gears); which is nearer to gears as built was not held against a measurement.
    - `youngs_modulus`, Pa; `poissons_ratio`.
    - `tip_reliefs`: what is taken off the flanks at the tips of gears a and b, m, along their normal; it
      grows evenly over the last `relief_lengths`, m along the line of action. `None`: no relief.

    A tooth yields by bending, shear and compression, by what gives beneath it and by flattening where it is
    touched, after Weber & Banaschek; a helical one as the virtual spur tooth of its normal section. The pairs
    that touch at once share the force by their stiffness; one tooth does not tilt the next, and the slices of
    a helical tooth yield each by itself. So a mesh comes out some 10 to 20 % stiffer than measured: ISO 6336
    takes 0.8 of the theory (its C_M). The flattening is that of the mean load of a length of contact.

    Sources: Weber & Banaschek, Schriftenreihe Antriebstechnik 11 (1953); Sainsot, Velex & Duverger, J. Mech.
    Des. 126 (2004) 748 (rings); ISO 21771 (geometry); ISO 6336-1:2006.
    """

    teeth: Float[Array, "2"] = parameter(positive=True, shapes=((2,),))
    module: Float[Array, ""] = parameter("m", positive=True)
    face_width: Float[Array, ""] = parameter("m", positive=True)
    pressure_angle: Float[Array, ""] = parameter("rad", positive=True, default=0.3490658503988659)
    helix_angle: Float[Array, ""] = parameter("rad", default=0.0)
    profile_shifts: Float[Array, "2"] = parameter(shapes=((2,),), default=(0.0, 0.0))
    addenda: Float[Array, "2"] = parameter(positive=True, shapes=((2,),), default=(1.0, 1.0))
    dedenda: Float[Array, "2"] = parameter(positive=True, shapes=((2,),), default=(1.25, 1.25))
    corners: Float[Array, "2"] = parameter(nonnegative=True, shapes=((2,),), default=(0.38, 0.38))
    centre_distance: Float[Array, ""] | None = parameter(
        "m", positive=True, optional=True, default=None
    )
    bores: Float[Array, "2"] | None = parameter(
        "m", positive=True, shapes=((2,),), optional=True, default=None
    )
    youngs_modulus: Float[Array, ""] = parameter("Pa", positive=True, default=2.06e11)
    poissons_ratio: Float[Array, ""] = parameter(nonnegative=True, default=0.3)
    tip_reliefs: Float[Array, "2"] | None = parameter(
        "m", nonnegative=True, shapes=((2,),), optional=True, default=None
    )
    relief_lengths: Float[Array, "2"] | None = parameter(
        "m", positive=True, shapes=((2,),), optional=True, default=None
    )

    def faults(self) -> Iterator[str]:
        for name, most in (("pressure_angle", 0.8), ("helix_angle", 1.2)):
            value = float(getattr(self, name))
            if not abs(value) < most:
                yield f"{name} must be below {most:g} rad, but is {value:g} rad: give it in rad"
                return
        if not float(self.poissons_ratio) < 0.5:
            yield f"poissons_ratio must be below 0.5, but is {float(self.poissons_ratio):g}"
        if (self.tip_reliefs is None) != (self.relief_lengths is None):
            yield "tip_reliefs and relief_lengths must be given together, or neither"
        found = jax.tree.map(np.asarray, _looked_at(self))
        for k, name in enumerate("ab"):
            if found.first[k] < 0:
                yield (
                    f"gear {name} must not be undercut by its rack: more teeth, a larger profile shift or a "
                    "smaller dedendum"
                )
            elif not found.lowest[k] > found.first[k]:
                yield (
                    f"the other gear's tips must touch gear {name} on the involute, but reach into its "
                    "fillet: a smaller addendum there, or a larger profile shift here"
                )
            elif not found.tip[k] > 0:
                yield (
                    f"gear {name} must have tips of some width, but they are pointed: a smaller addendum or "
                    "profile shift"
                )
            if self.bores is not None and not 1.4 <= found.ring[k] <= 7:
                yield (
                    f"bores must be between 1/7 and 1/1.4 of the root circles, but of gear {name} the root "
                    f"circle is {found.ring[k]:.4g} times as wide: leave bores out for solid gears"
                )
        if not found.ratio >= 1:
            yield (
                f"a pair of teeth must take over before the last one lets go, but the contact ratio is "
                f"{found.ratio:.4g}: larger addenda or a smaller centre_distance"
            )

    def contact(self) -> Contact:
        """Where the teeth touch. Differentiable."""
        return contact(
            self.teeth,
            self.module,
            self.pressure_angle,
            self.helix_angle,
            self.profile_shifts,
            self.addenda,
            self.centre_distance,
        )

    def contact_ratio(self) -> Float[Array, ""]:
        """Transverse, epsilon_alpha: how many pairs of a spur gear's teeth touch at once, in the mean."""
        return self.contact().ratio

    def overlap_ratio(self) -> Float[Array, ""]:
        """epsilon_beta, what the helix adds: zero for spur gears."""
        return self.face_width * jnp.abs(jnp.sin(self.helix_angle)) / (jnp.pi * self.module)

    def virtual(self) -> tuple[Tooth, Tooth]:
        """The virtual spur teeth of the normal section."""
        teeth = self._virtual_teeth()
        a, b = (
            cut(
                teeth[k],
                self.module,
                self.pressure_angle,
                self.profile_shifts[k],
                self.dedenda[k],
                self.corners[k],
            )
            for k in (0, 1)
        )
        return a, b

    def _virtual_teeth(self) -> Array:
        base = jnp.cos(self.contact().base_helix)
        return self.teeth / (base**2 * jnp.cos(self.helix_angle))

    @takes(force=positive("N"), at=numbers("m"))
    def pair_stiffness(self, force: Any, at: Any) -> Float[Array, " n"]:
        """Of one pair of teeth along the flanks' normal per length of contact, N/m², at places `at` on the
        line of action (m from the pitch point toward gear a's tip, in the transverse plane), under the tooth
        force `force` (N) of the whole mesh.

        Raises `InputError` for a force that is not positive, places that are no numbers, and a pair that a
        machine refuses too.
        """
        refuse(problems(self, "GearPair"))
        return _pair_stiffness(self, jnp.asarray(force, float), jnp.asarray(at, float))

    @takes(force=positive("N"), angles=numbers("rad"))
    def stiffness(self, force: Any, angles: Any) -> Float[Array, " n"]:
        """Of the mesh along the flanks' normal, N/m, at mesh angles (rad: teeth times the angle of gear a;
        zero where a pair touches at the pitch point), with the steps where pairs of spur teeth come and go.

        Raises `InputError` for a force that is not positive, angles that are no numbers, and a pair that a
        machine refuses too.
        """
        refuse(problems(self, "GearPair"))
        return _stiffness(self, jnp.asarray(force, float), jnp.asarray(angles, float))

    @takes(force=positive("N"), samples=whole(16, 4096))
    def loaded(self, force: Any, samples: int = 256) -> LoadedMesh:
        """Over one mesh, under a steady force along the flanks' normal (N), with tip relief: static
        transmission error, stiffness, and which error a `GearMesh` needs to do the same. Pairs share the
        force as their stiffness and their relief let them; contact ends at the tips, also where a deflected
        tooth would touch earlier.

        Raises `InputError` for a force that is not positive, another number of samples than 16 to 4096, and a
        pair that a machine refuses too.
        """
        refuse(problems(self, "GearPair"))
        return _loaded(self, jnp.asarray(force, float), samples)

    @takes(force=positive("N"), harmonics=whole(0, 64))
    def mesh_stiffness(self, force: Any, harmonics: int = 8) -> MeshStiffness:
        """The same as a mean and its harmonics, each exact and smooth in all geometry; without relief.

        `force`: along the flanks' normal, N; by it, only the flattening at the contacts changes.

        Raises `InputError` for a force that is not positive, another number of harmonics than 0 to 64, and a
        pair that a machine refuses too.
        """
        refuse(problems(self, "GearPair"))
        return _mesh_stiffness(self, jnp.asarray(force, float), harmonics)

    def iso_stiffness(self) -> IsoStiffness:
        """By ISO 6336-1, method B, in the transverse plane: the mesh's along the flanks' normal is
        `mesh face_width/cos²(base helix)`. Raises `InputError` for a pair that a machine refuses too."""
        refuse(problems(self, "GearPair"))
        return iso_stiffness(
            self._virtual_teeth(),
            self.profile_shifts,
            jnp.mean(self.dedenda),
            self.pressure_angle,
            self.helix_angle,
            self.contact_ratio(),
            self.youngs_modulus,
        )

    @takes(force=positive("N"), harmonics=whole(0, 64))
    def gear_mesh(
        self,
        force: Any,
        damping: Any = 0.0,
        harmonics: int = 8,
        gap: Any = None,
        orientation: Any = 0.0,
        error_amplitudes: Any = (),
        error_phases: Any = (),
    ) -> GearMesh:
        """What joins the two gears' stations in a machine: their radii, angles and stiffness over the
        engagement. `force`, `harmonics`: as for `mesh_stiffness`; `damping`, N*s/m, of the mean; `gap`: play
        along the line of action, m; the others as of `GearMesh`. Differentiable.

        Raises `InputError` as `mesh_stiffness` does.
        """
        refuse(problems(self, "GearPair"))
        found, error = _found(self, jnp.asarray(force, float), harmonics)
        law = (
            KelvinVoigt(found.mean, damping) if gap is None else Backlash(gap, found.mean, damping)
        )
        return self.joining(found, error, law, orientation, error_amplitudes, error_phases)

    def joining(
        self,
        found: MeshStiffness,
        relief: tuple[Array, Array],
        law: AbstractLaw,
        orientation: Any,
        error_amplitudes: Any,
        error_phases: Any,
    ) -> GearMesh:
        """`relief`: amplitudes and phases of its error, to which the gears' own are added."""
        meet = self.contact()
        own = jnp.asarray(error_amplitudes, float), jnp.asarray(error_phases, float)
        return GearMesh(
            meet.bases / jnp.cos(meet.pressure),
            law,
            meet.pressure,
            meet.base_helix,
            orientation,
            self.teeth[0],
            *added(own, relief),
            found.amplitudes,
            found.phases,
        )

    def found(self, force: Array, count: int) -> tuple[MeshStiffness, tuple[Array, Array]]:
        """Unchecked: the stiffness of the teeth that touch under the force, and amplitudes (m) and phases of
        the error that relief makes; its mean is no more than another zero of the angle."""
        if self.tip_reliefs is None:
            return harmonics_of(self, force, count), (jnp.zeros(0), jnp.zeros(0))
        at = _loaded(self, force, max(_SAMPLES, 8 * count))
        mean, sizes, phases = harmonics(at.stiffness, count)
        return MeshStiffness(mean, sizes / mean, phases), harmonics(at.error, count)[1:]

    def _relief(self, at: Array) -> Array:
        """Of both flanks where they touch, m."""
        if self.tip_reliefs is None or self.relief_lengths is None:
            return jnp.zeros_like(at)
        meet = self.contact()
        beyond = jnp.stack([at - meet.last, meet.first - at], axis=-1) / self.relief_lengths + 1
        return jnp.sum(self.tip_reliefs * jnp.maximum(beyond, 0.0), axis=-1)

    def _line_stiffness(self, force: Array, at: Array) -> Array:
        """Of one pair at a place, N/m²."""
        meet = self.contact()
        helix = jnp.cos(meet.base_helix)
        teeth = self.virtual()
        u = [reach / (helix * tooth.base) for reach, tooth in zip(meet.reach(at), teeth)]
        length = self.face_width / helix * meet.ratio
        give = flattening(
            teeth, (u[0], u[1]), force / length / self.youngs_modulus, self.poissons_ratio
        )
        for k, tooth in enumerate(teeth):
            bore = None if self.bores is None else 0.5 * self.bores[k]
            give = give + tooth_compliance(tooth, u[k], self.poissons_ratio, bore)
        return self.youngs_modulus / give


# Angles at which a relieved mesh is looked at.
_SAMPLES = 256


def harmonics_of(pair: GearPair, force: Array, count: int) -> MeshStiffness:
    """The integral of one pair's stiffness over its path, against each harmonic: the sum over all pairs that
    touch has these harmonics (Poisson's sum), and the face of a helical gear takes its mean of them."""
    meet = pair.contact()
    middle, span = 0.5 * (meet.first + meet.last), 0.5 * (meet.last - meet.first)
    at = middle + span * _NODES
    line = jax.vmap(lambda s: pair._line_stiffness(force, s))(at) * _WEIGHTS * span
    per_line = pair.face_width / jnp.cos(meet.base_helix) / meet.base_pitch
    mean = per_line * jnp.sum(line)
    k = jnp.arange(1, count + 1)
    turn = 2 * jnp.pi * k[:, None] * at / meet.base_pitch
    real, imaginary = jnp.cos(turn) @ line, -jnp.sin(turn) @ line
    over_face = jnp.sinc(k * pair.overlap_ratio())
    sizes = 2 * jnp.hypot(real, imaginary) / jnp.sum(line) * over_face
    return MeshStiffness(mean, sizes, jnp.arctan2(imaginary, real))


@lightly_compiled
def _found(pair: GearPair, force: Array, count: int):
    return pair.found(force, count)


@lightly_compiled
def _mesh_stiffness(pair: GearPair, force: Array, count: int) -> MeshStiffness:
    return harmonics_of(pair, force, count)


@lightly_compiled
def _pair_stiffness(pair: GearPair, force: Array, at: Array) -> Array:
    found = jax.vmap(lambda s: pair._line_stiffness(force, s))(jnp.ravel(at))
    return found.reshape(at.shape)


@lightly_compiled
def _stiffness(pair: GearPair, force: Array, angles: Array) -> Array:
    meet = pair.contact()
    found = over_angles(
        meet, pair.face_width, lambda s: pair._line_stiffness(force, s), jnp.ravel(angles)
    )
    return found.reshape(angles.shape)


@lightly_compiled
def _loaded(pair: GearPair, force: Array, count: int) -> LoadedMesh:
    angles = 2 * jnp.pi * jnp.arange(count) / count
    return loaded(
        pair.contact(),
        pair.face_width,
        lambda s: pair._line_stiffness(force, s),
        pair._relief,
        force,
        angles,
    )


class _Look(NamedTuple):
    """What tells whether gears can run: of both, u at the end of the fillet, the lowest u that is touched,
    half the tip's thickness; root circle over bore, and the contact ratio."""

    first: Array
    lowest: Array
    tip: Array
    ring: Array
    ratio: Array


@quickly_compiled
def _looked_at(pair: GearPair) -> _Look:
    meet = pair.contact()
    teeth = pair.virtual()
    helix = jnp.cos(meet.base_helix)
    ends = jnp.stack([meet.reach(meet.first), meet.reach(meet.last)])
    lowest, highest = jnp.min(ends, axis=0), jnp.max(ends, axis=0)
    bases = helix * jnp.stack([tooth.base for tooth in teeth])
    tips = [tooth.flank(u)[0] for tooth, u in zip(teeth, highest / bases)]
    roots = 0.5 * pair.module / jnp.cos(pair.helix_angle) * pair.teeth
    roots -= (pair.dedenda - pair.profile_shifts) * pair.module
    ring = jnp.ones(2) if pair.bores is None else 2 * roots / pair.bores
    return _Look(
        jnp.stack([tooth.first for tooth in teeth]),
        lowest / bases,
        jnp.stack(tips),
        ring,
        meet.ratio,
    )
