"""How much a transverse crack adds to the flexibility of a round shaft, by fracture mechanics.

The crack has a straight front across the shaft. Each strip of the section (thickness dx, height
h = 2 sqrt(R² - x²), cracked to the depth y of the part below it) is taken as an edge-cracked plate:
bent, `K = sigma sqrt(pi y) F2(y/h)`, by the moment that opens the crack, and pulled,
`K = sigma sqrt(pi y) F1(y/h)`, by the one at right angles. Castigliano's theorem gives the rotation,
c = 2 (1 - nu²)/E ∫∫ (K/M)² dy dx. Sources: Tada, Paris & Irwin, The Stress Analysis of Cracks Handbook
(F1, F2, within 0.5 %); Dimarogonas & Paipetis, Analytical Methods in Rotor Dynamics (1983); Papadopoulos &
Dimarogonas, J. Sound Vib. 117 (1987) 81; Dimarogonas, Eng. Fract. Mech. 55 (1996) 831.
"""

import functools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_DEGREE = 16
# As the depth falls to zero, c goes with these powers of it.
_POWERS = np.array([2.5, 3.5])


def _pulled(r: np.ndarray) -> np.ndarray:
    a = np.pi / 2 * r
    return np.sqrt(np.tan(a) / a) * (0.752 + 2.02 * r + 0.37 * (1 - np.sin(a)) ** 3) / np.cos(a)


def _bent(r: np.ndarray) -> np.ndarray:
    a = np.pi / 2 * r
    return np.sqrt(np.tan(a) / a) * (0.923 + 0.199 * (1 - np.sin(a)) ** 4) / np.cos(a)


def strips(depth: float, points: int = 96) -> np.ndarray:
    """pi E R³/(1 - nu²) times the compliance against opening and at right angles, of a crack `depth`
    (of the radius) deep: the integral over the strips."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    nodes, weights = (nodes + 1) / 2, weights / 2
    width = np.sqrt(depth * (2 - depth))
    x = width * nodes[:, None]
    half = np.sqrt(1 - x**2)
    deep = half - (1 - depth)
    y = deep * nodes
    area = 2 * width * weights[:, None] * deep * weights
    r = y / (2 * half)
    opening = np.sum(area * (1 - x**2) * y * _bent(r) ** 2)
    across = np.sum(area * x**2 * y * _pulled(r) ** 2)
    return 32 * np.array([opening, across])


@functools.cache
def _polynomial() -> np.ndarray:
    """Through the strips at Chebyshev's points, but for the powers; in 2 depth/R - 1."""
    points = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
    depths = 0.5 * (points + 1)
    values = np.stack([strips(a) / a**_POWERS for a in depths])
    fitted = np.polynomial.chebyshev.chebfit(points, values, _DEGREE)
    return np.stack([np.polynomial.chebyshev.cheb2poly(column) for column in fitted.T], axis=-1)


def crack_compliance(
    depth: Array, diameter: Array, youngs_modulus: Array, poisson_ratio: Array
) -> Float[Array, "2"]:
    """rad/(N·m): against the moment that opens the crack, and against that at right angles.

    `depth`: of the diameter, 0 to 0.5. A polynomial through the strips, right to 2e-6 of them.
    """
    a = 2 * depth
    total = jnp.zeros(2)
    for row in _polynomial()[::-1]:
        total = total * (2 * a - 1) + row
    R = 0.5 * diameter
    return (1 - poisson_ratio**2) / (jnp.pi * youngs_modulus * R**3) * a**_POWERS * total
