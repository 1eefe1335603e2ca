"""What each mode is: which way it whirls, what moves in it, and its name."""

from typing import NamedTuple

import numpy as np

from ..arguments import whole
from ..gate import takes
from .linearise import LinearModel
from .lowest import lowest

# Below this share of circularity a whirl counts as to and fro in one plane.
_STRAIGHT = 1e-3


class Mode(NamedTuple):
    """One oscillating mode.

    - `name`: "1 forward", "1 backward", "torsional 1", "axial 1", ...
    - `frequency`: Im lambda, rad/s; `damping_ratio`; `log_decrement`; `eigenvalue`, 1/s.
    - `kind`: "lateral", "torsional" or "axial", by its share of the kinetic energy; `shares` has all three.
    - `whirl`: 1 forward (with the spin), -1 backward, 0 to and fro. Between: how circular its orbits are,
      weighed by energy.
    - `shape`: (n,) complex over the model's coordinates, the largest entry 1.
    """

    name: str
    frequency: float
    damping_ratio: float
    log_decrement: float
    eigenvalue: complex
    kind: str
    shares: dict[str, float]
    whirl: float
    shape: np.ndarray


@takes(count=whole(1))
def modes(model: LinearModel, count: int | None = None) -> list[Mode]:
    """The oscillating modes by rising natural frequency, named; `count`: the lowest only (quicker where
    the model is large). Not for use under `jit`, nor differentiable: for derivatives take
    `model.natural_frequencies`, which has the same order."""
    return named(model, *lowest(model, count))


def named(model: LinearModel, values: np.ndarray, shapes: np.ndarray) -> list[Mode]:
    """Eigenvalues (m,) and shapes (n, m) as modes, counted and named in this order."""
    shares, whirl = describe(model, shapes)
    counts: dict[str, int] = {}
    out = []
    for k, value in enumerate(values):
        each = {name: float(share[k]) for name, share in shares.items()}
        kind = max(each, key=lambda s: each[s])
        turning = float(whirl[k]) if kind == "lateral" else 0.0
        word = kind
        if kind == "lateral" and abs(turning) > _STRAIGHT:
            word = "forward" if turning > 0 else "backward"
        counts[word] = counts.get(word, 0) + 1
        name = f"{counts[word]} {word}" if kind == "lateral" else f"{word} {counts[word]}"
        out.append(
            Mode(
                name,
                float(value.imag),
                float(-value.real / abs(value)),
                float(-2 * np.pi * value.real / value.imag),
                complex(value),
                kind,
                each,
                turning,
                shapes[:, k],
            )
        )
    return out


def describe(model: LinearModel, shapes: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Of shapes (n, m): shares of kinetic energy, and the whirl, -1 to 1, positive with the spin."""
    coordinate = np.array([c for _, c in model.coordinates])
    M = np.asarray(model.M)
    energy = np.real(np.conj(shapes) * (M @ shapes))
    total = energy.sum(axis=0)
    parts = {
        "lateral": np.isin(coordinate, ("x", "y", "psi", "theta")),
        "axial": coordinate == "z",
        "torsional": coordinate == "phi",
    }
    shares = {name: energy[rows].sum(axis=0) / total for name, rows in parts.items()}
    sense = np.where(np.asarray(model.spins) < 0, -1.0, 1.0)
    return shares, whirl_of(model.coordinates, np.abs(np.diag(M)), shapes, sense)


def whirl_of(
    coordinates: tuple[tuple[str, str], ...],
    weight: np.ndarray,
    shapes: np.ndarray,
    sense: np.ndarray,
) -> np.ndarray:
    """How circular the orbits of shapes (n, m) are, weighed by `weight` (n,): -1 to 1, positive in the
    `sense` (n,) of each station's spin, 1 for counter-clockwise."""
    one, other, sign = _planes(coordinates)
    a, b = shapes[one], sign[:, None] * shapes[other]
    weight = weight[one][:, None]
    # x = Re X e^{iwt}, y = Re Y e^{iwt}: counter-clockwise where Y lags X by a quarter
    turning = np.sum(-2 * weight * sense[one][:, None] * np.imag(np.conj(a) * b), axis=0)
    size = np.sum(weight * (np.abs(a) ** 2 + np.abs(b) ** 2), axis=0)
    return np.divide(turning, size, out=np.zeros_like(turning), where=size > 0)


def _planes(
    coordinates: tuple[tuple[str, str], ...],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows that belong together in the two planes, x with y and theta with -psi (for dx/dz = theta,
    dy/dz = -psi), and the sign of the second."""
    index = {c: i for i, c in enumerate(coordinates)}
    pairs = [
        (i, index[station, partner], sign)
        for (station, c), i in index.items()
        for first, partner, sign in (("x", "y", 1.0), ("theta", "psi", -1.0))
        if c == first and (station, partner) in index
    ]
    found = np.array(pairs).reshape(-1, 3)
    return found[:, 0].astype(int), found[:, 1].astype(int), found[:, 2]


def table(found: list[Mode]) -> str:
    """Modes as lines of text: name, frequencies, damping, energy, whirl."""
    rows = [("mode", "rad/s", "Hz", "damping ratio", "log decrement", "whirl", "energy")]
    for mode in found:
        shares = ", ".join(f"{100 * v:.0f} % {k}" for k, v in mode.shares.items() if v > 0.005)
        whirl = f"{mode.whirl:+.2f}" if mode.kind == "lateral" else "-"
        rows.append(
            (
                mode.name,
                f"{mode.frequency:.6g}",
                f"{mode.frequency / (2 * np.pi):.6g}",
                f"{mode.damping_ratio:.3g}",
                f"{mode.log_decrement:.3g}",
                whirl,
                shares,
            )
        )
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths)).rstrip() for row in rows]
    return "\n".join([lines[0], "-" * max(map(len, lines)), *lines[1:]])
