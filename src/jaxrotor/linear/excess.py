"""What turns with the shaft, told from the vector field itself: the field of the machine as it is, less that
of the balanced one."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array

from ..machine.field import relative_field
from .observe import Output, observe


def excess(
    pair: Any, outputs: tuple[Output, ...], y: Array, reference: Any, held: Any
) -> tuple[Array, Array]:
    """Of the rates (d,) and of the outputs, (m,), in a state of the balanced machine. `pair`: (machine, its
    system) as it is and balanced."""
    zero = jnp.zeros(())

    def seen(machine, system):
        if not outputs:
            return jnp.zeros(0)
        return observe(machine, outputs, system, y, reference)

    (_, actual), (_, nominal) = pair
    rates = [relative_field(zero, y, system, reference, held) for system in (actual, nominal)]
    first, second = (seen(*one) for one in pair)
    return rates[0] - rates[1], first - second
