"""Curves over speed or frequency, sampled so closely at their peaks that these are not missed between
samples."""

from collections.abc import Callable

import numpy as np

# Points in one call, so that all calls share one compiled program.
_CHUNK = 64
# Between neighbours of a peak; of the peaks of a curve, the highest are looked at so many at most.
_BETWEEN, _PEAKS = 7, 8
# Until the points beside a peak are lower by less than this part, or for so many rounds.
_FLAT, _ROUNDS = 1e-5, 14


def sampled(
    evaluate: Callable[[np.ndarray], np.ndarray], grid: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n,), rising, those of `grid` among them; values (n, m) of `evaluate` there; and for each of
    the m curves whether its highest peak has settled: the peak of an undamped mode never does."""

    def values_at(points: np.ndarray) -> np.ndarray:
        padded = np.append(points, np.full(-len(points) % _CHUNK, points[-1]))
        parts = [evaluate(part) for part in padded.reshape(-1, _CHUNK)]
        return np.concatenate(parts)[: len(points)]

    points, values = np.asarray(grid), values_at(grid)
    for _ in range(_ROUNDS):
        new = np.unique(np.concatenate([_beside(points, np.abs(v)) for v in values.T]))
        new = np.setdiff1d(new, points)
        if not new.size or all(_settled(np.abs(v)) for v in values.T):
            break
        points, values = np.append(points, new), np.concatenate([values, values_at(new)])
        order = np.argsort(points)
        points, values = points[order], values[order]
    return points, values, np.array([_settled(np.abs(v)) for v in values.T])


def _settled(size: np.ndarray) -> bool:
    """Whether the highest point is as high as those beside it; at an end nothing is sought."""
    k = int(np.argmax(size))
    if k in (0, len(size) - 1):
        return True
    return bool(np.isfinite(size[k]) and min(size[k - 1], size[k + 1]) >= (1 - _FLAT) * size[k])


def _beside(points: np.ndarray, size: np.ndarray) -> np.ndarray:
    inner = (
        np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:]) & (size[1:-1] > 0)) + 1
    )
    inner = inner[np.argsort(-size[inner], kind="stable")[:_PEAKS]]
    wide = points[inner + 1] - points[inner - 1] > 1e-12 * points[inner]
    shares = np.arange(1, _BETWEEN + 1) / (_BETWEEN + 1)
    low, high = points[inner[wide] - 1], points[inner[wide] + 1]
    return (low[:, None] + (high - low)[:, None] * shares).ravel()
