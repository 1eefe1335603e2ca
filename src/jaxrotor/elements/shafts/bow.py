"""Shaft sections that are not straight when nothing loads them."""

from collections.abc import Iterator

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from .defect import AbstractShaftDefect, Bend, Section, towards


class Bow(AbstractShaftDefect):
    """The unloaded section is an arc: with both ends on the axis its middle lies `sagitta` (m) off, towards
    `angle` (rad, in the shaft, from its x axis).

    Sections of one long arc have sagittas as the squares of their lengths: half of a shaft, a quarter of
    its bow. The residual bow of a rotor that was left hot and standing: vibration at once per turn, there
    at the slowest roll too. Source: Nicholas, Gunter & Allaire, J. Eng. Power 98 (1976) 171.
    """

    sagitta: Float[Array, ""] = parameter("m", nonnegative=True)
    angle: Float[Array, ""] = parameter("rad", default=0.0)

    def shape(self, section: Section) -> Bend | None:
        # 4 h s (1 - s): the slope falls by 8 h/L from end to end
        c, s = jnp.cos(self.angle), jnp.sin(self.angle)
        zero = jnp.zeros_like(c)
        return -8 * self.sagitta / section.length * jnp.stack([c, s, zero, zero])


class Kink(AbstractShaftDefect):
    """The unloaded section is bent at one point: from `position` (0 to 1 along it) on, it leans by `bend`
    (rad) towards `angle` (rad, in the shaft, from its x axis). Source: as for `Bow`."""

    bend: Float[Array, ""] = parameter("rad", nonnegative=True)
    position: Float[Array, ""] = parameter(nonnegative=True, default=0.5)
    angle: Float[Array, ""] = parameter("rad", default=0.0)

    def faults(self) -> Iterator[str]:
        if float(self.position) > 1:
            yield (
                f"position must lie between 0 and 1 along the section, but is {float(self.position):g}"
            )

    def shape(self, section: Section) -> Bend | None:
        return self.bend * towards(self.position, self.angle)
