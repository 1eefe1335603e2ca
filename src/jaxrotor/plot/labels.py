"""Labels that hide neither each other nor the data."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

# Between the points of a path that is made dense.
_STEP = 0.01
_TURNS = {"rad/s": (30 / np.pi, "rpm"), "rad": (180 / np.pi, "°")}


def number(x: float) -> str:
    """Four digits, or all before the point where there are some more."""
    return f"{x:.4g}" if abs(x) < 1e4 or abs(x) >= 1e7 else f"{x:.0f}"


def together(places: Sequence[float], close: float) -> list[list[int]]:
    """Numbers of the rising `places` in groups, in each of which neighbours are closer than that."""
    out: list[list[int]] = []
    for k, place in enumerate(places):
        if out and place - places[out[-1][-1]] < close:
            out[-1].append(k)
        else:
            out.append([k])
    return out


def rows(centres: Sequence[float], widths: Sequence[float]) -> list[int]:
    """The lowest row for each label, left to right, in which it touches none before it."""
    ends: list[float] = []
    out = []
    for centre, width in zip(centres, widths):
        row = next((k for k, end in enumerate(ends) if end < centre - width / 2), len(ends))
        ends[row : row + 1] = [centre + width / 2]
        out.append(row)
    return out


def nice_multiples(low: float, high: float, about: int = 40) -> np.ndarray:
    """About so many round numbers from `low` to `high`, the roundest first."""
    if not high > low:
        return np.array([low])
    wanted = (high - low) / about
    power = 10.0 ** np.floor(np.log10(wanted))
    step = next(s * power for s in (1, 2, 5, 10) if s * power >= wanted)
    count = np.arange(np.ceil(low / step), np.floor(high / step) + 1)
    roundness = sum((count % k == 0).astype(int) for k in (2, 5, 10, 20, 50))
    return step * count[np.argsort(-roundness, kind="stable")]


def dense(path: np.ndarray) -> np.ndarray:
    """Points (complex) along a path, so near to each other that no label fits between them."""
    gaps = np.ceil(np.abs(np.diff(path)) / _STEP)
    ends = np.concatenate([[0.0], np.cumsum(np.maximum(gaps, 1.0))])
    return np.interp(np.arange(ends[-1] + 1), ends, path)


class Room:
    """What is free of a circle in the complex plane: rectangles are taken one after the other."""

    def __init__(self, points: np.ndarray, within: float):
        """`points` are to stay visible; rectangles lie in the circle of radius `within`."""
        self._points, self._within = points, within
        self._taken: list[tuple[complex, complex]] = []

    def take(self, at: complex, size: tuple[float, float], gap: float) -> complex | None:
        """Centre of a free rectangle `gap` away from `at`, taken from now on, or None: outwards from
        the origin if that is free."""
        half = complex(*size) / 2
        for away in (gap, 3 * gap):
            for turn in (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 7, -7, 8):
                way = np.exp(1j * (np.angle(at) + turn * np.pi / 8))
                reach = (half.real + away) / max(abs(way.real), 1e-9)
                far = min(reach, (half.imag + away) / max(abs(way.imag), 1e-9))
                centre = complex(at + far * way)
                if self._free(centre, half):
                    self._taken.append((centre, half))
                    return centre
        return None

    def block(self, centre: complex, size: tuple[float, float]) -> None:
        self._taken.append((complex(centre), complex(*size) / 2))

    def _free(self, centre: complex, half: complex) -> bool:
        if abs(complex(abs(centre.real) + half.real, abs(centre.imag) + half.imag)) > self._within:
            return False
        if np.any(_inside(self._points - centre, half)):
            return False
        return not any(_inside(c - centre, half + h) for c, h in self._taken)


def _inside(offsets: Any, half: complex) -> Any:
    return (np.abs(np.real(offsets)) < half.real) & (np.abs(np.imag(offsets)) < half.imag)


def readable(unit: str, values: Any) -> tuple[float, str]:
    """By what to multiply SI values to read them well, and their unit then: speeds in rpm, angles in degrees,
    lengths in mm or µm as they need."""
    from .design import _prefixed

    if unit in _TURNS:
        return _TURNS[unit]
    sizes = np.abs(np.asarray(values, float))
    top = float(np.max(sizes[np.isfinite(sizes)], initial=0.0))
    # a prefix before kilograms, or before a power (mm² for 1e-3 m²), would mislead
    if re.match(r"\(?(kg|[A-Za-z]+\)?(\*\*|\^))", unit):
        return 1.0, _dots(unit)
    size, words = _prefixed(unit, top)
    return size, _dots(words)


def _dots(unit: str) -> str:
    unit = unit.replace("(rad)", "rad")
    return unit.replace("**2", "²").replace("^2", "²").replace("^3", "³").replace("*", "·")
