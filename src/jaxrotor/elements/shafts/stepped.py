"""A shaft of one section or several, as both shafts with mass take it: its dimensions, and how it is cut."""

from collections.abc import Iterator
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from .segment import Segment

# One number, or one for each section from left to right.
Sections = Float[Array, ""] | Float[Array, " n"]


_DIMENSIONS = ("length", "diameter", "inner_diameter", "end_diameter", "end_inner_diameter")
_LOADS = ("axial_force", "torque")


def by_section(unit: str = "m", **kwargs: Any) -> Any:
    """A field for a dimension, or for a load of another unit."""
    return parameter(unit, shapes=((), (None,)), **kwargs)


def _given(shaft: Any) -> dict[str, Any]:
    """What is given by section."""
    found = {name: getattr(shaft, name, None) for name in (*_DIMENSIONS, *_LOADS)}
    return {name: x for name, x in found.items() if x is not None}


def sections(shaft: Any) -> int:
    """How many sections a shaft's dimensions give."""
    return max(1, *(jnp.size(x) for x in _given(shaft).values()))


def section_faults(shaft: Any) -> Iterator[str]:
    if not isinstance(shaft.elements, int) or shaft.elements < 1:
        yield f"elements must be a whole number, one at least, but is {shaft.elements!r}"
        return
    count = sections(shaft)
    for name, given in _given(shaft).items():
        shape = np.shape(given)
        if shape not in ((), (count,)):
            yield (
                f"what is given for each section must be numbers or equally long lists, but {name} has "
                f"{shape[0]} entries where another has {count}"
            )
            return
    outer = _both_ends(np, shaft.diameter, shaft.end_diameter, count)
    inner = _both_ends(np, shaft.inner_diameter, shaft.end_inner_diameter, count)
    for side, large, small in zip(("left", "right"), outer, inner):
        if np.any(small >= large):
            k = int(np.argmax(small >= large))
            yield (
                f"inner_diameter must be smaller than the diameter, but is {small[k]:g} against "
                f"{large[k]:g} m at the {side} end of section {k + 1}"
            )
            return


def _both_ends(xp: Any, left: Any, right: Any, count: int) -> tuple[Any, Any]:
    """Of each section, where its diameter starts and where it ends; it tapers where both are given."""
    return xp.broadcast_to(left, (count,)), xp.broadcast_to(
        left if right is None else right, (count,)
    )


def by_piece(x: Any, count: int, pieces: int) -> Array:
    """One value for each section, or one for all, repeated for each piece of it."""
    return jnp.repeat(jnp.broadcast_to(x, (count,)), pieces)


def cut(
    shaft: Any, pieces: int, shear: bool, rotary_inertia: bool, gyroscopic: bool | None = None
) -> Segment:
    """Each section cut into equal pieces: segments stacked on the last axis."""
    count = sections(shaft)
    n = count * pieces
    left = jnp.tile(jnp.arange(pieces) / pieces, count)

    def across(start: Any, end: Any) -> Array:
        start, end = (jnp.repeat(x, pieces) for x in _both_ends(jnp, start, end, count))
        return jnp.stack([start + (end - start) * s for s in (left, left + 1 / pieces)])

    m = shaft.material
    E, G, rho = (jnp.broadcast_to(x, (n,)) for x in (m.youngs_modulus, m.shear_modulus, m.density))
    return Segment(
        by_piece(shaft.length, count, pieces) / pieces,
        across(shaft.diameter, shaft.end_diameter),
        across(shaft.inner_diameter, shaft.end_inner_diameter),
        *(E, G, rho),
        shear,
        rotary_inertia,
        rotary_inertia if gyroscopic is None else gyroscopic,
    )
