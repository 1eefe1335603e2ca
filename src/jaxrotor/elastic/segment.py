"""A short piece of shaft with mass: its section, its shapes of deflection, what they add up to.

Shapes are those of a uniform Timoshenko beam under end loads, so that one element is exact in statics.
Source: Przemieniecki, Theory of Matrix Structural Analysis (1968), ch. 5 and 11; Nelson, J. Mech. Des.
102 (1980) 793 (tapered elements by integration along the axis).
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..protocol import Motion, Vec6
from .beam import shear_coefficient

# Five points integrate a tapered section's mass exactly (degree 8).
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
POINTS, WEIGHTS = (_POINTS + 1) / 2, _WEIGHTS / 2


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

    def section(self, s: float) -> tuple[Array, Array]:
        """Area and second moment of area at the part s of the length."""
        do, di = ((1 - s) * d[0] + s * d[1] for d in (self.diameters, self.inner_diameters))
        return jnp.pi / 4 * (do**2 - di**2), jnp.pi / 64 * (do**4 - di**4)

    def shear_rigidity(self, s: float) -> Array:
        """kappa G A, N."""
        do, di = ((1 - s) * d[0] + s * d[1] for d in (self.diameters, self.inner_diameters))
        kappa = shear_coefficient(self.youngs_modulus, self.shear_modulus, di / do)
        return kappa * self.shear_modulus * self.section(s)[0]

    def yielding(self) -> Array:
        """12 EI/(kappa G A L²) in the middle."""
        if not self.shear:
            return jnp.zeros_like(self.length)
        bending = self.youngs_modulus * self.section(0.5)[1]
        return 12 * bending / (self.shear_rigidity(0.5) * self.length**2)

    def shapes(self, s: float) -> tuple[Array, Array, Array]:
        """Deflection, slope of the section, and curvature, of (w, slope) at both ends: (4,) each."""
        p, L = self.yielding(), self.length
        deflection = [
            1 - 3 * s**2 + 2 * s**3 + p * (1 - s),
            L * (s - 2 * s**2 + s**3 + p / 2 * (s - s**2)),
            3 * s**2 - 2 * s**3 + p * s,
            L * (-(s**2) + s**3 + p / 2 * (s**2 - s)),
        ]
        slope = [
            6 / L * (s**2 - s),
            1 - 4 * s + 3 * s**2 + p * (1 - s),
            6 / L * (s - s**2),
            -2 * s + 3 * s**2 + p * s,
        ]
        curvature = [
            6 / L**2 * (2 * s - 1),
            (-4 + 6 * s - p) / L,
            6 / L**2 * (1 - 2 * s),
            (-2 + 6 * s + p) / L,
        ]
        return tuple(jnp.stack(x) / (1 + p) for x in (deflection, slope, curvature))  # pyright: ignore

    def shear_shape(self) -> Array:
        """Shear angle of (w, slope) at both ends."""
        p, L = self.yielding(), self.length
        one = jnp.ones_like(p)
        return p / (1 + p) * jnp.stack([-one / L, -0.5 * one, one / L, -0.5 * one])

    def matrices(self) -> tuple[Array, Array, Array]:
        """Stiffness, consistent mass, and gyroscopic matrix per speed less what acts at the nodes
        themselves (12x12 each)."""
        K = M = jnp.zeros((12, 12))
        G = jnp.zeros((12, 12))
        sheared = [_plane(self.shear_shape(), k) for k in (0, 1)]
        for s, weight in zip(POINTS, WEIGHTS * 1.0):
            area, moment = self.section(s)
            dl = weight * self.length
            deflection, slope, curvature = self.shapes(s)
            x, y = _plane(deflection, 0), _plane(deflection, 1)
            theta, psi = _plane(slope, 0), -_plane(slope, 1)
            linear = jnp.array([1 - s, s])
            z, phi = _two(linear, 2), _two(linear, 5)
            stretch, twist = _two(jnp.array([-1.0, 1.0]), 2), _two(jnp.array([-1.0, 1.0]), 5)
            bent = sum(jnp.outer(_plane(curvature, k), _plane(curvature, k)) for k in (0, 1))
            K += dl * self.youngs_modulus * (
                moment * bent + area * jnp.outer(stretch, stretch) / self.length**2
            )
            K += dl * self.shear_modulus * 2 * moment * jnp.outer(twist, twist) / self.length**2
            if self.shear:
                K += dl * self.shear_rigidity(s) * sum(jnp.outer(g, g) for g in sheared)
            rho = self.density
            M += dl * rho * area * sum(jnp.outer(h, h) for h in (x, y, z))
            M += dl * rho * 2 * moment * jnp.outer(phi, phi)
            polar = dl * rho * 2 * moment
            if self.rotary_inertia:
                M += dl * rho * moment * (jnp.outer(psi, psi) + jnp.outer(theta, theta))
                G += polar * (jnp.outer(psi, theta) - jnp.outer(theta, psi))
            for k in (0, 1):  # what the nodes' own spin momentum gives already
                share = polar * linear[k]
                G = G.at[6 * k + 3, 6 * k + 4].add(-share).at[6 * k + 4, 6 * k + 3].add(share)
        return K, M, G

    def strain_energy(self, a: Vec6, b: Vec6) -> Array:
        """J, of the coordinates of both ends, or W·s of their rates."""
        x = jnp.stack([a[0], a[4], b[0], b[4]])
        y = jnp.stack([a[1], -a[3], b[1], -b[3]])
        stretch, twist = (b[2] - a[2]) / self.length, (b[5] - a[5]) / self.length
        total = jnp.zeros(())
        for s, weight in zip(POINTS, WEIGHTS):
            area, moment = self.section(s)
            curvature = self.shapes(s)[2]
            density = self.youngs_modulus * (
                moment * ((curvature @ x) ** 2 + (curvature @ y) ** 2) + area * stretch**2
            )
            density += self.shear_modulus * 2 * moment * twist**2
            if self.shear:
                g = self.shear_shape()
                density += self.shear_rigidity(s) * ((g @ x) ** 2 + (g @ y) ** 2)
            total += 0.5 * weight * self.length * density
        return total

    def kinetic_energy(self, motions: tuple[Motion, ...], hat: bool = True) -> Array:
        """J; `hat`: with the spin about the shaft's own axis, else with phi' alone."""
        (qa, a), (qb, b) = motions
        x = jnp.stack([a[0], a[4], b[0], b[4]])
        y = jnp.stack([a[1], -a[3], b[1], -b[3]])
        tilted = 1.0 if hat else 0.0
        spins = [v[5] + tilted * v[3] * jnp.sin(q[4]) for q, v in motions]
        total = jnp.zeros(())
        for s, weight in zip(POINTS, WEIGHTS):
            area, moment = self.section(s)
            deflection, slope, _ = self.shapes(s)
            z = (1 - s) * a[2] + s * b[2]
            spin = (1 - s) * spins[0] + s * spins[1]
            density = area * ((deflection @ x) ** 2 + (deflection @ y) ** 2 + z**2)
            density += 2 * moment * spin**2
            if self.rotary_inertia:
                density += moment * ((slope @ x) ** 2 + (slope @ y) ** 2)
            total += 0.5 * weight * self.length * self.density * density
        return total

    def height_energy(self, motions: tuple[Motion, ...], gravity: Float[Array, "3"]) -> Array:
        """J."""
        (a, _), (b, _) = motions
        x = jnp.stack([a[0], a[4], b[0], b[4]])
        y = jnp.stack([a[1], -a[3], b[1], -b[3]])
        total = jnp.zeros(())
        for s, weight in zip(POINTS, WEIGHTS):
            deflection, _, _ = self.shapes(s)
            place = jnp.stack([deflection @ x, deflection @ y, (1 - s) * a[2] + s * b[2]])
            total -= weight * self.length * self.density * self.section(s)[0] * (gravity @ place)
        return total


def _plane(shape: Array, plane: int) -> Array:
    """(w, slope, w, slope) in the plane of x and theta (0), or of y and -psi (1), as a row of 12."""
    place = np.array([0, 4, 6, 10]) if plane == 0 else np.array([1, 3, 7, 9])
    sign = np.array([1, 1, 1, 1]) if plane == 0 else np.array([1, -1, 1, -1])
    return jnp.zeros(12).at[place].set(shape * sign)


def _two(values: Array, component: int) -> Array:
    return jnp.zeros(12).at[np.array([component, 6 + component])].set(values)
