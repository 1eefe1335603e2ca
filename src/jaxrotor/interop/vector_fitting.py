"""Vector fitting: the common, stable poles of many frequency responses.

Sources: Gustavsen & Semlyen, IEEE Trans. Power Delivery 14 (1999) 1052 (the poles found anew as zeros of a
weight sigma); Gustavsen, ibid. 21 (2006) 1587 (sigma relaxed: its value far away is free, its mean is one,
for noisy responses); Deschrijver et al., IEEE Microw. Wireless Compon. Lett. 18 (2008) 383 (each response
eliminated by itself). Written from the papers.
"""

from typing import Any

import numpy as np

from .partial_fractions import basis, distinct, least_squares, stacked, state_space

# Poles that move by less than this part of the largest are found.
_SETTLED = 1e-10
# sigma's value far away, as part of its mean: below it nothing can be told from its zeros.
_LEAST = 1e-8


def starting_poles(frequencies: np.ndarray, count: int) -> np.ndarray:
    """Lightly damped pairs over the frequencies (rad/s), a real one for an odd count."""
    low = max(frequencies.min(), 1e-3 * frequencies.max())
    at = np.linspace(low, frequencies.max(), count // 2)
    return np.concatenate([pairs_at(at), [-frequencies.max() + 0j] * (count % 2)])


def pairs_at(at: Any) -> np.ndarray:
    """Conjugate pairs at these frequencies (rad/s), 1 % damped."""
    at = np.atleast_1d(at)
    return np.stack([-0.01 * at + 1j * at, -0.01 * at - 1j * at], axis=1).ravel()


def vector_fit(
    s: np.ndarray,
    responses: np.ndarray,
    weights: np.ndarray,
    poles: np.ndarray,
    beyond: np.ndarray,
    rounds: int = 25,
) -> np.ndarray:
    """The poles (m,) of `responses` (h, n) at s (n,) on the imaginary axis, from those given; `weights` as
    the responses. `beyond`: poles that stay where they are."""
    for _ in range(rounds):
        moved = _relocated(s, responses, weights, poles, beyond)
        settled = np.abs(moved - poles).max() <= _SETTLED * np.abs(poles).max()
        poles = moved
        if settled:
            break
    return poles


def _relocated(
    s: np.ndarray, responses: np.ndarray, weights: np.ndarray, poles: np.ndarray, beyond: np.ndarray
) -> np.ndarray:
    """The zeros of sigma = d + sum c / (s - poles), where `sigma response` has the poles that are given."""
    sigma, m = basis(s, poles), len(poles)
    sigma = np.concatenate([sigma, np.ones((len(s), 1))], axis=1)
    every = np.concatenate([sigma[:, :m], basis(s, beyond)], axis=1)
    own = stacked(distinct(weights)[..., None] * every, -2)
    Q, _ = np.linalg.qr(own / np.linalg.norm(own, axis=-2, keepdims=True))
    # what each response's own residues cannot take up
    right = stacked((weights * responses)[..., None] * sigma, -2)
    right = (right - Q @ (np.swapaxes(Q, -1, -2) @ right)).reshape(-1, m + 1)
    R: Any = np.linalg.qr(right, mode="r")
    # sigma is one in the mean, which forbids that all vanish
    scale = np.linalg.norm(weights * responses)
    mean = scale * np.mean(sigma.real, axis=0)
    found = least_squares(np.vstack([R, mean]), np.append(np.zeros(len(R)), scale))
    c, d = found[:m], found[m]
    d = np.copysign(max(abs(d), _LEAST), d)
    A, b = state_space(poles)
    zeros = np.linalg.eigvals(A - np.outer(b, c / d))
    zeros = np.where(zeros.real > 0, -zeros.conj(), zeros)  # an unstable one is mirrored
    return _paired(zeros)


def _paired(found: Any) -> np.ndarray:
    """By size, pairs side by side, exactly conjugate."""
    scale = np.abs(found)
    real = found[np.abs(found.imag) <= 1e-14 * scale].real
    upper = found[found.imag > 1e-14 * scale]
    upper = upper[np.argsort(upper.imag)]
    pairs = np.stack([upper, upper.conj()], axis=1).ravel()
    return np.concatenate([pairs, np.sort(real)[::-1] + 0j])
