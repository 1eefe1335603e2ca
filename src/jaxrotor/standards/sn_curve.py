"""The S-N curve: how many cycles of an amplitude a part stands."""

from collections.abc import Iterator
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.errors import InputError
from ..core.parameter import known, parameter
from ..core.part import Part, option


class SNCurve(Part):
    """Cycles to failure over amplitude, by points of a table: a straight line between any two on logarithmic
    scales, and beyond the ends as the last one.

    - `amplitudes`: falling, Pa of shear stress or N·m of torque (`of` says which); `cycles`: rising.
    - `endless`: what is below the last amplitude does no damage (an endurance limit); else the last line goes
      on, which is the safe side.
    - `ultimate`: in the amplitudes' unit; where given, an amplitude about a mean counts as
      `amplitude/(1 - |mean|/ultimate)` (Goodman).

    Raises `InputError` for tables that are not so. Sources: Basquin's line; Goodman's, as in Shigley,
    Mechanical Engineering Design. The numbers are the material's, with the surface, size and notch already in
    them, or in a concentration factor beside.
    """

    amplitudes: Float[Array, " n"] = parameter(positive=True, shapes=((None,),))
    cycles: Float[Array, " n"] = parameter(positive=True, shapes=((None,),))
    ultimate: Float[Array, ""] | None = parameter(positive=True, optional=True, default=None)
    of: Literal["stress", "torque"] = eqx.field(static=True, default="stress")
    endless: bool = option(default=False)

    def __check_init__(self) -> None:
        if problems := list(self.faults()):
            raise InputError(*(f"`SNCurve`: {p}" for p in problems))

    def faults(self) -> Iterator[str]:
        amplitudes, cycles, ultimate = (
            None if x is None else known(x) for x in (self.amplitudes, self.cycles, self.ultimate)
        )
        for name, row, way in (("amplitudes", amplitudes, -1), ("cycles", cycles, 1)):
            if row is None:
                continue
            good = row.dtype.kind in "fiu" and row.ndim == 1 and row.size >= 2
            if not good or not np.all(np.isfinite(row)) or not np.all(row > 0):
                yield f"{name} must be two positive numbers at least, but is {row!r}"
            elif not np.all(way * np.diff(row) > 0):
                yield f"{name} must {'rise' if way > 0 else 'fall'} from point to point, but is {row}"
        if amplitudes is not None and cycles is not None and amplitudes.shape != cycles.shape:
            yield (
                f"amplitudes and cycles must be equally long, but have {amplitudes.size} and "
                f"{cycles.size} entries"
            )
        if ultimate is not None and not (ultimate.ndim == 0 and ultimate > 0):
            yield f"ultimate must be positive, but is {ultimate}"

    @property
    def unit(self) -> str:
        """Of the amplitudes."""
        return "Pa" if self.of == "stress" else "N*m"

    def damage(
        self, amplitude: Float[Array, "..."], mean: Float[Array, "..."] | float = 0.0
    ) -> Float[Array, "..."]:
        """Of one cycle, 1/N: a part of one. Zero amplitude does none; with `ultimate`, a mean beyond it is
        infinite. Differentiable but at the points of the table."""
        amplitude = jnp.abs(amplitude)
        if self.ultimate is not None:
            left = 1 - jnp.abs(mean) / self.ultimate
            amplitude = jnp.where(left > 0, amplitude / jnp.where(left > 0, left, 1.0), jnp.inf)
        some = (amplitude > 0) & jnp.isfinite(amplitude)
        x, y = jnp.log(self.amplitudes[::-1]), jnp.log(self.cycles[::-1])
        at = jnp.log(jnp.where(some, amplitude, 1.0))
        k = jnp.clip(jnp.searchsorted(x, at, side="right") - 1, 0, x.size - 2)
        share = (at - x[k]) / (x[k + 1] - x[k])
        found = jnp.where(some, jnp.exp(-(y[k] + share * (y[k + 1] - y[k]))), 0.0)
        found = jnp.where(jnp.isinf(amplitude), jnp.inf, found)
        if self.endless:
            found = jnp.where(amplitude < self.amplitudes[-1], 0.0, found)
        return jnp.where(jnp.isnan(amplitude), jnp.nan, found)

    def allowed(self, cycles: Float[Array, "..."]) -> Float[Array, "..."]:
        """The amplitude about no mean that so many cycles stand."""
        x, y = jnp.log(self.cycles), jnp.log(self.amplitudes)
        at = jnp.log(jnp.asarray(cycles, float))
        k = jnp.clip(jnp.searchsorted(x, at, side="right") - 1, 0, x.size - 2)
        found = jnp.exp(y[k] + (at - x[k]) / (x[k + 1] - x[k]) * (y[k + 1] - y[k]))
        return jnp.maximum(found, self.amplitudes[-1]) if self.endless else found
