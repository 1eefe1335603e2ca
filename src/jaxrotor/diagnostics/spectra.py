"""The full spectrum of an orbit: what whirls with the shaft apart from what whirls against it."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import positive
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from . import checks


@shows(frequency="Hz")
class FullSpectrum(NamedTuple):
    """`frequency`: (n,), Hz, from negative to positive; `amplitude`: (n,), the radius of the circle at each,
    in the unit of x and y, never negative.

    At +f stands what turns from x towards y, forward whirl of a shaft that turns towards +phi; at -f the
    contrary.
    """

    frequency: np.ndarray
    amplitude: np.ndarray

    plot = plot_door()

    def peak(self, low: float, high: float) -> tuple[float, float]:
        """Frequency (Hz) and amplitude of the highest line from `low` to `high`. Raises `InputError`
        where no line lies there."""
        inside = np.flatnonzero((self.frequency >= low) & (self.frequency <= high))
        if not inside.size:
            lines = self.frequency
            raise InputError(
                f"`low`: no line lies from {low:g} to {high:g} Hz: lines are {lines[1] - lines[0]:.3g} Hz "
                f"apart from {lines[0]:.4g} to {lines[-1]:.4g} Hz"
            )
        k = inside[np.argmax(self.amplitude[inside])]
        return float(self.frequency[k]), float(self.amplitude[k])


@takes(sample_rate=positive("Hz"))
def full_spectrum(
    x: Float[Array | np.ndarray, " n"],
    y: Float[Array | np.ndarray, " n"],
    sample_rate: float,
    window: Any = "hann",
) -> FullSpectrum:
    """Amplitudes of the circles that an orbit is made of: of x + i y = sum of r e^(2 pi i f t).

    **Arguments:** `x`, `y`: (nt,), displacements in two directions a right angle apart, one unit, at
    `sample_rate` (Hz). `window`: of `scipy.signal.get_window`.

    A circle of radius r run through at f from x towards y stands as r at +f, the other way round at -f; a
    straight vibration of amplitude a as a/2 at both; an ellipse's semi-axes are the sum and the difference of
    the two. The mean is taken out, so that weight does not hide what is slow.

    Amplitudes are exact for what has a whole number of periods in the record; halfway between two lines
    `"hann"` shows 15 % too little, `"flattop"` 0.1 % (and spreads over nine lines instead of four). Raises
    `InputError` for signals that are not finite or differ in length.

    Sources: Southwick, Using full spectrum plots, Orbit 14 (1993); Bently, Hatch, Fundamentals of Rotating
    Machinery Diagnostics (2002), ch. 8.
    """
    x = checks.signal(x, "x")
    y = checks.signal(y, "y", like=x)
    return FullSpectrum(*amplitudes(x + 1j * y, sample_rate, window))


def amplitudes(
    frames: np.ndarray, sample_rate: float, window: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (k,), Hz, and amplitudes (..., k) of `frames` (..., n): of complex ones from negative to
    positive, each the radius of a circle; of real ones from 0 on, each the amplitude of a cosine."""
    rate = sample_rate
    size = frames.shape[-1]
    weights = checks.window(window, size)
    weights = weights / weights.sum()
    centred = weights * (frames - (frames @ weights)[..., None])
    if np.iscomplexobj(frames):
        lines = np.fft.fftshift(np.fft.fftfreq(size, 1 / rate))
        return lines, np.abs(np.fft.fftshift(np.fft.fft(centred), axes=-1))
    found = 2 * np.abs(np.fft.rfft(centred))
    if size % 2 == 0:
        found[..., -1] /= 2  # half of the sample rate stands for itself alone
    return np.fft.rfftfreq(size, 1 / rate), found
