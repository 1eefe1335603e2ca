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


def by_section(**kwargs: Any) -> Any:
    """A field for a dimension in m."""
    return parameter("m", shapes=((), (None,)), **kwargs)


def sections(shaft: Any) -> int:
    """How many sections a shaft's dimensions give."""
    given = (shaft.length, shaft.diameter, shaft.inner_diameter, shaft.end_diameter)
    return max(1, *(jnp.size(x) for x in given if x is not None))


def section_faults(shaft: Any) -> Iterator[str]:
    if not isinstance(shaft.elements, int) or shaft.elements < 1:
        yield f"elements must be a whole number, one at least, but is {shaft.elements!r}"
        return
    count = sections(shaft)
    given = {
        name: np.shape(getattr(shaft, name))
        for name in ("length", "diameter", "inner_diameter", "end_diameter")
        if getattr(shaft, name) is not None
    }
    for name, shape in given.items():
        if shape not in ((), (count,)):
            yield (
                "length, diameter, inner_diameter and end_diameter must be numbers or equally long "
                f"lists, but {name} has {shape[0]} entries where another has {count}"
            )
            return
    end = shaft.diameter if shaft.end_diameter is None else shaft.end_diameter
    outer = np.minimum(np.broadcast_to(shaft.diameter, count), np.broadcast_to(end, count))
    inner = np.broadcast_to(shaft.inner_diameter, count)
    if np.any(inner >= outer):
        k = int(np.argmax(inner >= outer))
        yield (
            f"inner_diameter must be smaller than the diameter, but is {inner[k]:g} against "
            f"{outer[k]:g} m"
        )


def cut(shaft: Any, pieces: int, shear: bool, rotary_inertia: bool) -> Segment:
    """Each section cut into equal pieces: segments stacked on the last axis."""
    count = sections(shaft)

    def per_piece(x: Any) -> Array:
        return jnp.repeat(jnp.broadcast_to(x, (count,)), pieces)

    n = count * pieces
    left = jnp.tile(jnp.arange(pieces) / pieces, count)
    start = per_piece(shaft.diameter)
    end = start if shaft.end_diameter is None else per_piece(shaft.end_diameter)
    diameters = jnp.stack([start + (end - start) * s for s in (left, left + 1 / pieces)])
    inside = jnp.broadcast_to(per_piece(shaft.inner_diameter), (2, n))
    m = shaft.material
    E, G, rho = (jnp.broadcast_to(x, (n,)) for x in (m.youngs_modulus, m.shear_modulus, m.density))
    return Segment(
        per_piece(shaft.length) / pieces, diameters, inside, E, G, rho, shear, rotary_inertia
    )
