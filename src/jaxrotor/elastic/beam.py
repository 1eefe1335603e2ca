"""The 12x12 matrices of a uniform beam between two stations.

Coordinates: x, y, z, psi, theta, phi of station a, then of b. The beam runs along z, and the signs
are those of 1-2-3 angles: dx/dz = +theta, dy/dz = -psi. The patterns are constant, so a matrix is a
few products with powers of the length. Source: any finite-element text, e.g. Friswell et al.,
Dynamics of Rotating Machines (2010), ch. 5 (Bernoulli beam, no shear, no rotary inertia).
"""

import numpy as np
from jaxtyping import Array, Float

X, Y, Z, PSI, THETA, PHI = range(6)

# Cubic bending in (w_a, w'_a, w_b, w'_b): stiffness EI/L³ and mass rho A L/420 with L = 1; the power
# of L of each entry is the number of slopes in it.
_BEND_K = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], float)
_BEND_M = (
    np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]], float)
    / 420
)


def _place(pattern: np.ndarray, dofs: list[int], signs: list[int]) -> np.ndarray:
    out = np.zeros((12, 12))
    out[np.ix_(dofs, dofs)] = pattern * np.outer(signs, signs)
    return out


def _bending(pattern: np.ndarray) -> list[np.ndarray]:
    """Both planes, split by the number of slopes (0, 1, 2): the power of L."""
    slopes = np.add.outer([0, 1, 0, 1], [0, 1, 0, 1])
    return [
        _place(pattern * (slopes == n), [X, THETA, 6 + X, 6 + THETA], [1, 1, 1, 1])
        + _place(pattern * (slopes == n), [Y, PSI, 6 + Y, 6 + PSI], [1, -1, 1, -1])
        for n in range(3)
    ]


def _two_node(pattern: np.ndarray, dof: int) -> np.ndarray:
    return _place(pattern, [dof, 6 + dof], [1, 1])


_K_BENDING = _bending(_BEND_K)
_M_BENDING = _bending(_BEND_M)
_SPRING = np.array([[1.0, -1.0], [-1.0, 1.0]])
_ROD = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6


def beam_stiffness(
    length: Array, bending: Array, axial: Array, torsion: Array
) -> Float[Array, "12 12"]:
    """Stiffness from the length (m) and the rigidities EI (N·m²), EA (N), G Ip (N·m²)."""
    k0, k1, k2 = _K_BENDING
    return (
        bending / length**3 * (k0 + length * k1 + length**2 * k2)
        + axial / length * _two_node(_SPRING, Z)
        + torsion / length * _two_node(_SPRING, PHI)
    )


def beam_mass(length: Array, mass: Array, polar: Array) -> Float[Array, "12 12"]:
    """Consistent mass from the length (m), mass rho A (kg/m) and polar rho Ip (kg·m): bending
    without rotary inertia, linear rods in tension and torsion."""
    m0, m1, m2 = _M_BENDING
    return mass * length * (
        m0 + length * m1 + length**2 * m2 + _two_node(_ROD, Z)
    ) + polar * length * _two_node(_ROD, PHI)
