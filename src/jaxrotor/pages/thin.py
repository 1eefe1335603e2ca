"""Long curves in few points: no peak is lost."""

import numpy as np

# A curve is drawn in twice so many points at most.
STRETCHES = 2000


def thinned(values: np.ndarray, stretches: int = STRETCHES) -> np.ndarray:
    """Numbers, rising, of the values (n,) to draw: in each of so many stretches of equal length the least and
    the greatest, and the two ends; all, where there are no more than that. Values that are not finite stay
    where a stretch has no other, as gaps."""
    n = len(values)
    if n <= 2 * stretches + 2:
        return np.arange(n)
    edges = np.linspace(0, n, stretches + 1).astype(int)
    low, high = bounds(values, edges)
    return np.unique(np.concatenate([[0], low, high, [n - 1]]))


def bounds(values: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number of the least and of the greatest value in each stretch from one edge to the next."""
    finite = np.isfinite(values)
    below, above = np.where(finite, values, np.inf), np.where(finite, values, -np.inf)
    low = np.array([a + int(np.argmin(below[a:b])) for a, b in zip(edges, edges[1:])])
    high = np.array([a + int(np.argmax(above[a:b])) for a, b in zip(edges, edges[1:])])
    return low, high


def envelope(
    x: np.ndarray, values: np.ndarray, stretches: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(x, least, greatest) of each stretch, x its middle; the first and the last reach to the ends."""
    count = max(2, min(stretches, len(values) // 4))
    edges = np.linspace(0, len(values), count + 1).astype(int)
    low, high = bounds(values, edges)
    middle = x[(edges[:-1] + edges[1:] - 1) // 2].astype(float)
    middle[0], middle[-1] = x[0], x[-1]
    return middle, values[low], values[high]
