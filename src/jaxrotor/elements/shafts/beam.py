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


# What yielding to shear adds to the slope-slope entries: phi/(1 + phi) of EI/L.
_SHEAR_K = np.array([[0, 0, 0, 0], [0, 1, 0, -1], [0, 0, 0, 0], [0, -1, 0, 1]], float)
_K_SHEAR = _bending(_SHEAR_K)[2]


def shear_coefficient(youngs_modulus: Array, shear_modulus: Array, hollow: Array) -> Array:
    """Cowper's coefficient of a round section; `hollow` is inner over outer diameter.

    Source: Cowper, J. Appl. Mech. 33 (1966) 335.
    """
    nu = youngs_modulus / (2 * shear_modulus) - 1
    m = hollow**2
    return 6 * (1 + nu) * (1 + m) ** 2 / ((7 + 6 * nu) * (1 + m) ** 2 + (20 + 12 * nu) * m)


def beam_stiffness(
    length: Array, bending: Array, axial: Array, torsion: Array, shear: Array | None = None
) -> Float[Array, "12 12"]:
    """Stiffness from the length (m) and the rigidities EI (N·m²), EA (N), G Ip (N·m²), and for a beam
    that yields to shear from `shear = 12 EI/(kappa G A L²)`."""
    k0, k1, k2 = _K_BENDING
    bent = k0 + length * k1 + length**2 * k2
    if shear is not None:
        # 4 + phi and 2 - phi in place of 4 and 2, all over 1 + phi
        bent = (bent + shear * length**2 * _K_SHEAR) / (1 + shear)
    return (
        bending / length**3 * bent
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
