"""A short piece of shaft with mass: its section, its shapes of deflection, what they add up to.

Shapes are those of a uniform Timoshenko beam under end loads, so that one element is exact in statics.
Source: Przemieniecki, Theory of Matrix Structural Analysis (1968), ch. 5 and 11; Nelson, J. Mech. Des.
102 (1980) 793 (tapered elements by integration along the axis).
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.protocol import Motion, Vec6
from .beam import shear_coefficient

# Five points integrate a tapered section's mass exactly (degree 8).
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
POINTS, WEIGHTS = (_POINTS + 1) / 2, _WEIGHTS / 2

# Of a section: matrices are full, and each element brings twelve states.
MOST_ELEMENTS = 1000


class Segment(eqx.Module):
    """Diameters (m) run straight from `diameters[0]` at the left end to `diameters[1]`."""

    length: Float[Array, ""]
    diameters: Float[Array, "2"]
    inner_diameters: Float[Array, "2"]
    youngs_modulus: Float[Array, ""]
    shear_modulus: Float[Array, ""]
    density: Float[Array, ""]
    shear: bool = eqx.field(static=True)
    rotary_inertia: bool = eqx.field(static=True)
    gyroscopic: bool = eqx.field(static=True)

    def section(self, s: Any) -> tuple[Array, Array]:
        """Area and second moment of area at the parts s of the length."""
        do, di = (d**2 for d in self._across(s))
        area = jnp.pi / 4 * (do - di)
        return area, area / 16 * (do + di)

    def _across(self, s: Any) -> Any:
        shares = np.stack([1 - s, s], axis=-1)
        return shares @ self.diameters, shares @ self.inner_diameters

    def shear_rigidity(self, s: Any) -> Array:
        """kappa G A, N."""
        do, di = self._across(s)
        kappa = shear_coefficient(self.youngs_modulus, self.shear_modulus, di / do)
        return kappa * self.shear_modulus * self.section(s)[0]

    def yielding(self) -> Array:
        """12 EI/(kappa G A L²) in the middle."""
        if not self.shear:
            return jnp.zeros_like(self.length)
        bending = self.youngs_modulus * self.section(0.5)[1]
        return 12 * bending / (self.shear_rigidity(0.5) * self.length**2)

    def shapes(self) -> tuple[Array, Array, Array, Array]:
        """Of (w, slope) at both ends: deflection, slope of the section and curvature at the points,
        (4, points), and the shear angle, (4,), which is the same all along."""
        p, L, s = self.yielding(), self.length, POINTS
        deflection = jnp.stack(
            [
                1 - 3 * s**2 + 2 * s**3 + p * (1 - s),
                L * (s - 2 * s**2 + s**3 + p / 2 * (s - s**2)),
                3 * s**2 - 2 * s**3 + p * s,
                L * (-(s**2) + s**3 + p / 2 * (s**2 - s)),
            ]
        )
        slope = jnp.stack(
            [
                6 / L * (s**2 - s),
                1 - 4 * s + 3 * s**2 + p * (1 - s),
                6 / L * (s - s**2),
                -2 * s + 3 * s**2 + p * s,
            ]
        )
        curvature = jnp.stack(
            [
                6 / L**2 * (2 * s - 1),
                (-4 + 6 * s - p) / L,
                6 / L**2 * (1 - 2 * s),
                (-2 + 6 * s + p) / L,
            ]
        )
        one = jnp.ones_like(p)
        sheared = p * jnp.stack([-one / L, -0.5 * one, one / L, -0.5 * one])
        return deflection / (1 + p), slope / (1 + p), curvature / (1 + p), sheared / (1 + p)

    @eqx.filter_jit  # traced once for all segments of a machine, and for all machines
    def matrices(self) -> tuple[Array, Array, Array]:
        """Stiffness, consistent mass, and gyroscopic matrix per speed less what acts at the nodes
        themselves (12x12 each)."""
        deflection, slope, curvature, sheared = self.shapes()
        area, moment = self.section(POINTS)
        dl = WEIGHTS * self.length
        axial = jnp.sum(self.youngs_modulus * dl * area)
        torsion = jnp.sum(self.shear_modulus * dl * 2 * moment)
        K = axial / self.length**2 * _ROD_K[2] + torsion / self.length**2 * _ROD_K[5]
        K += both_planes(curvature, self.youngs_modulus * dl * moment)
        if self.shear:
            K += both_planes(sheared[:, None], jnp.sum(dl * self.shear_rigidity(POINTS))[None])
        mass, polar = self.density * dl * area, self.density * dl * 2 * moment
        M = both_planes(deflection, mass)
        M += jnp.einsum("p,pab->ab", mass, _ROD_M[2]) + jnp.einsum("p,pab->ab", polar, _ROD_M[5])
        # at the nodes: what their own spin momentum gives already
        G = -jnp.einsum("p,pab->ab", polar, _NODAL_G)
        if self.rotary_inertia:
            M += both_planes(slope, polar / 2)
        if self.gyroscopic:
            psi, theta = -IN_Y.T @ slope, IN_X.T @ slope
            across = jnp.einsum("ap,p,bp->ab", psi, polar, theta)
            G += across - across.T
        return K, M, G

    def strain_energy(self, a: Vec6, b: Vec6) -> Array:
        """J, of the coordinates of both ends, or W·s of their rates."""
        _, _, curvature, sheared = self.shapes()
        area, moment = self.section(POINTS)
        x = jnp.stack([a[0], a[4], b[0], b[4]])
        y = jnp.stack([a[1], -a[3], b[1], -b[3]])
        stretch, twist = (b[2] - a[2]) / self.length, (b[5] - a[5]) / self.length
        density = self.youngs_modulus * (
            moment * ((x @ curvature) ** 2 + (y @ curvature) ** 2) + area * stretch**2
        )
        density += self.shear_modulus * 2 * moment * twist**2
        if self.shear:
            density += self.shear_rigidity(POINTS) * ((sheared @ x) ** 2 + (sheared @ y) ** 2)
        return 0.5 * self.length * jnp.sum(WEIGHTS * density)

    def kinetic_energy(self, motions: tuple[Motion, ...], hat: bool = True) -> Array:
        """J; `hat`: with the spin about the shaft's own axis, else with phi' alone."""
        (qa, a), (qb, b) = motions
        deflection, slope, _, _ = self.shapes()
        area, moment = self.section(POINTS)
        x = jnp.stack([a[0], a[4], b[0], b[4]])
        y = jnp.stack([a[1], -a[3], b[1], -b[3]])
        tilted = 1.0 if hat else 0.0
        spins = [v[5] + tilted * v[3] * jnp.sin(q[4]) for q, v in motions]
        z = (1 - POINTS) * a[2] + POINTS * b[2]
        spin = (1 - POINTS) * spins[0] + POINTS * spins[1]
        density = area * ((x @ deflection) ** 2 + (y @ deflection) ** 2 + z**2)
        density += 2 * moment * spin**2
        if self.rotary_inertia:
            density += moment * ((x @ slope) ** 2 + (y @ slope) ** 2)
        return 0.5 * self.length * self.density * jnp.sum(WEIGHTS * density)

    def height_energy(self, motions: tuple[Motion, ...], gravity: Float[Array, "3"]) -> Array:
        """J."""
        (a, _), (b, _) = motions
        deflection = self.shapes()[0]
        x = jnp.stack([a[0], a[4], b[0], b[4]]) @ deflection
        y = jnp.stack([a[1], -a[3], b[1], -b[3]]) @ deflection
        z = (1 - POINTS) * a[2] + POINTS * b[2]
        along = gravity[0] * x + gravity[1] * y + gravity[2] * z
        area, _ = self.section(POINTS)
        return -self.length * self.density * jnp.sum(WEIGHTS * area * along)


# Where (w, slope, w, slope) stand among the twelve coordinates: x and theta, y and -psi.
IN_X, IN_Y = np.zeros((4, 12)), np.zeros((4, 12))
IN_X[[0, 1, 2, 3], [0, 4, 6, 10]] = 1.0
IN_Y[[0, 1, 2, 3], [1, 3, 7, 9]] = [1.0, -1.0, 1.0, -1.0]


def both_planes(shape: Array, weights: Array) -> Float[Array, "12 12"]:
    """The sum over points of weight times shape times itself, in both planes; shape (4, points)."""
    squares = jnp.einsum("ap,p,bp->ab", shape, weights, shape)
    return jnp.asarray(IN_X.T @ squares @ IN_X + IN_Y.T @ squares @ IN_Y)


def _rod(component: int) -> tuple[np.ndarray, np.ndarray]:
    """Of a linear rod along one coordinate: the pattern of stiffness, and of mass at each point."""
    ends = np.zeros((2, 12))
    ends[[0, 1], [component, 6 + component]] = 1.0
    linear = np.stack([1 - POINTS, POINTS]).T @ ends
    stretch = ends[1] - ends[0]
    return np.outer(stretch, stretch), np.einsum("pa,pb->pab", linear, linear)


_ROD_K, _ROD_M = ({c: _rod(c)[i] for c in (2, 5)} for i in (0, 1))
_NODAL_G = np.zeros((len(POINTS), 12, 12))
for _end, _share in ((0, 1 - POINTS), (6, POINTS)):
    _NODAL_G[:, _end + 3, _end + 4], _NODAL_G[:, _end + 4, _end + 3] = _share, -_share
