"""Sums of partial fractions with common poles, as bases of real factors."""

from typing import NamedTuple

import numpy as np


class Rational(NamedTuple):
    """`sum residues / (s - poles)`: (m,), and (..., m); conjugate pairs stand side by side, the positive
    imaginary part first."""

    poles: np.ndarray
    residues: np.ndarray

    def at(self, s: np.ndarray) -> np.ndarray:
        return self.residues @ (1.0 / (s - self.poles[:, None]))


def heads(poles: np.ndarray) -> list[int]:
    """Where each real pole stands, and the first of each pair."""
    found, k = [], 0
    while k < len(poles):
        found.append(k)
        k += 1 if poles[k].imag == 0 else 2
    return found


def basis(s: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """(n, m): of a pair the sum of both fractions and i times their difference, whose factors are real."""
    out = 1.0 / (s[:, None] - poles)
    for k in heads(poles):
        if poles[k].imag:
            one, other = out[:, k].copy(), out[:, k + 1].copy()
            out[:, k], out[:, k + 1] = one + other, 1j * (one - other)
    return out


def state_space(poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A (m, m) and b (m,) of the basis as a real state space; b is also what its columns fall off by: `s`
    times them, for s without bounds."""
    A, b = np.zeros((len(poles),) * 2), np.ones(len(poles))
    for k in heads(poles):
        real, imag = poles[k].real, poles[k].imag
        if imag == 0:
            A[k, k] = real
        else:
            A[k : k + 2, k : k + 2] = [[real, imag], [-imag, real]]
            b[k : k + 2] = 2.0, 0.0
    return A, b


def steep(poles: np.ndarray) -> np.ndarray:
    """(m, m - 1), orthonormal: combinations of the basis that fall off with 1/s² or faster."""
    return np.linalg.svd(state_space(poles)[1][None])[2][1:].T


def residues_of(poles: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """From the factors (h, m) of the basis."""
    out = factors.astype(complex)
    for k in heads(poles):
        if poles[k].imag:
            out[:, k] = factors[:, k] + 1j * factors[:, k + 1]
            out[:, k + 1] = out[:, k].conj()
    return out


def stacked(x: np.ndarray, axis: int = 0) -> np.ndarray:
    """Real parts, then imaginary ones, along an axis."""
    return np.concatenate([np.real(x), np.imag(x)], axis=axis)


def distinct(weights: np.ndarray) -> np.ndarray:
    """One row where all are the same, so that all is done once."""
    return weights[:1] if np.all(weights == weights[:1]) else weights


def least_squares(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """With columns of one size."""
    size = np.linalg.norm(matrix, axis=0)
    size = np.where(size > 0, size, 1.0)
    return (np.linalg.lstsq(matrix / size, right, rcond=None)[0].T / size).T


def fitted(
    s: np.ndarray, responses: np.ndarray, weights: np.ndarray, poles: np.ndarray
) -> Rational:
    """The residues (h, m), which sum to zero, of responses (h, n) by least squares."""
    columns, free = basis(s, poles), steep(poles)
    own = distinct(weights)
    right = np.array_split(stacked(weights * responses, 1), len(own))
    found = [
        (free @ least_squares(stacked(weight[:, None] * columns) @ free, some.T)).T
        for weight, some in zip(own, right)
    ]
    return Rational(poles, residues_of(poles, np.concatenate(found)))
