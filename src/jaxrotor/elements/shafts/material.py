"""What shafts are made of."""

from typing import Any, ClassVar

import equinox as eqx
from jaxtyping import Array, Float

from ...core.arguments import positive, text
from ...core.errors import InputError
from ...core.gate import takes
from ...core.parameter import parameter, problems
from ...core.part import Part
from .material_tables import NAMES
from .named_material import ROOM, NamedMaterial


class Material(Part):
    """An isotropic elastic material; SI. Plain floats may be given: elements convert them."""

    youngs_modulus: Float[Array, ""] | float = eqx.field(metadata={"quantity": "Pa"})
    shear_modulus: Float[Array, ""] | float = eqx.field(metadata={"quantity": "Pa"})
    density: Float[Array, ""] | float = eqx.field(metadata={"quantity": "kg/m^3"})

    @classmethod
    @takes(name=text, temperature=positive("K"))
    def named(cls, name: str, temperature: Any = ROOM) -> NamedMaterial:
        """A metal of the tables, "42CrMo4", "S355", "inconel 718", at a temperature (K, 20 °C unless it is
        given): see `NamedMaterial`. Raises `InputError` for a name that is not known, with all that are, and
        for a temperature beyond its table."""
        found = NamedMaterial(name, temperature)
        for fault in problems(found, f"Material.named({name!r})"):
            raise InputError(fault)
        return found


# The paper gives no figures: these are ours.
STEEL = Material(youngs_modulus=2.1e11, shear_modulus=8.1e10, density=7850.0)


class ShaftMaterial(eqx.Module):
    """A material inside an element: its figures are parameters."""

    youngs_modulus: Float[Array, ""] = parameter("Pa", positive=True)
    shear_modulus: Float[Array, ""] = parameter("Pa", positive=True)
    density: Float[Array, ""] = parameter("kg/m^3", positive=True)

    shown_as: ClassVar[str] = "Material"


# What a shaft may be made of.
AnyMaterial = ShaftMaterial | NamedMaterial


def as_parameters(material: Any) -> Any:
    if isinstance(material, Material):
        m: Any = material
        return ShaftMaterial(m.youngs_modulus, m.shear_modulus, m.density)
    return material


def steel() -> Any:
    """A field for what a shaft is made of: steel, unless something else is given."""
    made_by = ["STEEL", "Material", "Material.named"]
    metadata = dict(made_by=made_by, named=NAMES, by_name=NamedMaterial)
    return eqx.field(converter=as_parameters, default=STEEL, metadata=metadata)


def undamped() -> Any:
    """A field for `(alpha, beta)` of Rayleigh damping `alpha M + beta K`: none, unless it is given."""
    return parameter(nonnegative=True, shapes=((2,),), default=(0.0, 0.0), units=("1/s", "s"))
