"""Mass and inertias of a cylinder, solid or bored."""

import warnings
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import number, positive
from ...core.errors import InputError
from ...core.parameter import known

_PLACE = "Rotor.from_dimensions"
# A weighed mass may be off by so much before it is told: holes, keyways and rims are no cylinder either.
_WORTH_TELLING = 0.03


def cylinder(
    diameter: Any, length: Any, material: Any, bore: Any, mass: Any
) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]:
    """Mass (kg), polar and transverse inertia (kg·m²) about the centre; arguments as for
    `Rotor.from_dimensions`."""
    diameter = positive("m")(diameter, f"{_PLACE}: diameter")
    length = positive("m")(length, f"{_PLACE}: length")
    bore = number("m", least=0.0)(bore, f"{_PLACE}: bore")
    density = getattr(material, "density", material)
    density = positive("kg/m^3")(density, f"{_PLACE}: material (a Material, or a density)")
    outer, inner = known(diameter), known(bore)
    if outer is not None and inner is not None and not inner < outer:
        raise InputError(
            f"{_PLACE}: bore must be less than the diameter, {outer:g} m, but is {inner:g} m"
        )
    D, d, long = (jnp.asarray(x, float) for x in (diameter, bore, length))
    weight = density * jnp.pi / 4 * (D**2 - d**2) * long
    if mass is not None:
        mass = positive("kg")(mass, f"{_PLACE}: mass")
        _compare(mass, weight)
        weight = jnp.asarray(mass, float)
    squares = D**2 + d**2
    return weight, weight * squares / 8, weight * (squares / 16 + long**2 / 12)


def _compare(mass: Any, computed: Array) -> None:
    """A word where a weighed mass is not what dimensions and density make; traced numbers pass."""
    weighed, made = known(mass), known(computed)
    if weighed is None or made is None:
        return
    off = float(weighed / made - 1)
    if abs(off) > _WORTH_TELLING:
        warnings.warn(
            f"{_PLACE}: the given mass, {float(weighed):g} kg, is off by {100 * off:+.0f} % from the "
            f"{float(made):g} kg that dimensions and density make: the inertias are those of the cylinder "
            "with the given mass; leave the mass out, or correct the dimensions",
            stacklevel=4,
        )
