"""Whether a fitted receptance gives back more energy than it takes."""

import numpy as np

from .partial_fractions import Rational

# Places about each resonance, in half widths, and over all.
_ABOUT, _OVER = np.array([-5.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 5.0]), 400


def least_power(found: Rational) -> tuple[float, float]:
    """Of a receptance (k, k, m): the frequency (rad/s) at which it takes least, and how much, as part of what
    it yields there (largest singular value); negative where forces in some pattern are fed.

    A force `f exp(j w t)` brings in `w/2 f* P f`, P = j (H - H*)/2 (star: transposed and conjugate). It is
    looked for at some hundred frequencies, near all resonances among them: a narrow place may be missed."""
    sizes = np.abs(found.poles)
    about = np.imag(found.poles)[:, None] - np.real(found.poles)[:, None] * _ABOUT
    over = np.geomspace(1e-2 * sizes.min(), 10.0 * sizes.max(), _OVER)
    w = np.concatenate([over, about[np.imag(found.poles) > 0].ravel()])
    w = w[w > 0]
    H = np.moveaxis(found.at(1j * w), -1, 0)
    power = 0.5j * (H - np.conj(np.swapaxes(H, 1, 2)))
    share = np.linalg.eigvalsh(power)[:, 0] / np.linalg.norm(H, 2, axis=(1, 2))
    i = int(np.argmin(share))
    return float(w[i]), float(share[i])
