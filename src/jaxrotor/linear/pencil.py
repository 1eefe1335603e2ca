"""Undamped whirl in step with the shaft: `K u = w² (M - i G) u`, all of its roots over any range of scales.

One general eigenvalue routine is right to rounding of the largest root alone, so that a stiff support hides
all that is soft. Here the pencil is solved twice, both times Hermitian and in a metric in which nothing is
large: once for 1/w², right for the low roots, once for w², right for the high ones. By Sylvester's law of
inertia their number is known beforehand. Sources: Parlett, The Symmetric Eigenvalue Problem (1998), ch. 15;
Barlow & Demmel, SIAM J. Numer. Anal. 27 (1990) 762 (graded matrices).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float, Int

_EPS = float(np.finfo(float).eps)
_ROUNDS = 4  # towards the lowest elastic frequency, eight decades each
_LIFTS = 12  # of the shift, by a factor of 1000, where the stiffness is negative
_LOST = 0.01  # relative error beyond which a root is taken from the other form
_HAIR = 1e-10  # of the inertia: roots move by the square of it, but for those that it parts
_TOGETHER = 1e-7  # roots closer than this part count as one: each gets the derivative of their mean


class Whirling(NamedTuple):
    """`squares`: (n,), w² rising, inf where there is no further root; `shapes`: (n, n), columns.
    `complete`: so many of them, from the lowest, are all there are; beyond, rounding hides `lost` roots."""

    squares: Float[Array, " n"]
    shapes: Complex[Array, "n n"]
    complete: Int[Array, ""]
    lost: Int[Array, ""]


class _Modal(NamedTuple):
    """`W` with `W' (K + shift M) W = 1`; `strain`, the diagonal of `W' K W`; `rigid`: without strain."""

    W: Float[Array, "n n"]
    strain: Float[Array, " n"]
    rigid: Array


def whirling(
    M: Float[Array, "n n"],
    G: Float[Array, "n n"],
    K: Float[Array, "n n"],
    marks: tuple[Float[Array, " n"], Float[Array, "n n"]] | None = None,
) -> tuple[Float[Array, " n"], Whirling]:
    """Roots of `K u = w² (M - i G) u`: M symmetric and positive definite, G skew, K symmetric. First the
    squares with exact first derivatives in both modes (those of a mean, where several coincide), then what
    the search found, without derivatives.

    `marks`: a part of the inertia, and one of G, that differ between motions of different kinds. Added by a
    hair in the search, they give coincident roots the shapes of one kind each.
    """
    masses, gyros = jax.lax.stop_gradient((M, G))
    if marks is not None:
        size = jnp.sqrt(jnp.diagonal(masses))
        masses = masses + _HAIR * jnp.diag(marks[0] * size**2)
        gyros = gyros + _HAIR * size[:, None] * marks[1] * size
    found = _search(masses, gyros, jax.lax.stop_gradient(K))
    a, b = found.shapes.real, found.shapes.imag
    there = jnp.isfinite(found.squares)
    elastic = jnp.sum(a * (K @ a), 0) + jnp.sum(b * (K @ b), 0)
    inertia = jnp.sum(a * (M @ a), 0) + jnp.sum(b * (M @ b), 0) + 2 * jnp.sum(a * (G @ b), 0)
    quotient = elastic / jnp.where(there, inertia, 1.0)
    values = jnp.where(there, jax.lax.stop_gradient(quotient), 1.0)
    near = jnp.abs(values[:, None] - values[None]) <= _TOGETHER * values[:, None]
    alike = (near & there[:, None] & there[None]) | jnp.eye(len(values), dtype=bool)
    mean = (alike / jnp.sum(alike, 1, keepdims=True)) @ jnp.where(there, quotient, 1.0)
    squares = jnp.where(there, values + mean - jax.lax.stop_gradient(mean), jnp.inf)
    return squares, found._replace(squares=jax.lax.stop_gradient(squares))


def _search(M: Array, G: Array, K: Array) -> Whirling:
    n = M.shape[0]
    B = jax.lax.complex(M, -G)
    W, strain, rigid = _modal(M, K)
    inner = W.T @ B @ W
    # motions without strain follow the others so that they ask for no force
    rest = jnp.where(rigid[:, None] & rigid[None], inner, 0.0)
    follow = jnp.linalg.pinv(rest, rtol=1e-12, hermitian=True)
    root = jnp.where(rigid, 0.0, 1.0 / jnp.sqrt(jnp.where(rigid, 1.0, jnp.abs(strain))))
    S = root[:, None] * (inner - inner @ follow @ inner) * root
    unstable = jnp.any(~rigid & (strain < 0))

    def hermitian(S):
        values, vectors = jnp.linalg.eigh(0.5 * (S + S.conj().T))
        return values, vectors

    def general(S):
        # a negative stiffness: some roots may be complex, and are none
        values, vectors = jnp.linalg.eig(jnp.where(strain < 0, -1.0, 1.0)[:, None] * S)
        real = jnp.abs(values.imag) < 1e-6 * jnp.abs(values)
        return jnp.where(real, values.real, 0.0), vectors

    low, b = jax.lax.cond(unstable, general, hermitian, S)
    b = root[:, None] * b
    low_shapes = W @ (b - follow @ (inner @ b))
    low_error = n * _EPS * jnp.max(jnp.abs(low), initial=0.0) / jnp.abs(low)

    # the other form: K = F F', and w² are the eigenvalues of F' B^-1 F
    size = 1.0 / jnp.sqrt(jnp.diagonal(M))
    scaled = size[:, None] * B * size
    signs, turned = jnp.linalg.eigh(scaled)
    singular = jnp.min(jnp.abs(signs)) < 1e-9 * jnp.max(jnp.abs(signs))
    F = _stiff_factor(M, K, W, strain, rigid)
    solved = turned @ ((turned.conj().T @ (size[:, None] * F)) / signs[:, None])
    solved = size[:, None] * solved
    T = F.T @ solved
    high, c = jnp.linalg.eigh(0.5 * (T + T.conj().T))
    high_error = n * _EPS * jnp.max(jnp.abs(high), initial=0.0) / jnp.abs(high)
    usable = ~singular & ~unstable

    # how many there are: the signs of B, less those of the motions without strain
    own = jnp.linalg.eigvalsh(rest)
    positive = jnp.sum(signs > 0) - jnp.sum(own > 1e-12 * jnp.max(jnp.abs(own), initial=0.0))
    seen = (low > 0) & (low_error < _LOST)
    count = jnp.where(usable, positive, jnp.sum(seen))
    up = jnp.argsort(jnp.where(seen, -low, jnp.inf))
    down = jnp.argsort(jnp.where(high > 0, -high, jnp.inf))
    k = jnp.arange(n)
    from_top = jnp.clip(count - 1 - k, 0, n - 1)
    low_error = jnp.where(k < jnp.sum(seen), low_error[up], jnp.inf)
    high_error = jnp.where(usable & (k < count), high_error[down[from_top]], jnp.inf)
    shapes = jnp.where(low_error <= high_error, low_shapes[:, up], (solved @ c)[:, down[from_top]])
    there = jnp.minimum(low_error, high_error) < _LOST
    squares = jnp.where(there, jnp.sum(shapes.conj() * (K @ shapes), 0).real, 1.0)
    squares = squares / jnp.where(there, jnp.sum(shapes.conj() * (B @ shapes), 0).real, 1.0)
    squares = jnp.where(there & (squares > 0), squares, jnp.inf)
    lost = jnp.sum((k < count) & ~jnp.isfinite(squares))
    complete = jnp.where(lost == 0, count, jnp.sum(seen))
    order = jnp.argsort(squares)
    return Whirling(squares[order], shapes[:, order], complete, lost)


def _stiff_factor(M: Array, K: Array, W: Array, strain: Array, rigid: Array) -> Array:
    """F with `K = F F'`: `K W` over the root of its strain."""
    return (K @ W) * jnp.where(rigid, 0.0, 1.0 / jnp.sqrt(jnp.where(rigid, 1.0, jnp.abs(strain))))


def _modal(M: Array, K: Array) -> _Modal:
    """The modes at rest, in a metric shifted to about the lowest elastic frequency."""
    n = M.shape[0]
    own = jnp.diagonal(K) / jnp.diagonal(M)
    held = own > 0
    start = jnp.where(jnp.any(held), jnp.min(jnp.where(held, own, jnp.inf)), 1.0)

    def factor(shift):
        shifted = K + shift * M
        size = 1.0 / jnp.sqrt(jnp.abs(jnp.diagonal(shifted)))
        return size, jnp.linalg.cholesky(size[:, None] * shifted * size)

    def lift(state):
        shift, k = state
        return 1e3 * shift, k + 1

    def negative(state):
        return jnp.any(~jnp.isfinite(factor(state[0])[1])) & (state[1] < _LIFTS)

    def modes(shift):
        shift, _ = jax.lax.while_loop(negative, lift, (shift, 0))
        size, L = factor(shift)
        half = jax.scipy.linalg.solve_triangular(L, size[:, None] * M * size, lower=True)
        inertia = jax.scipy.linalg.solve_triangular(L, half.T, lower=True)
        mu, V = jnp.linalg.eigh(0.5 * shift * (inertia + inertia.T))
        W = size[:, None] * jax.scipy.linalg.solve_triangular(L, V, lower=True, trans=1)
        strain = jnp.sum(W * (K @ W), 0)
        rigid = jnp.abs(strain) <= 4 * n * _EPS * jnp.sum(jnp.abs(W) * (jnp.abs(K) @ jnp.abs(W)), 0)
        return shift, mu, _Modal(W, strain, rigid)

    def nearer(_, shift):
        shift, mu, modal = modes(shift)
        squares = jnp.abs(modal.strain) / jnp.maximum(mu, _EPS) * shift
        lowest = jnp.min(jnp.where(modal.rigid, jnp.inf, squares))
        return jnp.where(jnp.isfinite(lowest), lowest, shift)

    return modes(jax.lax.fori_loop(0, _ROUNDS - 1, nearer, start))[2]
