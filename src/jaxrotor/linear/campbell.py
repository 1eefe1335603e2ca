"""Natural frequencies over speed, each mode followed through its crossings."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..errors import InputError
from ..machine.machine import Machine
from .linearise import LinearModel, linearize
from .modes import Mode, modes


class Campbell(eqx.Module):
    """Modes over speed. Rows are speeds, columns modes, each column one mode followed throughout.

    - `speeds`: (n,), rad/s. `eigenvalues`: (n, m) complex, 1/s. `whirl`: (n, m), -1 to 1, forward positive.
    - `names`: (m,), by what each mode is at the highest speed. `kinds`: "lateral", "torsional", "axial".
    """

    speeds: np.ndarray
    eigenvalues: np.ndarray
    whirl: np.ndarray
    names: tuple[str, ...] = eqx.field(static=True)
    kinds: tuple[str, ...] = eqx.field(static=True)

    @property
    def frequencies(self) -> np.ndarray:
        """Im lambda, (n, m), rad/s."""
        return np.imag(self.eigenvalues)

    @property
    def damping_ratios(self) -> np.ndarray:
        """(n, m); negative is unstable."""
        return -np.real(self.eigenvalues) / np.abs(self.eigenvalues)

    def crossings(self, order: float = 1.0) -> dict[str, list[float]]:
        """Speeds (rad/s) at which each mode meets `order` times the speed, between the speeds given, by
        interpolation; `critical_speeds` finds them exactly."""
        found: dict[str, list[float]] = {}
        for k, name in enumerate(self.names):
            gap = self.frequencies[:, k] - order * self.speeds
            for i in np.flatnonzero(np.sign(gap[:-1]) * np.sign(gap[1:]) < 0):
                s = gap[i] / (gap[i] - gap[i + 1])
                found.setdefault(name, []).append(
                    float((1 - s) * self.speeds[i] + s * self.speeds[i + 1])
                )
        return found


@eqx.filter_jit
def models(machine: Machine, speeds: Any, at: Any = "equilibrium") -> LinearModel:
    """One linear model for each speed, stacked."""
    return jax.lax.map(lambda w: linearize(machine, w, at), speeds)


def campbell(machine: Machine, speeds: Any, count: int = 12, at: Any = "equilibrium") -> Campbell:
    """The `count` lowest modes of `machine` at `speeds` (rad/s, rising), followed from speed to speed by
    how alike their shapes are (left eigenvectors against right ones), not by their order."""
    speeds = np.asarray(speeds, float)
    if speeds.ndim != 1 or speeds.size < 2 or not np.all(np.diff(speeds) > 0):
        raise InputError("speeds must be a rising list of two speeds at least, in rad/s")
    stacked = models(machine, jnp.asarray(speeds), at)
    each = [jax.tree.map(lambda x, i=i: x[i], stacked) for i in range(speeds.size)]
    systems = [_modal(m) for m in each]
    wanted = min(count, len(systems[-1][0]))
    # from the highest speed down: there the modes are furthest apart
    columns = np.arange(wanted)
    picked = [columns]
    for here, before in zip(systems[-2::-1], systems[:0:-1]):
        columns = _follow(before, columns, here)
        picked.append(columns)
    picked = picked[::-1]
    named = modes(each[-1])[:wanted]
    values = np.stack([s[0][c] for s, c in zip(systems, picked)])
    whirl = np.zeros((speeds.size, wanted))
    for i, (model, system, c) in enumerate(zip(each, systems, picked)):
        found = modes(model)
        for k in range(wanted):
            whirl[i, k] = _nearest(found, complex(system[0][c[k]])).whirl
    return Campbell(
        speeds, values, whirl, tuple(m.name for m in named), tuple(m.kind for m in named)
    )


def _nearest(found: list[Mode], value: complex) -> Mode:
    return min(found, key=lambda m: abs(m.eigenvalue - value))


def _modal(model: LinearModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Oscillating eigenvalues by rising frequency, with right and left eigenvectors."""
    values, right, left = (np.asarray(x) for x in model._system)
    up = np.flatnonzero(np.asarray(model.damped_frequencies) > 0)
    return values[up], right[:, up], left[up]


def _follow(before, columns: np.ndarray, here) -> np.ndarray:
    """Which modes `here` the modes `columns` of `before` are."""
    from scipy.optimize import linear_sum_assignment

    left = before[2][columns]
    alike = np.abs(left @ here[1])
    alike = alike / np.maximum(
        np.linalg.norm(left, axis=1)[:, None] * np.linalg.norm(here[1], axis=0)[None], 1e-300
    )
    # where two shapes are equally alike (the planes of a machine at rest) the nearer frequency counts
    value, frequencies = before[0][columns].imag, here[0].imag
    apart = np.abs(value[:, None] - frequencies[None]) / np.maximum(value[:, None], 1e-9)
    size = np.maximum(alike.max(axis=1, keepdims=True), 1e-300)
    _, found = linear_sum_assignment(-(alike / size) + np.minimum(apart, 1.0))
    return found
