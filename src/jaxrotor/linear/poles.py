"""Responses at a pole: of a free spin at rest, of an undamped mode at its own frequency."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float

from .linearise import driven_back

# An eigenvalue within this part of a frequency is met by it: less than a person's damping, more than
# rounding.
_MET = 1e-9
# Of the distance to the next eigenvalue, the circle round the frequency; 0.1^16 is rounding.
_CIRCLE, _NODES = 0.1, 16
_TURNS = np.exp(2j * np.pi * (np.arange(_NODES) + 0.5) / _NODES)
# Of the response on the circle, what a pole within it may have by rounding.
_NO_POLE = 1e-9


class Poles(NamedTuple):
    """Eigenvalues, and which of them are the rounding of a free motion's zeros."""

    values: Complex[Array, " d"]
    free: Bool[Array, " d"]


def poles_of(A: Any, M: Any) -> Poles:
    """Without derivatives; of NumPy's or JAX's arrays."""
    xp: Any = np if isinstance(A, np.ndarray) else jnp
    if xp is jnp:
        A, M = jax.lax.stop_gradient((A, M))
    values, vectors = xp.linalg.eig(A)
    free = ~driven_back(A, M, vectors) & (abs(vectors[: len(M)]).max(axis=0) > 0)
    return Poles(values, free)


def beside_poles(response, poles: Poles, w: Float[Array, ""]) -> Complex[Array, "..."]:
    """`response(s)`, any shape, at s = i w; where an eigenvalue is, what is left without it, which is the
    mean over a circle round it, and inf where the pole is in the response."""
    here = jax.lax.complex(jnp.zeros_like(w), w)
    away, met = _met(poles, w, jnp)

    def aside():
        # one after the other: batched LAPACK calls side by side can deadlock (docs/solving.md)
        radius = _radius(away, met, jnp)
        return _without(jax.lax.map(lambda turn: response(here + radius * turn), _TURNS), jnp)

    return jax.lax.cond(jnp.any(met), aside, lambda: response(here))


def beside_poles_numbers(response, poles: Poles, w: float) -> np.ndarray:
    """`beside_poles` of NumPy's arrays."""
    away, met = _met(poles, w, np)
    if not met.any():
        return response(1j * w)
    radius = _radius(away, met, np)
    return _without(np.stack([response(1j * w + radius * turn) for turn in _TURNS]), np)


def _met(poles: Poles, w: Any, xp: Any) -> tuple[Any, Any]:
    """How far each eigenvalue is away, and whether it is met."""
    away = abs(xp.where(poles.free, 0.0, poles.values) - 1j * w)
    return away, away <= _MET * abs(w)


def _radius(away: Any, met: Any, xp: Any) -> Any:
    radius = _CIRCLE * xp.min(xp.where(met, xp.inf, away))
    return xp.where(xp.isfinite(radius), radius, 1.0)


def _without(values: Any, xp: Any) -> Any:
    """Of the values on the circle, what is left without the poles inside."""
    shape = (-1, *(1,) * (values.ndim - 1))
    once, twice = (xp.mean(values * _TURNS.reshape(shape) ** k, axis=0) for k in (1, 2))
    pole = xp.maximum(abs(once), abs(twice)) > _NO_POLE * abs(values).max(axis=0)
    return xp.where(pole, xp.inf, xp.mean(values, axis=0))


def nearly_unbounded(A: Array, w: Array, x: Array, b: Array) -> Bool[Array, ""]:
    """Whether in some row of `(i w - A) x = b` parts cancel each other that are so much larger than the
    force that an eigenvalue may be met: a quick look, before `poles_of`."""
    parts = jnp.abs(A) @ jnp.abs(x) + jnp.abs(w) * jnp.abs(x)
    # what is less than this part of the largest force is rounding, or hides behind its coupling
    forced = jnp.abs(b) > 1e-7 * jnp.max(jnp.abs(b))
    share = jnp.where(forced, jnp.abs(b) / jnp.where(forced, parts, 1.0), 1.0)
    return jax.lax.stop_gradient(~(jnp.min(share) > 10 * _MET))
