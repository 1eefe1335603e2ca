"""Shafts that bend more easily in one direction than in the other."""

from collections.abc import Iterator
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import number, positive
from ...core.errors import InputError
from ...core.gate import takes
from ...core.parameter import known, parameter
from .defect import AbstractShaftDefect, Bend, Section, towards


class Asymmetry(AbstractShaftDefect):
    """Different second moments of area in two directions that turn with the shaft: two poles, a keyway,
    flats. `ratio` is (I1 - I2)/(I1 + I2): I1 resists bending towards `angle` (rad, in the shaft, from its x
    axis), I2 at right angles; their mean is that of the section's diameter.

    Between the critical speeds of both directions the rotor is unstable, however well balanced; under
    weight it vibrates at twice the speed, most at half its critical speed. Torsion, tension and damping
    are those of the round section. Source: Laval's rotor with a flat shaft, e.g. Dimentberg, Flexural
    Vibrations of Rotating Shafts (1961), ch. 3; Friswell et al., Dynamics of Rotating Machines (2010), 7.4.
    """

    ratio: Float[Array, ""] = parameter()
    angle: Float[Array, ""] = parameter("rad", default=0.0)

    def faults(self) -> Iterator[str]:
        if not abs(float(self.ratio)) < 1:
            yield (
                f"ratio must lie between -1 and 1, (I1 - I2)/(I1 + I2) of two positive moments of area, "
                f"but is {float(self.ratio):g}"
            )

    def flexibility(
        self, section: Section, carried: Bend, angle: Float[Array, ""]
    ) -> Float[Array, "4 4"] | None:
        # bending alone: how it yields to shear stays
        even = section.length / section.rigidity
        total = jnp.zeros((4, 4))
        for ratio, turned in ((self.ratio, 0.0), (-self.ratio, jnp.pi / 2)):
            mean = towards(jnp.asarray(0.5), self.angle + turned)  # no difference: (c, s, 0, 0)
            sway = jnp.roll(mean, 2)
            both = jnp.outer(mean, mean) + jnp.outer(sway, sway) / 3
            total = total + even * (1 / (1 + ratio) - 1) * both
        return total


@takes(diameter=positive("m"), width=positive("m"), depth=positive("m"), angle=number("rad"))
def keyway(diameter: Any, width: Any, depth: Any, angle: Any = 0.0) -> tuple[Array, Asymmetry]:
    """What a keyway leaves of a round solid shaft: the diameter (m) of the round section with the same mean
    second moment of area, and the `Asymmetry` to give to a `Shaft` of that diameter.

    `width`, `depth`: m, the depth from the shaft's surface; its middle lies at `angle` (rad) in the shaft.
    Differentiable. Raises `InputError` for a keyway that is not inside the shaft.
    """
    R, w, t = (
        0.5 * jnp.asarray(diameter, float),
        jnp.asarray(width, float),
        jnp.asarray(depth, float),
    )
    h, floor = 0.5 * w, R - t
    numbers = known(jnp.stack([R, h, t]))
    if numbers is not None:
        r, half, deep = map(float, numbers)
        if not (0 < half < r and r - (r**2 - half**2) ** 0.5 < deep < r):
            raise InputError(
                f"a keyway {2e3 * half:g} mm wide and {1e3 * deep:g} mm deep does not go into a shaft of "
                f"{2e3 * r:g} mm: it must be narrower than the shaft, deeper than its own arc and less than "
                "the radius"
            )
    # the slot: |x| < h, from the floor up to the circle; integrals of sqrt(R² - x²) and its powers
    root, arc = jnp.sqrt(R**2 - h**2), jnp.arcsin(h / R)
    one = h * root + R**2 * arc
    cubed = 0.25 * h * root * (5 * R**2 - 2 * h**2) + 0.75 * R**4 * arc
    squared = 0.25 * (h * root * (2 * h**2 - R**2) + R**4 * arc)  # of x² sqrt(R² - x²)
    area = one - 2 * h * floor
    first = (R**2 - floor**2) * h - h**3 / 3
    along = cubed / 3 - 2 * h * floor**3 / 3  # ∫ y²
    across = squared - 2 * h**3 * floor / 3  # ∫ x²
    whole, left = jnp.pi / 4 * R**4, jnp.pi * R**2 - area
    towards_it = whole - along - first**2 / left  # resists bending towards the keyway
    beside = whole - across
    mean = 0.5 * (towards_it + beside)
    ratio = (towards_it - beside) / (towards_it + beside)
    return (64 * mean / jnp.pi) ** 0.25, Asymmetry(ratio, angle)
