"""Poles by the sum of squares itself, which vector fitting, that minimises a weighted one, only comes near.

Gauss-Newton steps, the residues eliminated: variable projection (Golub & Pereyra, Inverse Problems 19 (2003)
R1), with Kaufman's simpler slope (BIT 15 (1975) 49), damped as by Levenberg and Marquardt.
"""

from typing import NamedTuple

import numpy as np

from .partial_fractions import basis, distinct, heads, stacked, steep

_STEPS = 40


class _Look(NamedTuple):
    """The sum of squares at some poles, its slope and curvature (halved) over their parameters."""

    left: float
    slope: np.ndarray
    curve: np.ndarray


def polished(
    s: np.ndarray,
    responses: np.ndarray,
    weights: np.ndarray,
    poles: np.ndarray,
    beyond: np.ndarray,
    enough: float = 1e-13,
) -> np.ndarray:
    """Poles (m,) near those given where the sum of squares is least, all stable. Arguments as of
    `vector_fit`. `enough`: the part of the sum by which a step must lower it to be followed by another."""
    at = _parameters(poles)
    here = _look(s, responses, weights, poles, beyond)
    damping = 1e-3
    for _ in range(_STEPS):
        size = np.diag(here.curve) + 1e-300
        step = np.linalg.solve(here.curve + damping * np.diag(size), here.slope)
        tried = _poles(at + step, poles)
        if tried is None:
            damping *= 10.0
        else:
            there = _look(s, responses, weights, tried, beyond)
            if there.left < here.left:
                gain = 1.0 - there.left / here.left
                at, poles, here = at + step, tried, there
                damping = max(damping / 10.0, 1e-12)
                if gain < enough:
                    break
                continue
            damping *= 10.0
        if damping > 1e6:
            break
    return poles


def _parameters(poles: np.ndarray) -> np.ndarray:
    """Real part, and of a pair the imaginary one."""
    out = []
    for k in heads(poles):
        out += [poles[k].real] + ([poles[k].imag] if poles[k].imag else [])
    return np.array(out)


def _poles(at: np.ndarray, like: np.ndarray) -> np.ndarray | None:
    """None where one of them is not stable."""
    out = like.copy()
    for k in heads(like):
        if like[k].imag:
            out[k], out[k + 1] = at[k] + 1j * at[k + 1], at[k] - 1j * at[k + 1]
            if at[k + 1] <= 0:
                return None
        else:
            out[k] = at[k]
    return out if np.all(np.real(out) < 0) else None


def _slopes(s: np.ndarray, poles: np.ndarray) -> list[list[tuple[int, np.ndarray]]]:
    """Of each parameter: which columns of the basis it changes, and how."""
    out = []
    for k in heads(poles):
        one = 1.0 / (s - poles[k]) ** 2
        if poles[k].imag == 0:
            out.append([(k, one)])
            continue
        other = 1.0 / (s - poles[k + 1]) ** 2
        total, apart = one + other, 1j * (one - other)
        out += [[(k, total), (k + 1, apart)], [(k, apart), (k + 1, -total)]]
    return out


def _look(
    s: np.ndarray, responses: np.ndarray, weights: np.ndarray, poles: np.ndarray, beyond: np.ndarray
) -> _Look:
    every = np.concatenate([poles, beyond])
    columns, free, slopes = basis(s, every), steep(every), _slopes(s, poles)
    own = distinct(weights)
    matrix = stacked(own[..., None] * columns, -2) @ free
    size = np.linalg.norm(matrix, axis=-2, keepdims=True)
    Q, R = np.linalg.qr(matrix / size)
    y = stacked(weights * responses, -1)[..., None]
    inside = np.swapaxes(Q, -1, -2) @ y
    rest = (y - Q @ inside)[..., 0]
    factors = (free @ (np.linalg.solve(R, inside) / np.swapaxes(size, -1, -2)))[..., 0]
    moves = [sum(factors[:, k, None] * (weights * x) for k, x in each) for each in slopes]
    J = stacked(np.stack(moves, axis=-1), -2)
    J = J - Q @ (np.swapaxes(Q, -1, -2) @ J)
    J, rest = J.reshape(-1, J.shape[-1]), rest.ravel()
    return _Look(float(rest @ rest), J.T @ rest, J.T @ J)
