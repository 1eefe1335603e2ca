"""Which entries of the state no linear term mixes: such parts have weights of their own."""

import hashlib
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..core.block_matrix import Places, independent
from ..integrators.fitted_weights import Parts
from ..machine.machine import Machine

# States from which on parts pay.
LARGE = 96
# Parts of fewer rows go together; and of the products with the state's weights so much is left at most.
_LEAST, _WORTH = 24, 0.75
# What stands for a number that is zero, where it is asked what another one would mix; SI.
_TINY = 1e-6


def parts_of(A: Float[np.ndarray, "s d d"], exact_rows: int, large: int | None = None) -> Parts:
    """What none of the A mixes, where the state is large (more than so many) and going by parts pays."""
    d = A.shape[1]
    if d > (LARGE if large is None else large):
        rows = independent(A, _LEAST)
        if sum(len(own) ** 2 for own in rows) <= _WORTH * d**2:
            return Parts(rows, exact_rows)
    return Parts.whole(d, exact_rows)


class StateParts(NamedTuple):
    """For machines of one `structure` (another value of a parameter has the same): the `rows` of each."""

    rows: Places
    structure: str

    @classmethod
    def of(cls, machine: Machine, parts: Parts) -> "StateParts | None":
        return None if parts.single else cls(parts.rows, _structure(machine))

    def rows_of(self, machine: Machine) -> Places | None:
        """`None` for a machine of another structure."""
        return self.rows if _structure(machine) == self.structure else None


def _structure(machine: Machine) -> str:
    """Names, options, connections and shapes."""
    leaves, tree = jax.tree.flatten(machine)
    shapes = [jnp.shape(x) for x in leaves]
    return hashlib.sha256(f"{tree}{shapes}".encode()).hexdigest()


def opened(machine: Machine) -> Machine | None:
    """With a tiny number for each that is zero and stands alone (a helix angle, an offset), since another
    value of it may mix what zero does not; `None` where there is none. (Zeros of a matrix say that it mixes
    nothing there.)"""

    def own(x):
        return jnp.full_like(x, _TINY) if _is_zero(x) else x

    return jax.tree.map(own, machine) if any(map(_is_zero, jax.tree.leaves(machine))) else None


def _is_zero(x) -> bool:
    return eqx.is_inexact_array(x) and x.ndim == 0 and float(x) == 0.0
