"""The shaft section of the paper: elastic and damping, without inertia of its own."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import AbstractElastic, Energetic, Linear, Motion, Nominal, Signalling, Vec6
from .beam import beam_mass, beam_stiffness, shear_coefficient
from .defect import AbstractShaftDefect, Section, as_defect, defect_energy, defect_forces
from .material import AnyMaterial, steel, undamped
from .twist import circulation, damped_rates, twist_torque


class Half(NamedTuple):
    """Half of a section, as a bearing takes it: mass (kg), length (m), ro² + ri² (m²)."""

    mass: Array
    length: Array
    radii_squared: Array


class Shaft(AbstractElastic, Linear, Energetic, Signalling, Nominal):
    """A uniform shaft section between two stations: a Bernoulli beam in both planes, a rod in
    tension and torsion, with Rayleigh damping `C = alpha M + beta K`.

    **Arguments:**

    - `length`, `diameter`, `inner_diameter`: m.
    - `material`: see `STEEL`.
    - `rayleigh`: `(alpha, beta)` in 1/s and s. M is the section's consistent mass, used for damping
      alone: the section itself has no inertia (bearings take up half of it, see
      `SelfAligningBearing`).
    - `damping`: `"fixed"`, the paper's, dissipates at any speed. `"rotating"` lets the `beta K` part
      act in the shaft's own frame, `F = -beta K (v - W×q)`, as internal damping does: beyond
      `w0 (1 + external/internal)` it destabilises, fed by the drive through its reaction on phi.
    - `shear`: whether it yields to shear (Timoshenko; Cowper's coefficient for the section).
    - `twist`: `"invariant"` measures turning by `chi = phi + psi theta/2`, so that turning an
      isotropic machine about z changes nothing; `"paper"` by phi alone, the published law. One shaft that
      says `"paper"` makes the whole machine measure it so: its twist, and every torque about the axis.
    - `flaw`: what turns with the section and changes how it bends: `Bow`, `Kink`, `Asymmetry`, `Crack`,
      `SwitchingCrack`, or several. Damping stays that of the sound section.

    Signs: dx/dz = +theta, dy/dz = -psi. Sources: Matyja & Łazarz 2014 (section, damping);
    `docs/physics.md` (invariant twist, rotating damping).
    """

    length: Float[Array, ""] = parameter("m", positive=True)
    diameter: Float[Array, ""] = parameter("m", positive=True)
    inner_diameter: Float[Array, ""] = parameter("m", nonnegative=True, default=0.0)
    material: AnyMaterial = steel()
    rayleigh: Float[Array, "2"] = undamped()
    damping: Literal["fixed", "rotating"] = eqx.field(static=True, default="fixed")
    twist: Literal["invariant", "paper"] = eqx.field(static=True, default="invariant")
    shear: bool = eqx.field(static=True, default=False)
    flaw: AbstractShaftDefect | None = eqx.field(
        converter=as_defect,
        default=None,
        metadata=dict(
            made_by=["Bow", "Kink", "Asymmetry", "Crack", "SwitchingCrack", "or several (a tuple)"]
        ),
    )

    signals: ClassVar[dict[str, str]] = {"torque": "N*m"}

    def faults(self) -> Iterator[str]:
        if float(self.inner_diameter) >= float(self.diameter):
            yield (
                f"inner_diameter must be smaller than the diameter, but is "
                f"{float(self.inner_diameter):g} against {float(self.diameter):g} m"
            )
        if isinstance(self.flaw, AbstractShaftDefect):
            yield from self.flaw.misfits(self)

    def nominal(self) -> "Shaft":
        return eqx.tree_at(lambda s: s.flaw, self, None, is_leaf=lambda x: x is None)

    def _section(self) -> tuple[Array, Array]:
        """Area (m²) and second moment of area (m⁴; the polar one is twice that)."""
        do, di = self.diameter, self.inner_diameter
        return jnp.pi / 4 * (do**2 - di**2), jnp.pi / 64 * (do**4 - di**4)

    def half(self) -> Half:
        """What a bearing at one end lumps to itself."""
        area, _ = self._section()
        length = self.length / 2
        squares = (self.diameter**2 + self.inner_diameter**2) / 4
        return Half(self.material.density * area * length, length, squares)

    def _stiffness(self) -> Float[Array, "12 12"]:
        area, moment = self._section()
        m = self.material
        return beam_stiffness(
            self.length,
            m.youngs_modulus * moment,
            m.youngs_modulus * area,
            m.shear_modulus * 2 * moment,
            self._yield() if self.shear else None,
        )

    def _yield(self) -> Array:
        """12 EI/(kappa G A L²): how much it yields to shear, against bending."""
        area, moment = self._section()
        m = self.material
        kappa = shear_coefficient(
            m.youngs_modulus, m.shear_modulus, self.inner_diameter / self.diameter
        )
        return 12 * m.youngs_modulus * moment / (kappa * m.shear_modulus * area * self.length**2)

    def _sound(self) -> Section:
        """What a defect needs to know."""
        _, moment = self._section()
        m = self.material
        return Section(
            self.length,
            self.diameter,
            self.inner_diameter,
            m.youngs_modulus,
            m.youngs_modulus / (2 * m.shear_modulus) - 1,
            m.youngs_modulus * moment,
            self._yield() if self.shear else jnp.zeros_like(self.length),
        )

    def matrices(self) -> tuple[Float[Array, "12 12"], Float[Array, "12 12"]]:
        area, moment = self._section()
        rho = self.material.density
        K = self._stiffness()
        M = beam_mass(self.length, rho * area, rho * 2 * moment)
        alpha, beta = self.rayleigh
        return K, alpha * M + beta * K

    def _torsion(self) -> Array:
        _, moment = self._section()
        return self.material.shear_modulus * 2 * moment / self.length

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...] | None:
        parts = []
        if self.damping == "rotating":
            B = self.rayleigh[1] * self._stiffness()
            parts.append(circulation(B, motions))
        if self.flaw is not None:
            (qa, _), (qb, _) = motions
            parts.append(defect_forces(self.flaw, self._sound(), qa, qb))
        if not parts:
            return None
        return tuple(sum(each) for each in zip(*parts))  # pyright: ignore

    def torque(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """Twisting moment, N·m: positive when the right end leads; it pulls the left end along."""
        k = self._torsion()
        return twist_torque(k, self.rayleigh[1] * k, motions)

    # The energy is integrated along the section, apart from the matrices above.

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        (qa, _), (qb, _) = motions
        beyond = 0.0
        if self.flaw is not None:
            beyond = defect_energy(self.flaw, self._sound(), qa, qb)
        return self._strain_energy(qa, qb) + beyond

    def _strain_energy(self, a: Vec6, b: Vec6) -> Array:
        """∫ (EI (x''² + y''²) + EA z'² + G Ip phi'²)/2 along the section, by Gauss quadrature."""
        area, moment = self._section()
        m, L = self.material, self.length
        yielding = self._yield() if self.shear else 0.0
        points, weights = np.polynomial.legendre.leggauss(2)  # exact: curvature is linear
        total = 0.0
        for s, weight in zip((points + 1) / 2, weights / 2):
            h = (-6 + 12 * s, -4 + 6 * s - yielding, 6 - 12 * s, -2 + 6 * s + yielding)
            x_zz = (h[0] * a[0] + h[1] * L * a[4] + h[2] * b[0] + h[3] * L * b[4]) / L**2
            y_zz = (h[0] * a[1] - h[1] * L * a[3] + h[2] * b[1] - h[3] * L * b[3]) / L**2
            total += weight * m.youngs_modulus * moment * (x_zz**2 + y_zz**2)
        # shear is the same all along
        x_shear = (b[0] - a[0]) / L - (a[4] + b[4]) / 2
        y_shear = (b[1] - a[1]) / L + (a[3] + b[3]) / 2
        sheared = 12 * m.youngs_modulus * moment / L**2 * yielding * (x_shear**2 + y_shear**2)
        total = (total + sheared) / (1 + yielding) ** 2
        stretch, twist = (b[2] - a[2]) / L, (b[5] - a[5]) / L
        return (
            0.5
            * L
            * (
                total
                + m.youngs_modulus * area * stretch**2
                + m.shear_modulus * 2 * moment * twist**2
            )
        )

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """alpha times twice the kinetic energy a rod of this mass would have, and beta times twice
        the strain energy of the rates (seen from the turning shaft where damping is rotating)."""
        area, moment = self._section()
        rho, L = self.material.density, self.length
        (qa, va), (qb, vb) = motions
        points, weights = np.polynomial.legendre.leggauss(4)  # exact for cubic shapes squared
        kinetic = 0.0
        for s, weight in zip((points + 1) / 2, weights / 2):
            h = np.array(
                [1 - 3 * s**2 + 2 * s**3, s - 2 * s**2 + s**3, 3 * s**2 - 2 * s**3, s**3 - s**2]
            )
            x_t = h[0] * va[0] + h[1] * L * va[4] + h[2] * vb[0] + h[3] * L * vb[4]
            y_t = h[0] * va[1] - h[1] * L * va[3] + h[2] * vb[1] - h[3] * L * vb[3]
            z_t, phi_t = ((1 - s) * va[i] + s * vb[i] for i in (2, 5))
            kinetic += weight * rho * (area * (x_t**2 + y_t**2 + z_t**2) + 2 * moment * phi_t**2)
        rates = damped_rates(motions, self.damping)
        alpha, beta = self.rayleigh
        return alpha * L * kinetic + beta * 2 * self._strain_energy(*rates)
