"""What a field of a part says of itself where it stands: the unit of its numbers, and its default.

A schedule has the unit of what it drives, a law that acts along a line is in m and N, a motion of a
displacement in m. Studies are read and written by this, parts are shown by it.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax import Array

from .parameter import known, straight_unit


@dataclasses.dataclass(frozen=True)
class Within:
    """Where a part stands. `driven`: unit of what a schedule gives. `length`: motions are in m where a
    displacement is prescribed, not in rad. `straight`: laws are in m and N where they act along a line, not
    in rad and N·m."""

    driven: str = ""
    length: bool = False
    straight: bool = False

    def unit(self, field: dataclasses.Field) -> str:
        """Of a parameter there; empty for a pure number."""
        unit = field.metadata["unit"] or "*".join(
            part for part in (self.driven, field.metadata.get("times", "")) if part
        )
        if self.straight:
            return straight_unit(unit)
        return unit.replace("rad", "m") if self.length else unit

    def units(self, field: dataclasses.Field) -> tuple[str, ...]:
        """One, or one for each entry where they differ."""
        return field.metadata.get("units", ()) or (self.unit(field),)

    def below(self, field: dataclasses.Field) -> "Within":
        """For the parts that this field holds."""
        straight = self.straight or field.metadata.get("straight", False)
        return Within(field.metadata.get("drives", ""), self.length, straight)


ALONE = Within()  # a part by itself


def same(a: Any, b: Any) -> bool:
    """Whether two values (parts, numbers, options) are equal to the last bit; never where one is traced."""
    if isinstance(a, (eqx.Module, Array, np.ndarray)) or isinstance(
        b, (eqx.Module, Array, np.ndarray)
    ):
        one, other = jax.tree.flatten(a), jax.tree.flatten(b)
        return one[1] == other[1] and all(map(_same_numbers, one[0], other[0]))
    return type(a) is type(b) and bool(a == b)


def _same_numbers(a: Any, b: Any) -> bool:
    if isinstance(a, jax.ShapeDtypeStruct) or isinstance(b, jax.ShapeDtypeStruct):
        return False
    a, b = known(a), known(b)
    return a is not None and b is not None and np.array_equal(a, b)


def default_of(field: dataclasses.Field) -> Any:
    """What a field is where it is not given, as it is kept; `MISSING` where it must be given."""
    given = field.default
    if given is dataclasses.MISSING and field.default_factory is not dataclasses.MISSING:
        given = field.default_factory()
    convert = field.metadata.get("converter")
    return given if given is dataclasses.MISSING or convert is None else convert(given)


def is_default(field: dataclasses.Field, value: Any) -> bool:
    default = default_of(field)
    return default is not dataclasses.MISSING and same(value, default)
