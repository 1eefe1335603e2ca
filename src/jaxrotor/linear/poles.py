"""Responses at a pole: of a free spin at rest, of an undamped mode at its own frequency."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from .linearise import LinearModel, driven_back

# An eigenvalue within this part of a frequency is met by it: less than a person's damping, more than
# rounding.
_MET = 1e-9
# Of the distance to the next eigenvalue, the circle round the frequency; 0.1^16 is rounding.
_CIRCLE, _NODES = 0.1, 16
# Of the response on the circle, what a pole within it may have by rounding.
_NO_POLE = 1e-9


class Poles(NamedTuple):
    """Eigenvalues, and which of them are the rounding of a free motion's zeros."""

    values: Complex[Array, " d"]
    free: Bool[Array, " d"]


def poles_of(model: LinearModel) -> Poles:
    """Without derivatives."""
    A, M = jax.lax.stop_gradient((model.A, model.M))
    values, vectors = jnp.linalg.eig(A)
    free = ~driven_back(A, M, vectors) & (jnp.max(jnp.abs(vectors[: len(M)]), axis=0) > 0)
    return Poles(values, free)


def beside_poles(response, poles: Poles, w: Float[Array, ""]) -> Complex[Array, "..."]:
    """`response(s)`, any shape, at s = i w; where an eigenvalue is, what is left without it, which is the
    mean over a circle round it, and inf where the pole is in the response."""
    here = jax.lax.complex(jnp.zeros_like(w), w)
    away = jnp.abs(jnp.where(poles.free, 0.0, poles.values) - here)
    met = away <= _MET * jnp.abs(w)

    def aside():
        radius = _CIRCLE * jnp.min(jnp.where(met, jnp.inf, away))
        radius = jnp.where(jnp.isfinite(radius), radius, 1.0)
        turns = jnp.exp(2j * np.pi * (np.arange(_NODES) + 0.5) / _NODES)
        # one after the other: batched LAPACK calls side by side can deadlock (docs/solving.md)
        values = jax.lax.map(lambda turn: response(here + radius * turn), turns)
        shape = (-1, *(1,) * (values.ndim - 1))
        once, twice = (jnp.mean(values * turns.reshape(shape) ** k, axis=0) for k in (1, 2))
        pole = jnp.maximum(jnp.abs(once), jnp.abs(twice)) > _NO_POLE * jnp.max(
            jnp.abs(values), axis=0
        )
        return jnp.where(pole, jnp.inf, jnp.mean(values, axis=0))

    return jax.lax.cond(jnp.any(met), aside, lambda: response(here))


def nearly_unbounded(A: Array, w: Array, x: Array, b: Array) -> Bool[Array, ""]:
    """Whether in some row of `(i w - A) x = b` parts cancel each other that are so much larger than the
    force that an eigenvalue may be met: a quick look, before `poles_of`."""
    parts = jnp.abs(A) @ jnp.abs(x) + jnp.abs(w) * jnp.abs(x)
    # what is less than this part of the largest force is rounding, or hides behind its coupling
    forced = jnp.abs(b) > 1e-7 * jnp.max(jnp.abs(b))
    share = jnp.where(forced, jnp.abs(b) / jnp.where(forced, parts, 1.0), 1.0)
    return jax.lax.stop_gradient(~(jnp.min(share) > 10 * _MET))
