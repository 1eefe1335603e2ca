"""What shafts are made of."""

from typing import Any, ClassVar

import equinox as eqx
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.part import Part


class Material(Part):
    """An isotropic elastic material; SI. Plain floats may be given: elements convert them."""

    youngs_modulus: Float[Array, ""] | float = eqx.field(metadata={"quantity": "Pa"})
    shear_modulus: Float[Array, ""] | float = eqx.field(metadata={"quantity": "Pa"})
    density: Float[Array, ""] | float = eqx.field(metadata={"quantity": "kg/m^3"})


# The paper gives no figures: these are ours.
STEEL = Material(youngs_modulus=2.1e11, shear_modulus=8.1e10, density=7850.0)


class ShaftMaterial(eqx.Module):
    """A material inside an element: its figures are parameters."""

    youngs_modulus: Float[Array, ""] = parameter("Pa", positive=True)
    shear_modulus: Float[Array, ""] = parameter("Pa", positive=True)
    density: Float[Array, ""] = parameter("kg/m^3", positive=True)

    shown_as: ClassVar[str] = "Material"


def as_parameters(material: Any) -> Any:
    if isinstance(material, Material):
        m: Any = material
        return ShaftMaterial(m.youngs_modulus, m.shear_modulus, m.density)
    return material


def steel() -> Any:
    """A field for what a shaft is made of: steel, unless something else is given."""
    return eqx.field(
        converter=as_parameters, default=STEEL, metadata=dict(made_by=["STEEL", "Material"])
    )


def undamped() -> Any:
    """A field for `(alpha, beta)` of Rayleigh damping `alpha M + beta K`: none, unless it is given."""
    return parameter(nonnegative=True, shapes=((2,),), default=(0.0, 0.0), units=("1/s", "s"))
