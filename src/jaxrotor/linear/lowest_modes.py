"""The lowest modes of a linear model, in NumPy: for tables and figures, where no derivative is asked."""

from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse.linalg

from ..core.threads import one_thread
from .linearise import LinearModel, oscillating

# Below this many states all eigenvalues cost no more than a few.
_SMALL = 150
# Rigid-body zeros, overdamped motions and conjugates take places among those nearest to zero.
_SPARE = 16
# Of the largest frequency: about the lowest one of a machine of many elements. It is lowered until it lies
# below.
_SHIFT, _LOWER = 1e-5, 1e-2
# Of an eigenvector of length one, the largest entry of its coordinates.
_MOVES = 1e-13


@one_thread
def lowest(model: LinearModel, count: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (m,) with Im > 0 by rising natural frequency, `count` at most, and their shapes (n, m)
    over the model's coordinates, the largest entry 1.

    Large models by the shift-invert Lanczos-Arnoldi method near zero. Source: Lehoucq, Sorensen & Yang,
    ARPACK Users' Guide (1998).
    """
    A, M = np.asarray(model.A), np.asarray(model.M)
    n, size = len(M), len(A)
    wanted = size if count is None else 2 * count + _SPARE
    shift = _SHIFT * float(np.sqrt(np.linalg.norm(A, 1)))
    while True:
        if size <= _SMALL or 2 * wanted >= size:
            wanted = size
        values, vectors = _all(A) if wanted == size else _near(A, shift, wanted)
        # a motor's fluxes may swing where nothing moves: no mode of the machine
        moves = np.max(np.abs(vectors[:n]), axis=0, initial=0.0) > _MOVES
        up = np.flatnonzero(moves & (np.imag(values) > 0))
        up = up[oscillating(A, M, values[up], vectors[:, up])]
        if wanted == size:
            break
        lowest = np.min(np.abs(values[up]), initial=np.inf)
        if shift > lowest:
            shift *= _LOWER
        elif len(up) < (count or 0):
            wanted *= 2
        else:
            break
    up = up[np.argsort(np.abs(values[up]), kind="stable")][:count]
    shapes = vectors[:n, up]
    rows = np.argmax(np.abs(shapes), axis=0)
    return values[up], shapes / shapes[rows, np.arange(len(up))]


def _all(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    values, vectors, *_ = scipy.linalg.eig(A)
    return np.asarray(values), np.asarray(vectors)


def _near(A: np.ndarray, shift: float, count: int) -> Any:
    """The `count` eigenvalues nearest to a small shift (with which rigid-body zeros can be solved) and
    their vectors; all of them where the iteration does not settle."""
    n = A.shape[0]
    balanced, (scale, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
    factors = scipy.linalg.lu_factor(balanced - shift * np.eye(n))
    inverse: Any = scipy.sparse.linalg.LinearOperator(
        (n, n),
        matvec=lambda x: scipy.linalg.lu_solve(factors, x),  # pyright: ignore
    )
    start = np.random.default_rng(0).standard_normal(n)
    try:
        found: Any = scipy.sparse.linalg.eigs(balanced, count, sigma=shift, OPinv=inverse, v0=start)
    except scipy.sparse.linalg.ArpackError:
        return scipy.linalg.eig(A)
    return found[0], scale[:, None] * found[1]
