"""The functions `phi_0 = exp, phi_k(z) = ∫_0^1 e^((1-s) z) s^(k-1)/(k-1)! ds` of a matrix.

By scaling and doubling: a Taylor series where the matrix is small, then
`phi_k(2z) = 2^-k [phi_0(z) phi_k(z) + Σ_j phi_j(z)/(k-j)!]`. The exponential itself is carried as
`phi_0 - 1`, whose doubling `F(2z) = 2F + F²` keeps the slow modes' digits, where squaring `phi_0`
would lose one bit each time (and 24 doublings are common here). Everything is differentiable.

Source: Skaflestad & Wright, Appl. Numer. Math. 59 (2009) 783, eq. (2.13).
"""

from math import factorial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

# Enough for norms up to 2^40; what is not needed is masked, so that the count may vary in a batch.
MAX_DOUBLINGS = 40
_TAYLOR_TERMS = 14


def balance(A: Float[Array, "d d"]) -> Float[Array, " d"]:
    """A diagonal D (powers of two) for which `D⁻¹ A D` has rows and columns of like norm.

    The state mixes metres, radians per second and more: unbalanced, the norm that counts the
    doublings is far larger than the eigenvalues.
    """
    A = jnp.abs(jax.lax.stop_gradient(A))
    A = A - jnp.diag(jnp.diag(A))

    def sweep(_, d):
        scaled = A * d[None, :] / d[:, None]
        rows, columns = scaled.sum(1), scaled.sum(0)
        both = (rows > 0) & (columns > 0)
        ratio = jnp.where(both, rows / jnp.where(both, columns, 1.0), 1.0)
        # half the step that would even one row out: all rows move at once
        return d * 2.0 ** jnp.round(0.25 * jnp.log2(jnp.clip(ratio, 1e-30, 1e30)))

    return jax.lax.fori_loop(0, 30, sweep, jnp.ones(A.shape[0]))


def _double(phi: Float[Array, "p d d"]) -> Float[Array, "p d d"]:
    """`(phi_0 - 1, phi_1, ...)` of 2z from those of z."""
    count = phi.shape[0]
    product = phi[0] @ phi  # (p, d, d): one batched product
    out = [2 * phi[0] + product[0]]
    for k in range(1, count):
        rest = phi[k] + sum(phi[j] / float(factorial(k - j)) for j in range(1, k + 1))
        out.append((product[k] + rest) / 2**k)
    return jnp.stack(out)


def phi_functions(z: Float[Array, "d d"], count: int) -> Float[Array, "p d d"]:
    """`phi_0 - 1, phi_1, ..., phi_count` of `z/2`, stacked, and the same of `z`: (2, p, d, d)."""
    norm = jnp.max(jnp.sum(jnp.abs(jax.lax.stop_gradient(z)), axis=1), initial=0.0)
    doublings = jnp.clip(jnp.ceil(jnp.log2(jnp.maximum(norm, 1e-300))) + 1, 1, MAX_DOUBLINGS)
    small = z * 2.0**-doublings
    eye = jnp.eye(z.shape[0])
    top = eye / float(factorial(count + _TAYLOR_TERMS))
    for j in range(_TAYLOR_TERMS - 1, -1, -1):
        top = small @ top + eye / float(factorial(count + j))
    phi = [top]
    for k in range(count - 1, 0, -1):
        phi.append(small @ phi[-1] + eye / float(factorial(k)))
    phi.append(small @ phi[-1])  # phi_0 - 1
    start = jnp.stack(phi[::-1])

    def step(phi, i):
        return jnp.where(i < doublings - 1, _double(phi), phi), None

    half, _ = jax.lax.scan(step, start, jnp.arange(MAX_DOUBLINGS - 1))
    return jnp.stack([half, _double(half)])
