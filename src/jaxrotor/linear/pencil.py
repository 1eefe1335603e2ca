"""Undamped whirl in step with the shaft: `K u = w² (M - i G) u`, all of its roots over any range of scales.

One general eigenvalue routine is right to rounding of the largest root alone, so that a stiff support hides
all that is soft. Here the pencil is solved twice, both times Hermitian and in a metric in which nothing is
large: once for 1/w², right for the low roots, once for w², right for the high ones. By Sylvester's law of
inertia their number is known beforehand. Of NumPy's arrays nothing is compiled, of JAX's it may be traced.
Sources: Parlett, The Symmetric Eigenvalue Problem (1998), ch. 15;
Barlow & Demmel, SIAM J. Numer. Anal. 27 (1990) 762 (graded matrices).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
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
    xp, still = _kind(M)
    masses, gyros = still((M, G))
    if marks is not None:
        size = xp.sqrt(xp.diagonal(masses))
        masses = masses + _HAIR * xp.diag(marks[0] * size**2)
        gyros = gyros + _HAIR * size[:, None] * marks[1] * size
    found = _search(masses, gyros, still(K))
    a, b = found.shapes.real, found.shapes.imag
    there = xp.isfinite(found.squares)
    elastic = xp.sum(a * (K @ a), 0) + xp.sum(b * (K @ b), 0)
    inertia = xp.sum(a * (M @ a), 0) + xp.sum(b * (M @ b), 0) + 2 * xp.sum(a * (G @ b), 0)
    quotient = elastic / xp.where(there, inertia, 1.0)
    values = xp.where(there, still(quotient), 1.0)
    near = xp.abs(values[:, None] - values[None]) <= _TOGETHER * values[:, None]
    alike = (near & there[:, None] & there[None]) | xp.eye(len(values), dtype=bool)
    mean = (alike / xp.sum(alike, 1, keepdims=True)) @ xp.where(there, quotient, 1.0)
    squares = xp.where(there, values + mean - still(mean), xp.inf)
    return squares, found._replace(squares=still(squares))


def _kind(x: Any) -> tuple[Any, Callable]:
    """NumPy or JAX's, and what takes derivatives away."""
    return (np, lambda x: x) if isinstance(x, np.ndarray) else (jnp, jax.lax.stop_gradient)


def _either(xp: Any, which: Any, one: Callable, other: Callable, x: Any) -> Any:
    if xp is np:
        return one(x) if which else other(x)
    return jax.lax.cond(which, one, other, x)


def _repeated(xp: Any, goes_on: Callable, once: Callable, x: Any) -> Any:
    if xp is not np:
        return jax.lax.while_loop(goes_on, once, x)
    while goes_on(x):
        x = once(x)
    return x


def _cholesky(xp: Any, x: Any) -> Any:
    """NaN where there is none."""
    if xp is not np:
        return jnp.linalg.cholesky(x)
    try:
        return np.linalg.cholesky(x)
    except np.linalg.LinAlgError:
        return np.full_like(x, np.nan)


def _least_norm(xp: Any, x: Any) -> Any:
    """Pseudo-inverse of a Hermitian matrix."""
    if xp is np:
        return np.linalg.pinv(x, 1e-12, hermitian=True)
    return jnp.linalg.pinv(x, rtol=1e-12, hermitian=True)


def _triangular(xp: Any, L: Any, right: Any, trans: int = 0) -> Any:
    options: dict[str, Any] = dict(lower=True, trans=trans)
    if xp is np:
        return scipy.linalg.solve_triangular(L, right, check_finite=False, **options)
    return jax.scipy.linalg.solve_triangular(L, right, **options)


