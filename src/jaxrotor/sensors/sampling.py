"""How a signal was sampled, and what looks wrong about it: in words, for whoever looks at a record."""

import numpy as np

# Of a step: instants that lie this near to an even grid are meant to be on it, and this near they are.
_EVEN, _EXACT = 0.25, 0.05
# Steps that are this much longer than the usual one, and than nine in ten, are gaps.
_GAP, _LONG = 1.9, 1.5
# Equal values side by side at the end of a range, and how many of them in all, that make a clipped signal;
# steps onto it are larger than this many times the smallest there is, else it is merely a coarse one.
_FLAT, _OFTEN, _STEEP = 3, 6, 3.0
# A spike stands out of its neighbours by this much of the whole range, and so many times more than they do.
_HIGH, _ALONE, _NEAR = 0.1, 10.0, 25


def rate_of(t: np.ndarray) -> float | None:
    """Hz, where the instants are evenly spaced, but for their rounding."""
    step, off = _grid(t)
    return 1.0 / step if off <= _EVEN else None


def _grid(t: np.ndarray) -> tuple[float, float]:
    """The step of the even grid from first to last instant, and how far they are off it, in steps."""
    if t.size < 3 or not np.isfinite(t).all() or not t[-1] > t[0]:
        return 0.0, np.inf
    step = float(t[-1] - t[0]) / (t.size - 1)
    return step, float(np.abs(t - (t[0] + step * np.arange(t.size))).max()) / step


def gaps(t: np.ndarray) -> np.ndarray:
    """After which instants there is a gap."""
    steps = np.diff(t)
    usual = float(np.median(steps)) if steps.size else 0.0
    if not usual > 0:
        return np.zeros(0, int)
    return np.flatnonzero(steps > max(_GAP * usual, _LONG * float(np.quantile(steps, 0.9))))


def suspicions(t: np.ndarray | None, values: np.ndarray) -> list[str]:
    """What is odd about a signal, in plain words; nothing, mostly. `t`: s."""
    found = [] if t is None else _of_time(t)
    valid = np.isfinite(values)
    found += _of_missing(t, valid)
    if np.isinf(values).any():
        found.append(f"{_count(np.isinf(values).sum(), 'value is', 'values are')} infinite")
    held = values[valid]
    if held.size < 2:
        return found
    if np.ptp(held) == 0:
        return [*found, f"constant: all values are {held[0]:g}"]
    for end, words in ((held.max(), "greatest"), (held.min(), "least")):
        if count := _clipped(held, end):
            found.append(f"may be clipped: {count} values stand still at the {words}, {end:g}")
    spikes = _spikes(held)
    if spikes.size:
        k = spikes[np.argmax(np.abs(held[spikes] - np.median(held)))]
        found.append(
            f"{_count(spikes.size, 'spike', 'spikes')} of one value, the largest {held[k]:g}"
            f"{_at(t, int(np.flatnonzero(valid)[k]))}"
        )
    return found


def _count(number: int, one: str, many: str) -> str:
    return f"{number} {one if number == 1 else many}"


def _at(t: np.ndarray | None, k: int) -> str:
    return f" (value {k + 1})" if t is None else f" at {t[k]:.6g} s"


def _of_time(t: np.ndarray) -> list[str]:
    if not np.isfinite(t).all():
        return [f"{_count((~np.isfinite(t)).sum(), 'instant is', 'instants are')} missing"]
    steps, out = np.diff(t), []
    if count := int((steps == 0).sum()):
        k = int(np.argmax(steps == 0))
        out.append(f"{_count(count, 'instant is', 'instants are')} repeated, first {t[k]:.6g} s")
    if count := int((steps < 0).sum()):
        k = int(np.argmax(steps < 0)) + 1
        out.append(
            f"time falls {_count(count, 'time', 'times')}, first in row {k + 1}, to {t[k]:.6g} s"
        )
    off = _grid(t)[1]
    if _EXACT < off <= _EVEN:
        out.append(f"instants are off an even grid by up to {off:.2g} of a step: are they rounded?")
    longer = gaps(t)
    if longer.size:
        k = longer[np.argmax(steps[longer])]
        out.append(
            f"{_count(longer.size, 'gap', 'gaps')} in time, the longest {steps[k]:.4g} s at {t[k]:.6g} s"
        )
    return out


def _of_missing(t: np.ndarray | None, valid: np.ndarray) -> list[str]:
    if np.all(valid):
        return []
    first, length = max(runs(~valid), key=lambda run: run[1])
    count = int((~valid).sum())
    longest = f", the longest run {length}{_at(t, first)}" if length > 1 else _at(t, first)
    return [f"{_count(count, 'value is', 'values are')} missing{longest}"]


def runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """(first, how many) of each run of what is true."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return list(zip(begins.tolist(), (ends - begins).tolist()))


def _clipped(values: np.ndarray, end: float) -> int:
    """How many values stand still at an end of the range, none where they come there gently."""
    still = [(k, n) for k, n in runs(values == end) if n >= _FLAT]
    count = sum(n for _, n in still)
    if count < _OFTEN:
        return 0
    steps = np.abs(np.diff(values))
    onto = [steps[k - 1] for k, _ in still if k] + [
        steps[k + n - 1] for k, n in still if k + n < values.size
    ]
    return count if onto and np.median(onto) > _STEEP * steps[steps > 0].min() else 0


def _spikes(values: np.ndarray) -> np.ndarray:
    """Where single values stand out of all that is near."""
    from scipy.ndimage import median_filter

    if values.size < 2 * _NEAR:
        return np.zeros(0, int)
    off = np.abs(values - median_filter(values, 5, mode="nearest"))
    high = np.flatnonzero(off > _HIGH * np.ptp(values))
    if high.size > values.size // 100:  # then they are what it is made of
        return np.zeros(0, int)

    def alone(k: int) -> bool:
        near = np.concatenate([off[max(k - _NEAR, 0) : k], off[k + 1 : k + 1 + _NEAR]])
        return bool(off[k] > _ALONE * near.max())

    return high[[alone(int(k)) for k in high]]
