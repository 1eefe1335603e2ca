"""Where the balanced machine stays while it turns, and its matrices there, as numbers: what
`simulation/equilibrium.py` finds under a trace, without compiling the search."""

from typing import Any, NamedTuple

import numpy as np
import scipy.linalg

from ..core.threads import one_thread
from ..integrators.newton import FREE_MOTION
from ..machine.field import n_free
from ..simulation.state import State
from .instant import Instant, Prepared, flat_state, instant

_ITERATIONS, _HALVINGS, _SETTLED = 100, 30, 1e-12
# A step that leaves more than this part of the loads has not reached it.
_UNREACHED = 1e-6


class Steady(NamedTuple):
    """`at`: the instant, its A and B with the forces from outside, `held` (n,), that bear what is not in
    balance; `y`: (d,); `M`: (n, n). All in the order of the vector field."""

    at: Instant
    y: np.ndarray
    M: np.ndarray
    held: np.ndarray


@one_thread
def steady(
    prepared: Prepared, speed: float, at: Any, known: tuple[np.ndarray, Instant] | None = None
) -> Steady:
    """`at`: as for `linearize`. `known`: an equilibrium, and what is found there."""
    n = n_free(prepared.system)
    if isinstance(at, State):  # whose own accelerations count
        y = flat_state(prepared, at, speed)
        found = instant(prepared, y, speed)
        return Steady(found, y, _mass(found, prepared), np.zeros(n))
    if known is not None:
        start, found = known
    else:
        start = np.asarray(prepared.start)
        found = instant(prepared, start, speed)
    y = start
    if at == "equilibrium" and known is None and len(y):
        y, found = _balanced(prepared, start, speed, found)
    M = _mass(found, prepared)
    held = -M @ found.rates[n : 2 * n]
    if np.any(held) or np.any(y != start):
        found = instant(prepared, y, speed, held)
        M = _mass(found, prepared)
    return Steady(found, y, M, held)


def _mass(found: Instant, prepared: Prepared) -> np.ndarray:
    n = n_free(prepared.system)
    M = np.linalg.inv(found.B[n : 2 * n])
    # coefficients of a seal need not be symmetric
    return M if prepared.system.inertial else 0.5 * (M + M.T)


def _balanced(
    prepared: Prepared, start: np.ndarray, speed: float, found: Instant
) -> tuple[np.ndarray, Instant]:
    """Newton's method on the loads, in which the accelerations take no part. Returns the state, and what is
    found next to it."""
    rows = _sought(prepared, start)
    y = start
    for _ in range(_ITERATIONS):
        step, share = _step(prepared, y, found), 1.0
        for _ in range(_HALVINGS + 1):
            moved = y.copy()
            moved[rows] -= share * step
            if share * np.abs(step).max() <= _SETTLED * np.abs(moved[rows]).max():
                return moved, found
            beyond = instant(prepared, moved, speed)
            if np.all(np.isfinite(beyond.loads)):
                break
            share *= 0.5
        else:  # this is as far as it gets
            return y, found
        y, found = moved, beyond
    return y, found


def moved_by(prepared: Prepared, y: np.ndarray, found: Instant) -> float:
    """The largest entry of Newton's step from y."""
    return float(np.abs(_step(prepared, y, found)).max(initial=0.0))


def _sought(prepared: Prepared, y: np.ndarray) -> np.ndarray:
    n = n_free(prepared.system)
    return np.r_[:n, 2 * n : len(y)]


def _step(prepared: Prepared, y: np.ndarray, found: Instant) -> np.ndarray:
    """Of what is sought; a free line's common turning is held where it is in place of its common torque."""
    n, rows = n_free(prepared.system), _sought(prepared, y)
    left, slope = found.loads, found.pull[:, rows]
    if prepared.turning is None:
        return _solved(slope, left)
    left, slope = left.copy(), slope.copy()
    free, far = map(np.asarray, prepared.turning)
    left[:n] += free @ (y[:n] - left[:n])
    slope[:n] -= free @ slope[:n]
    slope[:n, :n] += free
    step = _solved(slope, left)
    if np.any(far):
        remains = np.abs(left - slope @ step).max()
        if not remains <= _UNREACHED * np.abs(left).max():
            slope[:n, :n] += free @ far - far
            step = _solved(slope, left)
    return step


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """As `solve_linear`: the least-norm solution, with rows and columns of a like size."""
    if not np.any(right):
        return np.zeros_like(right)
    if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(right))):
        return np.full_like(right, np.nan)
    rows = np.abs(matrix).max(1, initial=0.0)
    rows[rows == 0] = 1.0
    scaled = matrix / rows[:, None]
    columns = np.abs(scaled).max(0, initial=0.0)
    columns[columns == 0] = 1.0
    scaled, right = scaled / columns, right / rows
    lapack: Any = scipy.linalg.lapack
    factors, pivots, fault = lapack.dgetrf(scaled)
    norm = np.abs(scaled).sum(0).max(initial=0.0)
    # far from singular there is one solution, and no need to look for the least
    if fault == 0 and lapack.dgecon(factors, norm)[0] > FREE_MOTION * len(right):
        return lapack.dgetrs(factors, pivots, right)[0] / columns
    return np.linalg.pinv(scaled, rcond=FREE_MOTION) @ right / columns
