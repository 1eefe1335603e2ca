"""Eigenvalues and eigenvectors of a real matrix, with derivatives where values coincide."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.threads import one_thread

# Eigenvalues closer than this part of the larger one count as one (a symmetric machine's two planes).
_TOGETHER = 1e-7
# Left and right eigenvectors at right angles but for this part belong to a defective eigenvalue.
_DEFECTIVE = 1e-7


@jax.custom_jvp
def eigensystem(
    A: Float[Array, "d d"],
) -> tuple[Complex[Array, " d"], Complex[Array, "d d"], Complex[Array, "d d"]]:
    """Eigenvalues, right eigenvectors (columns) and left ones (rows): `left @ A @ right` is diagonal
    and `left @ right` the identity, but for defective eigenvalues (a free spin's double zero), which get
    no left eigenvectors and no derivative.

    Derivatives: of a simple eigenvalue `l' A' r`. Where several coincide, as the two planes of an
    isotropic machine do, the single ones have no linear derivative (a change that breaks the symmetry
    splits them like a square root of a square): each gets their mean's, which is smooth. Their split along
    one given change is `split_derivatives`. Source: Lancaster, Numer. Math. 6 (1964) 377; Friswell, J.
    Vib. Acoust. 118 (1996) 390.
    """
    return _eigensystem(A, jnp)


@one_thread
def eigensystem_numbers(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`eigensystem`, where no derivative is asked."""
    values, right, left = (x.astype(complex) for x in _eigensystem(A, np))
    return values, right, left


def _eigensystem(A: Any, xp: Any) -> tuple[Any, Any, Any]:
    values, right = xp.linalg.eig(A)
    # not the inverse of `right`: a free spin is a defective double zero, which would spoil all of it
    left = xp.linalg.eig(A.T)[1].T
    return values, right, xp.linalg.pinv(left @ right, _DEFECTIVE) @ left


@eigensystem.defjvp
def _eigensystem_jvp(primals, tangents):
    (A,), (dA,) = primals, tangents
    values, right, left = eigensystem(A)
    B = left @ dA.astype(right.dtype) @ right
    gap = values[None, :] - values[:, None]
    together = _together(values)
    weight = together / jnp.sum(together, axis=1, keepdims=True)
    d_values = weight @ jnp.diagonal(B)
    F = jnp.where(together > 0, 0.0, 1.0 / jnp.where(together > 0, 1.0, gap))
    d_right = right @ (F * B)
    d_left = -(F * B) @ left
    return (values, right, left), (d_values, d_right, d_left)


def _together(values: Complex[Array, " d"]) -> Float[Array, "d d"]:
    """1 where two eigenvalues count as one."""
    size = jnp.maximum(jnp.abs(values)[:, None], jnp.abs(values)[None, :])
    return (jnp.abs(values[:, None] - values[None, :]) <= _TOGETHER * size + 1e-12).astype(float)


def split_derivatives(
    A: Float[Array, "d d"], dA: Float[Array, "d d"], which: int
) -> Complex[Array, " k"]:
    """How the eigenvalues that coincide with number `which` part along the change `dA`: the eigenvalues
    of dA within their subspace. Not under `jit`: how many there are depends on the values."""
    values, right, left = eigensystem(A)
    members = jnp.flatnonzero(_together(values)[which])
    return jnp.linalg.eigvals(left[members] @ dA.astype(right.dtype) @ right[:, members])
