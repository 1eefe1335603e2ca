"""Vector fitting: a rational function with common, stable poles through many frequency responses.

Sources: Gustavsen & Semlyen, IEEE Trans. Power Delivery 14 (1999) 1052 (the poles found anew as zeros of a
weight sigma); Deschrijver et al., IEEE Microw. Wireless Compon. Lett. 18 (2008) 383 (each response
eliminated by itself). Written from the papers.
"""

from typing import Any, NamedTuple

import numpy as np

# Poles that move by less than this part of the largest are found.
_SETTLED = 1e-10


class Rational(NamedTuple):
    """`sum residues / (s - poles)`: (m,), and (..., m); conjugate pairs stand side by side, the positive
    imaginary part first."""

    poles: np.ndarray
    residues: np.ndarray

    def at(self, s: np.ndarray) -> np.ndarray:
        return self.residues @ (1.0 / (s - self.poles[:, None]))


def starting_poles(frequencies: np.ndarray, count: int) -> np.ndarray:
    """Lightly damped pairs over the frequencies (rad/s), a real one for an odd count."""
    low = max(frequencies.min(), 1e-3 * frequencies.max())
    at = np.linspace(low, frequencies.max(), count // 2)
    pairs = np.stack([-0.01 * at + 1j * at, -0.01 * at - 1j * at], axis=1).ravel()
    return np.concatenate([pairs, [-frequencies.max() + 0j] * (count % 2)])


def vector_fit(
    s: np.ndarray, responses: np.ndarray, weights: np.ndarray, count: int, rounds: int = 25
) -> Rational:
    """Through `responses` (h, n) at s (n,) on the imaginary axis, `weights` alike; falls off with 1/s² or
    faster (the residues sum to zero)."""
    poles = starting_poles(s.imag, count)
    for _ in range(rounds):
        moved = _relocated(s, responses, weights, poles)
        settled = np.abs(moved - poles).max() <= _SETTLED * np.abs(poles).max()
        poles = moved
        if settled:
            break
    return Rational(poles, _residues(s, responses, weights, poles))


def _basis(s: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """(n, m): of a pair the sum of both fractions and i times their difference, whose factors are real."""
    fractions = 1.0 / (s[:, None] - poles)
    out, k = np.zeros_like(fractions), 0
    while k < len(poles):
        if poles[k].imag == 0:
            out[:, k] = fractions[:, k]
            k += 1
        else:
            out[:, k] = fractions[:, k] + fractions[:, k + 1]
            out[:, k + 1] = 1j * (fractions[:, k] - fractions[:, k + 1])
            k += 2
    return out


def _real(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x.real, x.imag])


def _scaled(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Least squares with columns of one size."""
    size = np.linalg.norm(matrix, axis=0)
    size = np.where(size > 0, size, 1.0)
    return np.linalg.lstsq(matrix / size, right, rcond=None)[0] / size[:, None]


def _relocated(
    s: np.ndarray, responses: np.ndarray, weights: np.ndarray, poles: np.ndarray
) -> np.ndarray:
    """The zeros of sigma = 1 + sum c / (s - poles), where `sigma response` has the poles that are given."""
    basis, m = _basis(s, poles), len(poles)
    own = weights[..., None] * basis
    parts = [own, -own * responses[..., None], (weights * responses)[..., None]]
    stacked = np.concatenate(parts, axis=-1)
    stacked = np.concatenate([stacked.real, stacked.imag], axis=1)
    # each response's own unknowns are eliminated: the lower rows of R hold the common ones and the right side
    size = np.linalg.norm(stacked[..., :m], axis=1, keepdims=True)
    stacked[..., :m] /= np.where(size > 0, size, 1.0)
    triangle: Any = np.linalg.qr(stacked, mode="r")
    R = triangle[:, m : 2 * m + 1, m:].reshape(-1, m + 1)
    c = _scaled(R[:, :m], R[:, m:])[:, 0]
    A, b = _diagonal(poles)
    found = np.linalg.eigvals(A - np.outer(b, c))
    found = np.where(found.real > 0, -found.conj(), found)  # an unstable one is mirrored
    return _paired(found)


def _diagonal(poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A and b of the basis as a real state space."""
    A, b, k = np.zeros((len(poles),) * 2), np.ones(len(poles)), 0
    while k < len(poles):
        real, imag = poles[k].real, poles[k].imag
        if imag == 0:
            A[k, k] = real
            k += 1
        else:
            A[k : k + 2, k : k + 2] = [[real, imag], [-imag, real]]
            b[k : k + 2] = 2.0, 0.0
            k += 2
    return A, b


def _paired(found: Any) -> np.ndarray:
    """By size, pairs side by side, exactly conjugate."""
    scale = np.abs(found)
    real = found[np.abs(found.imag) <= 1e-14 * scale].real
    upper = found[found.imag > 1e-14 * scale]
    upper = upper[np.argsort(upper.imag)]
    pairs = np.stack([upper, upper.conj()], axis=1).ravel()
    return np.concatenate([pairs, np.sort(real)[::-1] + 0j])


def _residues(
    s: np.ndarray, responses: np.ndarray, weights: np.ndarray, poles: np.ndarray
) -> np.ndarray:
    """(h, m), that sum to zero."""
    basis = _basis(s, poles)
    _, b = _diagonal(poles)
    # what the factors of the basis may be: at right angles to what they sum up to
    free = np.linalg.svd(b[None, :])[2][1:].T
    out = np.zeros((len(responses), len(poles)), complex)
    for row, response, weight in zip(out, responses, weights):
        factors = free @ _scaled(
            _real(weight[:, None] * basis) @ free, _real(weight * response)[:, None]
        )
        factors, k = factors[:, 0], 0
        while k < len(poles):
            if poles[k].imag == 0:
                row[k] = factors[k]
                k += 1
            else:
                row[k : k + 2] = factors[k] + 1j * factors[k + 1], factors[k] - 1j * factors[k + 1]
                k += 2
    return out
