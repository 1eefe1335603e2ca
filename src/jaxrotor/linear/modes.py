"""What each mode is: which way it whirls, what moves in it, and its name."""

import warnings
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg

from ..core.arguments import whole
from ..core.gate import takes
from ..core.result_text import HERTZ, shows, table_of
from .divergence import warn_of_divergence
from .linearise import LinearModel
from .lowest_modes import lowest

# Below this share of circularity a whirl has no sense worth a name.
STRAIGHT = 0.1
# Modes whose eigenvalues differ by less than this part are one: any mixture of their shapes is a mode too.
_TOGETHER = 1e-7
# Of the energy, beyond which a mode at rest swings in one plane.
_PLANE = 0.6


@shows(without=("log_decrement", "eigenvalue", "shares", "shape"), frequency=HERTZ)
class Mode(NamedTuple):
    """One oscillating mode.

    - `name`: "1 forward", "1 backward", "1 mixed" (nearly straight orbits), "torsional 1", "axial 1"; at
      rest, where no whirl has a sense, "1 lateral x" or "1 lateral y" by the plane.
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
    `model.natural_frequencies`, which has the same order. Raises `InputError` where `model` is no
    `LinearModel`, or `count` is below 1. Warns where the machine leaves its position without swinging (it has
    buckled), which is no mode, and where coefficients over whirl frequency are held at the spin's."""
    warn_of_divergence(model)
    if model.of_whirl:
        warnings.warn(
            f"`{model.of_whirl[0]}`: its coefficients over whirl frequency are those of the spin's own here; "
            "`jr.linear.matched_modes(machine, speed)` gives each mode those of its own frequency",
            stacklevel=2,
        )
    return named(model, *lowest(model, count))


def named(model: LinearModel, values: np.ndarray, shapes: np.ndarray) -> list[Mode]:
    """Eigenvalues (m,) and shapes (n, m) as modes, counted and named in this order."""
    shapes = told_apart(model, values, shapes)
    shares, whirl = describe(model, shapes)
    turning = bool(np.any(np.asarray(model.spins)))
    upright = _upright(model, shapes)
    counts: dict[str, int] = {}
    out = []
    for k, value in enumerate(values):
        each = {name: float(share[k]) for name, share in shares.items()}
        kind = max(each, key=lambda s: each[s])
        sense = float(whirl[k]) if kind == "lateral" else 0.0
        word = kind
        if kind == "lateral":
            word = word_of(sense) if turning else _plane_of(float(upright[k]))
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
                sense,
                shapes[:, k],
            )
        )
    return out


def word_of(whirl: float) -> str:
    """What a lateral mode of a turning machine is called."""
    return "mixed" if abs(whirl) <= STRAIGHT else "forward" if whirl > 0 else "backward"


def _plane_of(upright: float) -> str:
    if upright > _PLANE:
        return "lateral y"
    return "lateral x" if upright < 1 - _PLANE else "mixed"


