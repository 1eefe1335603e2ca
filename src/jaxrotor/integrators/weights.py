"""Weights of the exponential methods: constant matrices, computed once a solve."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .phi import balance, phi_functions

Matrix = Float[Array, "d d"]


# Instants of the stages of ETD4RK, as parts of the step; the last row of the weights is the result.
STAGES = np.array([0.0, 0.5, 0.5, 1.0])


def runge_kutta_weights(
    A: Matrix, h: Float[Array, ""], exact_rows: int = 0
) -> Float[Array, "5 d d4m"]:
    """Krogstad's ETD4RK for steps of length h: row i makes stage i from (y, N_1, ..., N_4), and the
    last row the new y. N is zero in the first `exact_rows`, whose columns are left out (m of d stay).
    One product a stage, the same for all, so that a scan compiles N once.

    Source: Krogstad, J. Comput. Phys. 203 (2005) 72, eq. (51). (Cox and Matthews' own ETDRK4 falls to
    first order on these machines: its last stages mix half and full steps.)
    """
    d = balance(A)
    (h0, h1, h2, _), (f0, f1, f2, f3) = phi_functions(h * A * d[None, :] / d[:, None], 3) * (
        d[:, None] / d[None, :]
    )
    eye, none = jnp.eye(A.shape[0]), jnp.zeros_like(A)
    half, full = h0 + eye, f0 + eye
    h1, h2, f1, f2, f3 = h * h1 / 2, h * h2, h * f1, h * f2, h * f3
    rows = [
        [eye, none, none, none, none],
        [half, h1, none, none, none],
        [half, h1 - h2, h2, none, none],
        [full, f1 - 2 * f2, none, 2 * f2, none],
        [full, f1 - 3 * f2 + 4 * f3, 2 * f2 - 4 * f3, 2 * f2 - 4 * f3, 4 * f3 - f2],
    ]
    kept = [[row[0], *(block[:, exact_rows:] for block in row[1:])] for row in rows]
    return jnp.stack([jnp.concatenate(row, axis=1) for row in kept])


class AdamsWeights(eqx.Module):
    """`predict` acts on (y, N_n, ..., N_{n-k+1}); `correct` on what the evaluation at the predicted
    point adds to the extrapolated polynomial."""

    predict: Float[Array, "d dkm"]
    correct: Float[Array, "d m"]


def extrapolation(k: int) -> np.ndarray:
    """Value at s = 1 of the polynomial through s = 0, -1, ..., 1-k: its weights."""
    return np.array(
        [(-1) ** j * np.prod([(k - i) / (i + 1) for i in range(j + 1)]) for j in range(k)]
    )


def adams_weights(A: Matrix, h: Float[Array, ""], k: int, exact_rows: int = 0) -> AdamsWeights:
    """The polynomial through the past k values of N, integrated exactly with exp(hA).

    `∫_0^1 e^((1-s) hA) s^m ds = m! phi_{m+1}(hA)`. Source: Hochbruck & Ostermann, BIT 51 (2011) 889,
    exponential Adams methods; the corrector, by our own derivation, adds the point n+1.
    """
    d = balance(A)
    _, phi = phi_functions(h * A * d[None, :] / d[:, None], k + 1)
    phi = phi * (d[:, None] / d[None, :])
    moments = h * np.cumprod([1, *range(1, k + 1)]).reshape(-1, 1, 1) * phi[1:]  # of s^m, m <= k

    nodes = -np.arange(k, dtype=float)
    lagrange = np.linalg.inv(np.vander(nodes, k, increasing=True))  # columns: basis polynomials
    weights = jnp.einsum("mj,mab->jab", lagrange, moments[:k])
    # the polynomial that vanishes at the past nodes and is one at s = 1
    omega = np.poly(nodes)[::-1]
    correct = jnp.einsum("m,mab->ab", omega / omega.sum(), moments)
    first = phi[0] + jnp.eye(A.shape[0])
    past = [w[:, exact_rows:] for w in weights]
    return AdamsWeights(jnp.concatenate([first, *past], axis=1), correct[:, exact_rows:])