def _search(M: Array, G: Array, K: Array) -> Whirling:
    xp, n = _kind(M)[0], M.shape[0]
    B = M - 1j * G
    W, strain, rigid = _modal(M, K)
    inner = W.T @ B @ W
    # motions without strain follow the others so that they ask for no force
    rest = xp.where(rigid[:, None] & rigid[None], inner, 0.0)
    follow = _least_norm(xp, rest)
    root = xp.where(rigid, 0.0, 1.0 / xp.sqrt(xp.where(rigid, 1.0, xp.abs(strain))))
    S = root[:, None] * (inner - inner @ follow @ inner) * root
    unstable = xp.any(~rigid & (strain < 0))

    def hermitian(S):
        values, vectors = xp.linalg.eigh(0.5 * (S + S.conj().T))
        return values, vectors

    def general(S):
        # a negative stiffness: some roots may be complex, and are none
        values, vectors = xp.linalg.eig(xp.where(strain < 0, -1.0, 1.0)[:, None] * S)
        real = xp.abs(values.imag) < 1e-6 * xp.abs(values)
        return xp.where(real, values.real, 0.0), vectors

    low, b = _either(xp, unstable, general, hermitian, S)
    b = root[:, None] * b
    low_shapes = W @ (b - follow @ (inner @ b))
    low_error = n * _EPS * xp.max(xp.abs(low), initial=0.0) / xp.abs(low)

    # the other form: K = F F', and w² are the eigenvalues of F' B^-1 F
    size = 1.0 / xp.sqrt(xp.diagonal(M))
    scaled = size[:, None] * B * size
    signs, turned = xp.linalg.eigh(scaled)
    singular = xp.min(xp.abs(signs)) < 1e-9 * xp.max(xp.abs(signs))
    F = _stiff_factor(M, K, W, strain, rigid)
    solved = turned @ ((turned.conj().T @ (size[:, None] * F)) / signs[:, None])
    solved = size[:, None] * solved
    T = F.T @ solved
    high, c = xp.linalg.eigh(0.5 * (T + T.conj().T))
    high_error = n * _EPS * xp.max(xp.abs(high), initial=0.0) / xp.abs(high)
    usable = ~singular & ~unstable

    # how many there are: the signs of B, less those of the motions without strain
    own = xp.linalg.eigvalsh(rest)
    positive = xp.sum(signs > 0) - xp.sum(own > 1e-12 * xp.max(xp.abs(own), initial=0.0))
    seen = (low > 0) & (low_error < _LOST)
    count = xp.where(usable, positive, xp.sum(seen))
    up = xp.argsort(xp.where(seen, -low, xp.inf))
    down = xp.argsort(xp.where(high > 0, -high, xp.inf))
    k = xp.arange(n)
    from_top = xp.clip(count - 1 - k, 0, n - 1)
    low_error = xp.where(k < xp.sum(seen), low_error[up], xp.inf)
    high_error = xp.where(usable & (k < count), high_error[down[from_top]], xp.inf)
    shapes = xp.where(low_error <= high_error, low_shapes[:, up], (solved @ c)[:, down[from_top]])
    there = xp.minimum(low_error, high_error) < _LOST
    squares = xp.where(there, xp.sum(shapes.conj() * (K @ shapes), 0).real, 1.0)
    squares = squares / xp.where(there, xp.sum(shapes.conj() * (B @ shapes), 0).real, 1.0)
    squares = xp.where(there & (squares > 0), squares, xp.inf)
    lost = xp.sum((k < count) & ~xp.isfinite(squares))
    complete = xp.where(lost == 0, count, xp.sum(seen))
    order = xp.argsort(squares)
    return Whirling(squares[order], shapes[:, order], complete, lost)


def _stiff_factor(M: Array, K: Array, W: Array, strain: Array, rigid: Array) -> Array:
    """F with `K = F F'`: `K W` over the root of its strain."""
    xp = _kind(M)[0]
    return (K @ W) * xp.where(rigid, 0.0, 1.0 / xp.sqrt(xp.where(rigid, 1.0, xp.abs(strain))))


def _modal(M: Array, K: Array) -> _Modal:
    """The modes at rest, in a metric shifted to about the lowest elastic frequency."""
    xp, n = _kind(M)[0], M.shape[0]
    own = xp.diagonal(K) / xp.diagonal(M)
    held = own > 0
    start = xp.where(xp.any(held), xp.min(xp.where(held, own, xp.inf)), 1.0)

    def factor(shift):
        shifted = K + shift * M
        size = 1.0 / xp.sqrt(xp.abs(xp.diagonal(shifted)))
        return size, _cholesky(xp, size[:, None] * shifted * size)

    def lift(state):
        shift, k = state
        return 1e3 * shift, k + 1

    def negative(state):
        return xp.any(~xp.isfinite(factor(state[0])[1])) & (state[1] < _LIFTS)

    def modes(shift):
        shift, _ = _repeated(xp, negative, lift, (shift, 0))
        size, L = factor(shift)
        half = _triangular(xp, L, size[:, None] * M * size)
        inertia = _triangular(xp, L, half.T)
        mu, V = xp.linalg.eigh(0.5 * shift * (inertia + inertia.T))
        W = size[:, None] * _triangular(xp, L, V, 1)
        strain = xp.sum(W * (K @ W), 0)
        rigid = xp.abs(strain) <= 4 * n * _EPS * xp.sum(xp.abs(W) * (xp.abs(K) @ xp.abs(W)), 0)
        return shift, mu, _Modal(W, strain, rigid)

    def nearer(_, shift):
        shift, mu, modal = modes(shift)
        squares = xp.abs(modal.strain) / xp.maximum(mu, _EPS) * shift
        lowest = xp.min(xp.where(modal.rigid, xp.inf, squares))
        return xp.where(xp.isfinite(lowest), lowest, shift)

    def on(state):
        return state[0] < _ROUNDS - 1

    shift = _repeated(xp, on, lambda s: (s[0] + 1, nearer(*s)), (0, start))[1]
    return modes(shift)[2]
