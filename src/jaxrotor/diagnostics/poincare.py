"""Poincaré sections: the motion seen once a turn."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, positive, whole
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from . import checks
from .shaft_angle import Turning


@shows(time="s")
class PoincareSection(NamedTuple):
    """Points of the phase plane, one a turn: `x`, `v` (k,), in the units of the signals; `time` (k,), s from
    the first sample; `size` (2,), half the range of each signal over the whole record."""

    x: np.ndarray
    v: np.ndarray
    time: np.ndarray
    size: np.ndarray

    plot = plot_door()

    def period(self, tolerance: float = 1e-3, longest: int = 16) -> int:
        """After how many turns the points repeat, to `tolerance` of the signals' `size`; 0 where
        not within `longest` (quasi-periodic, chaotic, or not settled yet)."""
        points = np.stack([self.x, self.v])
        size = np.where(self.size > 0, self.size, 1.0)[:, None]
        return period_of(points / size, tolerance, longest)


@takes(tolerance=positive(), longest=whole(1))
def period_of(points: np.ndarray, tolerance: float, longest: int) -> int:
    """Of scaled points (m, k): least p for which all points agree with those p turns later."""
    for p in range(1, min(longest, points.shape[1] // 2) + 1):
        if np.abs(points[:, p:] - points[:, :-p]).max() <= tolerance:
            return p
    return 0


@takes(sample_rate=positive("Hz"), phase=number("rad"), every=whole(1))
def poincare(
    x: Float[Array | np.ndarray, " n"],
    v: Float[Array | np.ndarray, " n"],
    angle: Float[Array | np.ndarray, " n"],
    sample_rate: float,
    phase: float = 0.0,
    every: int = 1,
) -> PoincareSection:
    """Stroboscopic section: `x` and `v` where the shaft's angle is 2 pi k + `phase`.

    **Arguments:** `x`, `v`: (nt,), two quantities such as `run["disc"].x` and `run["disc"].velocity[:, 0]`;
    `angle`: (nt,), rad, of the shaft, never turning back; `sample_rate`: Hz; `phase`: rad; `every`: turns
    from point to point.

    Angle and signals are quintic splines between samples: right to 3e-6 of their amplitude with 10 samples in
    a period of the fastest component. Cut the transient off before. Raises `InputError` for fewer than two
    points. Source: Guckenheimer, Holmes, Nonlinear Oscillations (1983), 1.5.
    """
    turning = Turning(angle, sample_rate)
    both = [checks.signal(s, name, like=turning.angle) for s, name in ((x, "x"), (v, "v"))]
    marks = turning.marks(phase)[::every]
    if marks.size < 2:
        raise InputError(
            f"`every`: must leave two points at least, but {every} leaves {marks.size}: run longer"
        )
    at = turning.instants(marks)
    size = 0.5 * np.ptp(both, axis=1)
    places = turning.at(np.stack(both, axis=1), at)
    return PoincareSection(places[:, 0], places[:, 1], at, size)