def told_apart(model: LinearModel, values: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """The shapes (n, m), those of coincident modes mixed so that each is of one kind: circling one way where
    the machine turns, in one plane where it rests. What a solver gives there is rounding."""
    shapes = np.array(shapes)
    marks = _marks(model)
    M = np.asarray(model.M)
    done = np.zeros(len(values), bool)
    for k in range(len(values)):
        alike = np.flatnonzero(~done & (np.abs(values - values[k]) <= _TOGETHER * abs(values[k])))
        done[alike] = True
        if alike.size < 2:
            continue
        part = shapes[:, alike] / np.linalg.norm(shapes[:, alike], axis=0)
        metric = part.conj().T @ M @ part
        if np.linalg.cond(metric) > 1e12:  # defective: there is one shape only
            continue
        _, mix = scipy.linalg.eigh(part.conj().T @ marks @ part, metric)
        mixed = part @ mix[:, ::-1]
        rows = np.argmax(np.abs(mixed) > 0.999 * np.abs(mixed).max(axis=0), axis=0)
        shapes[:, alike] = mixed / mixed[rows, np.arange(alike.size)]
    return shapes


def _marks(model: LinearModel) -> np.ndarray:
    """A Hermitian form that differs between what modes can be: axial, forward (or x), backward (or y),
    torsional."""
    coordinate = np.array([c for _, c in model.coordinates])
    weight = np.abs(np.diag(np.asarray(model.M)))
    each = np.zeros(len(coordinate))
    each[coordinate == "z"], each[coordinate == "phi"] = 3.0, -3.0
    spins = np.asarray(model.spins)
    if not np.any(spins):
        each[np.isin(coordinate, ("x", "theta"))] = 1.0
        return np.diag(each * weight)
    return np.diag(each * weight) + 1j * whirl_form(
        model.coordinates, weight, np.where(spins < 0, -1.0, 1.0)
    )


def whirl_form(
    coordinates: tuple[tuple[str, str], ...], weight: np.ndarray, sense: np.ndarray
) -> np.ndarray:
    """S, skew, with `u* (i S) u` what `whirl_of` measures of a shape u, not yet divided by its size."""
    one, other, sign = _planes(coordinates)
    form = np.zeros((len(coordinates),) * 2)
    form[one, other] = sign * weight[one] * sense[one]
    return form - form.T


def describe(model: LinearModel, shapes: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Of shapes (n, m): shares of kinetic energy, and the whirl, -1 to 1, positive with the spin."""
    M = np.asarray(model.M)
    sense = np.where(np.asarray(model.spins) < 0, -1.0, 1.0)
    whirl = whirl_of(model.coordinates, np.abs(np.diag(M)), shapes, sense)
    return shares_of(model.coordinates, M, shapes), whirl


def shares_of(coordinates: tuple[tuple[str, str], ...], M: Any, shapes: Any) -> dict[str, Any]:
    """Shares (m,) of the kinetic energy in shapes (n, m); of NumPy's or JAX's arrays."""
    coordinate = np.array([c for _, c in coordinates])
    energy = (shapes.conj() * (M @ shapes)).real
    total = energy.sum(axis=0)
    parts = {
        "lateral": np.isin(coordinate, ("x", "y", "psi", "theta")),
        "axial": coordinate == "z",
        "torsional": coordinate == "phi",
    }
    return {name: energy[rows].sum(axis=0) / total for name, rows in parts.items()}


def _upright(model: LinearModel, shapes: np.ndarray) -> np.ndarray:
    """Of the lateral energy of shapes (n, m), the share that swings up and down: y with psi."""
    coordinate = np.array([c for _, c in model.coordinates])
    each = np.abs(np.diag(np.asarray(model.M)))[:, None] * np.abs(shapes) ** 2
    lying, standing = (
        each[np.isin(coordinate, names)].sum(axis=0) for names in (("x", "theta"), ("y", "psi"))
    )
    whole = lying + standing
    return np.divide(standing, whole, out=np.full_like(whole, 0.5), where=whole > 0)


def whirl_of(
    coordinates: tuple[tuple[str, str], ...], weight: Any, shapes: Any, sense: np.ndarray
) -> Any:
    """How circular the orbits of shapes (n, m) are, weighed by `weight` (n,): -1 to 1, positive in the
    `sense` (n,) of each station's spin, 1 for counter-clockwise. Of NumPy's or JAX's arrays."""
    one, other, sign = _planes(coordinates)
    a, b = shapes[one], sign[:, None] * shapes[other]
    weight = weight[one][:, None]
    # x = Re X e^{iwt}, y = Re Y e^{iwt}: counter-clockwise where Y lags X by a quarter
    turning = (-2 * weight * sense[one][:, None] * (a.conj() * b).imag).sum(axis=0)
    size = (weight * (abs(a) ** 2 + abs(b) ** 2)).sum(axis=0)
    return turning / (size + (size == 0))


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
    return table_of(rows)
