"""The shaft's mean position while it runs up or down."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import positive, whole
from ..core.doors import plot_door
from ..core.gate import takes
from ..core.result_text import shows
from .orders import blocks_of
from .shaft_angle import with_pair


@shows()
class Centreline(NamedTuple):
    """Mean positions: `x`, `y` (b,), in the unit of the signals; `speed` (b,), rad/s; `time` (b,), s."""

    x: np.ndarray
    y: np.ndarray
    speed: np.ndarray
    time: np.ndarray

    plot = plot_door()


@takes(sample_rate=positive("Hz"), turns=whole(1))
def shaft_centreline(
    x: Float[Array | np.ndarray, " n"],
    y: Float[Array | np.ndarray, " n"],
    angle: Float[Array | np.ndarray, " n"],
    sample_rate: float,
    turns: int = 1,
) -> Centreline:
    """Mean position of the shaft over blocks of whole turns, with the speed of each: how it rises in its
    bearing while it runs up.

    The mean is over equal steps of the angle, so whole orders leave no trace in it. Arguments as for `orbit`;
    x and y are those that a DC-coupled probe sees, the bearing's centre at 0. Raises `InputError`. Source:
    Bently, Hatch, Fundamentals of Rotating Machinery Diagnostics (2002), ch. 6.
    """
    turning, xy = with_pair(x, y, angle, sample_rate)
    found = blocks_of(turning, xy, turns, turns)
    mean_x, mean_y = found.values.mean(axis=1).T
    return Centreline(mean_x, mean_y, found.speed, found.time)
