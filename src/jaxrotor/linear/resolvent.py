"""Solutions of `(s - A) x = f` as numbers, where the first rows of A say that the coordinates' rates are the
next entries of the state."""

import numpy as np
import scipy.linalg

# Times what stands behind the frequency: how far a force of no particular direction moves the state at most
# where no eigenvalue is met (`poles.py` asks for 1e-9 of the frequency; a damped one is away 1e-4 and more).
_NEAR = 1e5


def resolvent(A: np.ndarray, n: int, s: complex, f: np.ndarray) -> np.ndarray:
    """x like f, (d,) or (d, m); the rates of the n coordinates are eliminated, rows and columns scaled to a
    like size. `nan` where the matrix is singular."""
    f = np.asarray(f, complex)
    q, v = slice(n), slice(n, 2 * n)
    kept = np.r_[:n, 2 * n : len(A)]
    # v = s q - f_q
    rows = np.r_[n : len(A)]
    by_rate = A[rows][:, v]
    matrix = -A[np.ix_(rows, kept)].astype(complex)
    matrix[:, :n] -= s * by_rate
    matrix[:n, :n][np.diag_indices(n)] += s * s
    inside = np.arange(n, len(kept))
    matrix[inside, inside] += s
    right = f[rows] - by_rate @ f[q]
    right[:n] += s * f[q]
    scale = np.abs(matrix).max(1, initial=0.0)
    scale[scale == 0] = 1.0
    matrix /= scale[:, None]
    columns = np.abs(matrix).max(0, initial=0.0)
    columns[columns == 0] = 1.0
    x = np.empty_like(f)
    try:
        found = np.linalg.solve(matrix / columns, (right.T / scale).T)
    except np.linalg.LinAlgError:
        x[...] = np.nan
        return x
    x[kept] = (found.T / columns).T
    x[v] = s * x[q] - f[q]
    return x


def resolved(A: np.ndarray, n: int, w: float, f: np.ndarray) -> tuple[np.ndarray, bool]:
    """`resolvent` of f (d,) at i w, and whether an eigenvalue may be met there: told by how far another
    force, of no particular direction, moves the state."""
    _, (scale, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
    other = np.random.default_rng(0).standard_normal(len(A))
    x = resolvent(A, n, 1j * w, np.stack([f, scale * other], axis=1))
    moved = np.linalg.norm(x[:, 1] / scale) * abs(w)
    return x[:, 0], w == 0 or not moved <= _NEAR * np.linalg.norm(other)
