"""A machine that leaves its position without swinging: it has buckled, or a negative stiffness pushes it.
Such a motion is no mode, and no speed is critical for it; so it is told beside them."""

import warnings

import numpy as np
import scipy.linalg

from ..core.threads import one_thread
from .linearise import LinearModel, driven_back

# Of an eigenvalue, what an imaginary part may be by rounding.
_REAL = 1e-6


@one_thread
def warn_of_divergence(model: LinearModel) -> None:
    """Of a model whose numbers are known."""
    M, K, A = (np.asarray(x) for x in (model.M, model.K, model.A))
    if not all(np.isfinite(x).all() for x in (M, K, A)) or not len(M) or not _pushed(M, K):
        return
    values, vectors, *_ = scipy.linalg.eig(A)  # K alone does not know what a control loop adds
    values, vectors = np.asarray(values), np.asarray(vectors)
    rates = np.real(values)
    away = (rates > 0) & (abs(np.imag(values)) <= _REAL * abs(values))
    away &= driven_back(A, M, vectors)
    if not away.any():
        return
    most = np.argmax(np.where(away, rates, 0.0))
    shape = abs(vectors[: len(M), most]) * np.sqrt(abs(np.diagonal(M)))
    station, coordinate = model.coordinates[int(np.argmax(shape))]
    warnings.warn(
        f"at {float(model.speed):.6g} rad/s the machine leaves its position without swinging, "
        f"`{station}.{coordinate}` most, {rates[most]:.3g} 1/s: it has buckled, or a negative stiffness "
        "pushes it. Modes and critical speeds are those of what swings; `linearize(machine).growth` and "
        "`buckling_factor` tell the rest",
        stacklevel=4,
    )


def _pushed(M: np.ndarray, K: np.ndarray) -> bool:
    """Whether the forces of K push some deflection on, beyond rounding."""
    scale = 1.0 / np.sqrt(abs(np.diagonal(M)))
    K = 0.5 * (K + K.T) * scale * scale[:, None]
    values, vectors = np.linalg.eigh(K)
    down = vectors[:, values < 0]
    work = -np.sum(down * (K @ down), axis=0)
    parts = np.sum(abs(down) * (abs(K) @ abs(down)), axis=0)
    return bool(np.any(work > 1e-13 * len(K) * parts))
