"""Spectra one after the other while the speed changes."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, positive, whole
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from . import checks
from .spectra import amplitudes

# Windows in a record, and samples in a window, at least, where none is asked for.
_WINDOWS, _SHORTEST = 20, 64


@shows(frequency="Hz", speed="rad/s", time="s")
class Waterfall(NamedTuple):
    """Spectra of consecutive windows: `frequency` (f,), Hz; `speed` (w,), rad/s, the mean in each window;
    `time` (w,), s, its middle from the first sample; `amplitude` (w, f), in the unit of the signal.

    With two signals it is full: frequencies from negative (backward) to positive, amplitudes are radii.
    """

    frequency: np.ndarray
    speed: np.ndarray
    time: np.ndarray
    amplitude: np.ndarray

    plot = plot_door()

    @property
    def full(self) -> bool:
        return bool(self.frequency[0] < 0)

    def along(self, order: float) -> np.ndarray:
        """(w,): the amplitude at the line nearest to so many times the speed; nan beyond the spectrum."""
        wanted = order * self.speed / (2 * np.pi)
        apart = self.frequency[1] - self.frequency[0]
        nearest = np.round((wanted - self.frequency[0]) / apart).astype(int)
        inside = (nearest >= 0) & (nearest < self.frequency.size)
        rows = np.arange(self.speed.size)
        return np.where(
            inside, self.amplitude[rows, nearest.clip(0, self.frequency.size - 1)], np.nan
        )


@takes(sample_rate=positive("Hz"), segment=whole(8), overlap=number(least=0.0, below=1.0))
def waterfall(
    x: Float[Array | np.ndarray, " n"],
    speed: Float[Array | np.ndarray, " n"],
    sample_rate: float,
    y: Float[Array | np.ndarray, " n"] | None = None,
    segment: int | None = None,
    overlap: float = 0.5,
    window: Any = "hann",
) -> Waterfall:
    """Spectra of consecutive windows of a run, with the speed of each.

    **Arguments:**

    - `x`: (nt,), a signal of any unit; with `y`, a second one at a right angle, the spectra are full ones
      (see `full_spectrum`).
    - `speed`: (nt,), rad/s, at the same samples.
    - `sample_rate`: Hz.
    - `segment`: samples in a window, by default a twentieth of the record (256 at least), or less where the
      speed changes so fast that order 1 would be smeared over more than two lines: it lasts no longer
      than sqrt(4 pi/acceleration) then. Lines lie sample_rate/segment apart.
    - `overlap`: the part of a window that the next one shares, from 0 to less than 1.
    - `window`: of `scipy.signal.get_window`.

    Each window's mean is taken out. While the speed changes by dW rad/s within a window, order k is smeared
    over k dW/(2 pi) Hz and shows too low: shorten the windows, or track orders. Raises `InputError`.
    """
    x = checks.signal(x, "x")
    values = x if y is None else x + 1j * checks.signal(y, "y", like=x)
    turning = checks.signal(speed, "speed", like=x)
    size = _suited(turning, sample_rate) if segment is None else segment
    if size > x.size:
        raise InputError(
            f"`segment`: must not exceed the record of {x.size} samples, but is {size}: shorten it"
        )
    hop = max(1, round((1 - overlap) * size))
    starts = np.arange(0, x.size - size + 1, hop)
    frames = np.lib.stride_tricks.sliding_window_view(values, size)[starts]
    frequency, found = amplitudes(frames, sample_rate, window)
    mean = np.lib.stride_tricks.sliding_window_view(turning, size)[starts].mean(axis=1)
    return Waterfall(frequency, mean, (starts + 0.5 * (size - 1)) / sample_rate, found)


def _suited(speed: np.ndarray, rate: float) -> int:
    """Samples in a window."""
    longest = max(256, speed.size // _WINDOWS)
    step = max(speed.size // _WINDOWS, 1)
    fastest = float(np.abs(speed[step:] - speed[:-step]).max()) * rate / step  # rad/s²
    if fastest > 0:
        longest = min(longest, int(np.sqrt(4 * np.pi / fastest) * rate))
    return max(min(max(longest, _SHORTEST), speed.size // 4), 8)
