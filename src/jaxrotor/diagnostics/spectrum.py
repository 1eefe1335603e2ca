"""Spectra of sampled signals."""

import numpy as np
import scipy.signal

from ..core.errors import InputError


def power_spectral_density(
    signal, sample_rate: float, segment: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """One-sided power spectral density by Welch's method (Hann window, means removed).

    **Arguments:** `signal`: (nt,), any unit; `sample_rate`: Hz; `segment`: samples in each of the
    half-overlapping pieces, by default an eighth of the signal.

    **Returns:** frequencies (Hz) and density (unit²/Hz), whose integral is the signal's variance.

    Raises `InputError` for a signal that is too short or not finite. Source: Welch, IEEE Trans. Audio
    Electroacoust. 15 (1967) 70.
    """
    values = np.asarray(signal, float)
    if values.ndim != 1 or values.size < 16:
        raise InputError(
            f"a spectrum needs a signal of 16 samples at least, but this has shape {values.shape}: "
            "run longer or sample faster"
        )
    if not np.isfinite(values).all():
        raise InputError(
            f"the signal is not finite at sample {int(np.argmin(np.isfinite(values)))}: cut it there"
        )
    length = max(16, values.size // 8) if segment is None else segment
    return scipy.signal.welch(values, fs=sample_rate, nperseg=min(length, values.size))
