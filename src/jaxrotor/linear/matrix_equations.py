"""Lyapunov's and Riccati's matrix equations, with exact derivatives in both modes."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..core.arguments import matrix
from ..core.errors import InputError
from ..core.gate import takes

_BALANCING = 60  # sweeps; each halves what is out of balance, or nearly so
_SIGN_STEPS = 60  # Newton's steps towards a sign, at most: ten or fifteen are usual
_KLEINMAN_STEPS = 3  # each doubles the digits, and the start has six or more


@takes(A=matrix, Q=matrix)
@jax.jit
def lyapunov(A: Float[Array, "d d"], Q: Float[Array, "d d"]) -> Float[Array, "d d"]:
    """X in `A X + X A' + Q = 0`, for a stable A (all that is needed is that no two eigenvalues of A add up
    to 0; else the result is not finite). With Q = B B' it is the covariance of the state under white noise of
    unit intensity in every input.

    Exact derivatives of any order by A and Q, in both modes; `jit` and `vmap` work, on the CPU alone. States
    of different units may stand side by side: they are balanced first. Source: Bartels & Stewart, Comm.
    ACM 15 (1972) 820. Raises `InputError` for what is no matrix of finite numbers.
    """
    fit(A=(A, (len(A), len(A))), Q=(Q, (len(A), len(A))))
    scale = balance(A)
    A = A * scale[None, :] / scale[:, None]
    T, U = jax.scipy.linalg.schur(jax.lax.stop_gradient(A), output="complex")

    def equation(X):
        return A @ X + X @ A.T

    def forth(right):
        return (U @ _triangular(T, U.conj().T @ right @ U) @ U.conj().T).real

    def transposed(right):
        # A' X + X A: turned upside down, its lower triangular matrix is an upper one again
        flipped = _triangular(T.conj().T[::-1, ::-1], (U.conj().T @ right @ U)[::-1, ::-1])
        return (U @ flipped[::-1, ::-1] @ U.conj().T).real

    def twice(way):
        """The second time what the first one has left: one or two digits more in stiff machines."""

        def solve(operator, right):
            X = way(right)
            return X + way(right - operator(X))

        return solve

    # an operator that is linear in X: its derivatives are further solutions with the same Schur form
    right = -Q / scale[:, None] / scale[None, :]
    X = jax.lax.custom_linear_solve(equation, right, twice(forth), twice(transposed))
    return X * scale[:, None] * scale[None, :]


def _triangular(T: Array, right: Array) -> Array:
    """Y in `T Y + Y T* = right`, T upper triangular: its columns one after the other, the last first."""
    d = T.shape[0]

    def column(k, Y):
        j = d - 1 - k
        known = right[:, j] - Y @ T[j].conj()  # columns before j are still zero
        matrix = T + T[j, j].conj() * jnp.eye(d)
        return Y.at[:, j].set(jax.scipy.linalg.solve_triangular(matrix, known))

    return jax.lax.fori_loop(0, d, column, jnp.zeros_like(right))


def balance(A: Float[Array, "d d"]) -> Float[Array, " d"]:
    """Scales s, powers of 2 and without derivatives, with which `A s_j / s_i` has rows and columns of like
    size. Source: Osborne, J. ACM 7 (1960) 338; all rows at once, in half steps, which descends always."""
    size = jnp.abs(jax.lax.stop_gradient(A)) * (1 - jnp.eye(A.shape[0]))

    def sweep(_, logs):
        scaled = size * jnp.exp2(logs[None, :] - logs[:, None])
        rows, columns = scaled.sum(1), scaled.sum(0)
        both = (rows > 0) & (columns > 0)
        ratio = jnp.where(both, rows, 1.0) / jnp.where(both, columns, 1.0)
        # far in a step where much is amiss: no number may leave the range in between
        return logs + jnp.clip(0.25 * jnp.log2(ratio), -50.0, 50.0)

    return _power_of_2(jax.lax.fori_loop(0, _BALANCING, sweep, jnp.zeros(A.shape[0])))


def _power_of_2(logs: Array) -> Array:
    """The next one, exactly: `exp2` is not."""
    return jnp.ldexp(jnp.ones(logs.shape), jnp.round(logs).astype(jnp.int32))


@jax.jit
def stable(A: Float[Array, "d d"]) -> Bool[Array, ""]:
    """Whether every eigenvalue has a negative real part, by more than rounding (as free motions have)."""
    A = jax.lax.stop_gradient(A)
    scale = balance(A)
    values = jnp.linalg.eigvals(A * scale[None, :] / scale[:, None])
    return jnp.max(values.real) < -1e-12 * jnp.max(jnp.abs(values))


@takes(A=matrix, B=matrix, Q=matrix, R=matrix)
@jax.jit
def riccati(
    A: Float[Array, "d d"], B: Float[Array, "d m"], Q: Float[Array, "d d"], R: Float[Array, "m m"]
) -> Float[Array, "d d"]:
    """The stabilising X in `A' X + X A - X B R^-1 B' X + Q = 0`; R positive definite, Q and R symmetric. Not
    finite where there is none (an unstable motion that no input reaches, or Q does not see one at rest).

    Exact derivatives of any order by all four, in both modes; `jit` and `vmap` work, on the CPU alone.
    Sources: Byers, Linear Algebra Appl. 85 (1987) 267 (matrix sign function); Kleinman, IEEE Trans. Autom.
    Control 13 (1968) 114 (the last digits). Raises `InputError` for what is no matrix of finite
    numbers.
    """
    d, m = shape_of(B, "B", (len(A), None))
    fit(A=(A, (d, d)), Q=(Q, (d, d)), R=(R, (m, m)))
    G = B @ jnp.linalg.solve(R, B.T)
    return _riccati(A, 0.5 * (G + G.T), 0.5 * (Q + Q.T))


@jax.custom_jvp
def _riccati(A: Array, G: Array, Q: Array) -> Array:
    d = A.shape[0]
    both = balance(jnp.block([[A, -G], [-Q, -A.T]]))
    scale = _power_of_2(0.5 * (jnp.log2(both[:d]) - jnp.log2(both[d:])))
    A = A * scale[None, :] / scale[:, None]
    G = G / scale[:, None] / scale[None, :]
    Q = Q * scale[:, None] * scale[None, :]
    S = _sign(jnp.block([[A, -G], [-Q, -A.T]]))
    # the stable subspace (I, X) is what S + 1 takes to zero: more equations than unknowns
    q, r = jnp.linalg.qr(jnp.concatenate([S[:d, d:], S[d:, d:] + jnp.eye(d)]))
    right = -q.T @ jnp.concatenate([S[:d, :d] + jnp.eye(d), S[d:, :d]])
    X = jax.scipy.linalg.solve_triangular(r, right)

    def step(_, X):
        X = 0.5 * (X + X.T)
        return lyapunov((A - G @ X).T, Q + X @ G @ X)

    X = jax.lax.fori_loop(0, _KLEINMAN_STEPS, step, X)
    return 0.5 * (X + X.T) / scale[:, None] / scale[None, :]


@_riccati.defjvp
def _riccati_jvp(primals, tangents):
    A, G, Q = primals
    dA, dG, dQ = tangents
    X = _riccati(A, G, Q)
    changed = dA.T @ X + X @ dA - X @ dG @ X + dQ
    return X, lyapunov((A - G @ X).T, 0.5 * (changed + changed.T))


def _sign(H: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """The matrix with the same eigenvectors and eigenvalues 1 for those in the right, -1 for those in the
    left half plane. Newton's method, sped up by the determinant."""
    n = H.shape[0]

    def going(carry):
        _, change, k = carry
        # quadratic: after a change this small the next one is rounding
        return (change > 1e-9) & (k < _SIGN_STEPS)

    def once(carry):
        S, change, k = carry
        factors = jax.scipy.linalg.lu_factor(S)
        size = jnp.mean(jnp.log(jnp.abs(jnp.diagonal(factors[0]))))
        factor = jnp.where(change > 0.01, jnp.exp(-size), 1.0)
        new = 0.5 * (factor * S + jax.scipy.linalg.lu_solve(factors, jnp.eye(n)) / factor)
        return new, jnp.max(jnp.abs(new - S)) / jnp.max(jnp.abs(new)), k + 1

    return jax.lax.while_loop(going, once, (H, jnp.ones(()), 0))[0]


def shape_of(x: Array, name: str, wanted: tuple[int | None, int | None]) -> tuple[int, int]:
    """Rows and columns of a matrix; raises `InputError` where they are not those `wanted`."""
    if x.ndim != 2 or any(w is not None and w != s for w, s in zip(wanted, x.shape)):
        size = " by ".join("any number" if w is None else str(w) for w in wanted)
        raise InputError(f"{name} must be a matrix, {size}, but its shape is {x.shape}")
    return x.shape[0], x.shape[1]


def fit(**given: tuple[Array, tuple[int, int]]) -> None:
    """Raises `InputError` for the first matrix that has not the shape beside it."""
    for name, (x, wanted) in given.items():
        shape_of(x, name, wanted)
