"""A metal by its name, at its temperature."""

from collections.abc import Iterator
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import nearest, short
from ...core.errors import InputError
from ...core.parameter import parameter
from ...core.part import Part, option
from ...profiles.monotone import interpolate
from .material_tables import NAMES, TABLES, ZERO, Table, found

ROOM = 20 + ZERO


def _known_name(value: Any, place: str) -> str:
    if isinstance(value, str) and found(value) is not None:
        return value
    guess = nearest(value.lower(), NAMES) if isinstance(value, str) else ""
    raise InputError(
        f"{place} must be a metal of the tables, but is {short(value)}{guess or ':'} known are "
        f"{', '.join(TABLES)}, and grades of them such as 42CrMo4"
    )


class NamedMaterial(Part):
    """An isotropic metal whose figures come from published tables, at a temperature.

    **Arguments:**

    - `name`: a family, "carbon steel", "low-alloy steel", "austenitic steel", "inconel 718", "titanium
      6al-4v", "aluminium 6061", or a grade of one: "42CrMo4", "AISI 4340", "S355", "X5CrNi18-10", ...
    - `temperature`: K, 20 °C unless it is given: of all of the shaft. Within the table's range.

    `youngs_modulus` is drawn through the table (monotone cubic), the shear modulus is `E/(2 (1 + nu))` with a
    constant `poissons_ratio`, the density that of 20 °C over `growth` cubed. So a shaft's dimensions are
    those at the temperature: of a cold drawing's multiply lengths and diameters by `growth`, else the shaft
    is lighter by its cube (1 % at 250 °C for steel). All are differentiable by the temperature. `source`
    says whose figures they are: typical ones; what is asked of a supplied shaft is measured on it. In a
    study: `material = "42CrMo4"`, or `material = { name = "42CrMo4", temperature = "350 degC" }`.
    """

    name: str = option(_known_name)
    temperature: Float[Array, ""] = parameter("K", positive=True, default=ROOM)

    shown_as: ClassVar[str] = "Material.named"

    def faults(self) -> Iterator[str]:
        low, high = self.range
        at = float(self.temperature)
        if not low <= at <= high:
            yield (
                f"the temperature of {self.name} must lie between {low:g} and {high:g} K "
                f"({low - ZERO:.0f} to {high - ZERO:.0f} °C), but is {at:g} K"
            )

    @property
    def _table(self) -> Table:
        key = found(self.name)
        assert key is not None, "checked when it was made"
        return TABLES[key]

    @property
    def range(self) -> tuple[float, float]:
        """K."""
        return self._table.temperatures[0], self._table.temperatures[-1]

    @property
    def source(self) -> str:
        return self._table.source

    @property
    def youngs_modulus(self) -> Float[Array, ""]:
        """Pa."""
        table = self._table
        x, y = (jnp.asarray(v, float) for v in (table.temperatures, table.moduli))
        return 1e9 * interpolate(x, y, jnp.asarray(self.temperature))

    @property
    def poissons_ratio(self) -> float:
        return self._table.poisson

    @property
    def shear_modulus(self) -> Float[Array, ""]:
        """Pa."""
        return self.youngs_modulus / (2 * (1 + self._table.poisson))

    @property
    def expansion(self) -> Float[Array, ""]:
        """1/K, the mean from 20 °C."""
        table = self._table
        x, y = (jnp.asarray(v, float) for v in (table.expansion_temperatures, table.expansion))
        return 1e-6 * interpolate(x, y, jnp.asarray(self.temperature))

    @property
    def growth(self) -> Float[Array, ""]:
        """By what a length of 20 °C is longer: `1 + expansion (T - 20 °C)`."""
        return 1 + self.expansion * (jnp.asarray(self.temperature) - ROOM)

    @property
    def density(self) -> Float[Array, ""]:
        """kg/m³."""
        return self._table.density / self.growth**3
