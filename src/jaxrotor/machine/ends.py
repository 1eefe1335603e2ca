"""Does each connector act at as many places as it is given?"""

import jax
import jax.numpy as jnp

from ..errors import InputError
from ..protocol import AbstractElement, Acting, Linear, Stateful
from .wiring import Wiring


def check_ends(connectors: tuple[AbstractElement, ...], wiring: Wiring) -> None:
    """Asks each force law for its shapes, without computing anything."""
    for name, element, ends in zip(wiring.connectors, connectors, wiring.ends):
        acts_at = _acts_at(element, len(ends))
        if acts_at != len(ends):
            raise InputError(
                f"`{name}`: a {type(element).__name__} acts at {acts_at} "
                f"{'station' if acts_at == 1 else 'stations'}, but {len(ends)} are given: name as many"
            )


def _acts_at(element: AbstractElement, given: int) -> int | str:
    if isinstance(element, Linear):
        size = jax.eval_shape(lambda e: e.matrices(), element)[0].shape[0] // 6
        if size != given:
            return size
    if not isinstance(element, Acting):
        return given
    motion = (jnp.zeros(6), jnp.zeros(6))
    state = None
    if isinstance(element, Stateful):
        state = jax.eval_shape(lambda e: e.initial(), element)
    try:
        forces = jax.eval_shape(
            lambda e, m, s: e.forces(jnp.zeros(()), m, s), element, (motion,) * given, state
        )
    except ValueError:  # unpacking another number of motions
        return "another number of"
    return given if forces is None else len(forces)
