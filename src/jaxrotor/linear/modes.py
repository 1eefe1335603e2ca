"""What each mode is: which way it whirls, what moves in it, and its name."""

from typing import NamedTuple

import numpy as np

from .linearise import LinearModel

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


def modes(model: LinearModel, count: int | None = None) -> list[Mode]:
    """The oscillating modes by rising frequency, named. Not for use under `jit`."""
    values = np.asarray(model.eigenvalues)
    shapes = np.asarray(model.mode_shapes)
    M = np.asarray(model.M)
    sense = 1.0 if float(model.speed) >= 0 else -1.0
    found = []
    for k in np.flatnonzero(np.asarray(model.damped_frequencies) > 0):
        shares, whirl = describe(model, M, shapes[:, k])
        kind = max(shares, key=lambda s: shares[s])
        value = complex(values[k])
        found.append(
            (kind, sense * whirl if kind == "lateral" else 0.0, shares, value, shapes[:, k])
        )
    counts: dict[str, int] = {}
    out = []
    for kind, whirl, shares, value, shape in found:
        word = kind
        if kind == "lateral" and abs(whirl) > _STRAIGHT:
            word = "forward" if whirl > 0 else "backward"
        counts[word] = counts.get(word, 0) + 1
        number = counts[word]
        name = f"{number} {word}" if kind == "lateral" else f"{word} {number}"
        size = abs(value)
        out.append(
            Mode(
                name,
                value.imag,
                -value.real / size,
                -2 * np.pi * value.real / value.imag,
                value,
                kind,
                shares,
                whirl,
                shape,
            )
        )
        if count is not None and len(out) == count:
            break
    return out


def describe(
    model: LinearModel, M: np.ndarray, shape: np.ndarray
) -> tuple[dict[str, float], float]:
    """Shares of kinetic energy, and the whirl's direction (-1 to 1, counter-clockwise positive)."""
    coordinate = np.array([c for _, c in model.coordinates])
    energy = np.real(np.conj(shape) * (M @ shape))
    total = energy.sum()
    parts = {
        "lateral": np.isin(coordinate, ("x", "y", "psi", "theta")),
        "axial": coordinate == "z",
        "torsional": coordinate == "phi",
    }
    shares = {name: float(energy[rows].sum() / total) for name, rows in parts.items()}
    index = {c: i for i, c in enumerate(model.coordinates)}
    turning = size = 0.0
    for (station, c), i in index.items():
        j = index.get((station, {"x": "y", "theta": "psi"}.get(c, "")))
        if j is None:
            continue
        # x = Re X e^{iwt}, y = Re Y e^{iwt}: counter-clockwise where Y lags X by a quarter; the slopes
        # dx/dz = theta, dy/dz = -psi turn likewise
        other = shape[j] if c == "x" else -shape[j]
        weight = np.abs(M[i, i])
        turning += -2 * weight * np.imag(np.conj(shape[i]) * other)
        size += weight * (abs(shape[i]) ** 2 + abs(other) ** 2)
    return shares, float(turning / size) if size else 0.0


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
