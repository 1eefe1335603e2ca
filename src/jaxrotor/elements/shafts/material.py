"""What shafts are made of."""

from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.part import Part


class Material(Part):
    """An isotropic elastic material; SI. Plain floats may be given: elements convert them."""

    youngs_modulus: Float[Array, ""] | float
    shear_modulus: Float[Array, ""] | float
    density: Float[Array, ""] | float


# The paper gives no figures: these are ours.
STEEL = Material(youngs_modulus=2.1e11, shear_modulus=8.1e10, density=7850.0)


class ShaftMaterial(eqx.Module):
    """A material inside an element: its figures are parameters."""

    youngs_modulus: Float[Array, ""] = parameter("Pa", positive=True)
    shear_modulus: Float[Array, ""] = parameter("Pa", positive=True)
    density: Float[Array, ""] = parameter("kg/m^3", positive=True)


def as_parameters(material: Any) -> Any:
    if isinstance(material, Material):
        m: Any = material
        return ShaftMaterial(m.youngs_modulus, m.shear_modulus, m.density)
    return material
