"""A characteristic given by points."""

from collections.abc import Iterator

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...profiles.monotone import row_before, slopes, table_faults
from .law import AbstractLaw, Scalar, States


class TabulatedLaw(AbstractLaw):
    """A measured characteristic with a viscous damper beside it.

    `displacements` and `forces` begin at 0; the law is odd. Between the points runs a monotone cubic
    (Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; as SciPy's PCHIP through the table
    and its mirror image), beyond the last point a straight line with the slope there.
    """

    displacements: Float[Array, " n"] = parameter("rad", nonnegative=True, shapes=((None,),))
    forces: Float[Array, " n"] = parameter("N*m", shapes=((None,),))
    damping: Scalar = parameter("N*m*s/rad", nonnegative=True, default=0.0)

    def faults(self) -> Iterator[str]:
        x, f = self.displacements, self.forces
        found = list(table_faults(x, f, ("displacements", "forces"), ""))
        yield from found
        if not found and (x[0] != 0 or f[0] != 0):
            yield (
                f"displacements and forces must begin at 0, but begin at {float(x[0]):g} and "
                f"{float(f[0]):g}: the law is odd, give its positive half"
            )

    def _slopes(self) -> Float[Array, " n"]:
        x, f = self.displacements, self.forces
        # at 0 the mirror image makes the harmonic mean of neighbours the secant itself
        return slopes(x, f).at[0].set((f[1] - f[0]) / (x[1] - x[0]))

    def _piece(self, u: Scalar) -> tuple[Array, Array]:
        """The row before `u`, and how far on to the next."""
        x = self.displacements
        i = row_before(x, u)
        return i, (u - x[i]) / (x[i + 1] - x[i])

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        side = jnp.where(x < 0, -1.0, 1.0)  # not abs: it has no slope at 0
        u = side * x
        f, m, h = self.forces, self._slopes(), jnp.diff(self.displacements)
        i, s = self._piece(u)
        inside = (
            f[i] * (1 - 3 * s**2 + 2 * s**3)
            + f[i + 1] * (3 * s**2 - 2 * s**3)
            + h[i] * (m[i] * (s - 2 * s**2 + s**3) + m[i + 1] * (s**3 - s**2))
        )
        over = u - self.displacements[-1]
        return side * jnp.where(over > 0, f[-1] + m[-1] * over, inside) + self.damping * v

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        u = jnp.where(x < 0, -x, x)
        f, m, h = self.forces, self._slopes(), jnp.diff(self.displacements)
        areas = h * (f[:-1] + f[1:]) / 2 + h**2 * (m[:-1] - m[1:]) / 12
        before = jnp.concatenate([jnp.zeros(1), jnp.cumsum(areas)])
        i, s = self._piece(u)
        inside = before[i] + h[i] * (
            f[i] * (s - s**3 + s**4 / 2)
            + f[i + 1] * (s**3 - s**4 / 2)
            + h[i] * m[i] * (s**2 / 2 - 2 * s**3 / 3 + s**4 / 4)
            + h[i] * m[i + 1] * (s**4 / 4 - s**3 / 3)
        )
        over = u - self.displacements[-1]
        return jnp.where(over > 0, before[-1] + f[-1] * over + 0.5 * m[-1] * over**2, inside)

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        return self.damping * v**2
