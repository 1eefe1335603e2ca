"""Modes of machines whose supports depend on the frequency of the whirl: each at its own."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex
from scipy.optimize import linear_sum_assignment

from ..core.arguments import number, whole
from ..core.gate import takes
from ..core.threads import one_thread
from ..machine.machine import Machine
from .eigen import eigensystem
from .instant import Prepared, prepare
from .linearise import LinearModel, check_linearized, linearize_checked, model_of
from .lowest_modes import lowest
from .modes import Mode, named
from .steady import Steady, steady
from .tables import Tables, tables_of
from .threshold import root
from .whirling import whirl_dependent, with_whirl

# Modes above those that are asked for, of which some come down as the frequency falls.
_MORE = 8
# How near a mode's frequency must come to the one at which its coefficients are taken.
_MET, _STEPS = 1e-11, 60
# Frequencies that are looked at first, about: between two that are far apart modes could change places.
_LOOKED_AT = 40


class Whirling:
    """Linear models of a machine over speed and whirl frequency, rad/s."""

    def __init__(self, machine: Machine, at: Any):
        self.machine, self.at = machine, at
        self.frequencies = np.unique(
            np.concatenate(
                [
                    np.asarray(machine.get(f"{name}.frequencies"))
                    for name in whirl_dependent(machine)
                ]
            )
        )
        tables = tables_of(machine) if at == "undeformed" else None
        self.tables: Tables | None = tables
        self._prepared: Prepared | None = None
        self._rest: tuple[float, Steady] | None = None

    def model(self, speed: float, whirl: float) -> LinearModel:
        if self.tables is None:
            machine = with_whirl(self.machine, whirl)
            return linearize_checked(machine, speed, self.at)
        if self._prepared is None:
            self._prepared = prepare(self.tables.rest)
        if self._rest is None or self._rest[0] != speed:
            self._rest = speed, steady(self._prepared, speed, self.at)
        found = self.tables.at_whirl(whirl).added(self._rest[1])
        return model_of(self.machine, found, speed)

    @one_thread
    def modes(self, speed: float, count: int) -> tuple[LinearModel, np.ndarray, np.ndarray]:
        """A model at the speed, and of the `count` lowest modes eigenvalues and shapes, as `lowest` gives
        them, each of the machine with the coefficients at its own frequency."""
        first = self.model(speed, speed)
        values, _ = lowest(first, count + _MORE)
        grid = self._grid(float(np.abs(values).max(initial=self.frequencies[-1])))
        found: list[tuple[complex, np.ndarray]] = []
        before: _Branches | None = None
        for w in grid:
            there = _Branches(w, *lowest(self.model(speed, w), count + _MORE))
            if before is not None:
                found += self._met(speed, before, there)
            before = there
        found = _once(found)
        found.sort(key=lambda one: abs(one[0]))
        kept = found[:count]
        shapes = np.stack([u for _, u in kept], axis=1) if kept else np.zeros((len(first.M), 0))
        return first, np.array([v for v, _ in kept], complex), shapes

    def _grid(self, highest: float) -> np.ndarray:
        rows = self.frequencies[self.frequencies < highest]
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, _LOOKED_AT).astype(int))]
        ends = np.unique(np.concatenate([[0.0], rows, [1.05 * highest]]))
        count = -(-_LOOKED_AT // len(ends))
        between = ends[:-1, None] + np.diff(ends)[:, None] * np.arange(count) / count
        return np.append(between.ravel(), ends[-1])

    def _met(self, speed: float, low: "_Branches", high: "_Branches"):
        """Modes whose frequency is met between two."""
        found = []
        for i, k in zip(*low.followed(high)):
            below = float(np.imag(low.values[i])) - low.whirl
            above = float(np.imag(high.values[k])) - high.whirl
            if below >= 0 > above or (below > 0 >= above):
                found.append(self._root(speed, low, high, i, k))
        return found

    def _root(self, speed: float, low: "_Branches", high: "_Branches", i: int, k: int):
        """By the Illinois variant of the false position, on the branch that is alike at both ends."""
        a, b = low.whirl, high.whirl
        fa, fb = low.values[i].imag - a, high.values[k].imag - b
        side, value, shape = 0, high.values[k], high.shapes[:, k]
        for _ in range(_STEPS):
            w = (fa * b - fb * a) / (fa - fb)
            there = _Branches(w, *lowest(self.model(speed, w), len(low.values)))
            j = there.nearest(value, shape)
            value, shape = there.values[j], there.shapes[:, j]
            f = value.imag - w
            if abs(f) <= _MET * max(w, 1.0):
                break
            if f > 0:
                a, fa, fb, side = w, f, fb * (0.5 if side == 1 else 1.0), 1
            else:
                b, fb, fa, side = w, f, fa * (0.5 if side == -1 else 1.0), -1
        return complex(value), shape


class _Branches(NamedTuple):
    """Eigenvalues (m,) and shapes (n, m) with coefficients at one whirl frequency, rad/s."""

    whirl: float
    values: np.ndarray
    shapes: np.ndarray

    def followed(self, other: "_Branches") -> tuple[np.ndarray, np.ndarray]:
        """Which are alike: by their shapes, and where these are equal by the eigenvalue."""
        away = np.abs(self.values[:, None] - other.values[None])
        away /= np.maximum(np.abs(self.values)[:, None], 1e-9)
        rows, columns = linear_sum_assignment(
            -_alike(self.shapes, other.shapes) + np.minimum(away, 1)
        )
        return rows, columns

    def nearest(self, value: complex, shape: np.ndarray) -> int:
        away = np.minimum(np.abs(self.values - value) / max(abs(value), 1e-9), 1.0)
        return int(np.argmin(away - _alike(shape[:, None], self.shapes)[0]))


def _alike(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """0 to 1, (m, k): modal assurance of shapes (n, m) and (n, k)."""
    size = np.linalg.norm(a, axis=0)[:, None] * np.linalg.norm(b, axis=0)
    return np.abs(a.conj().T @ b) / np.where(size > 0, size, 1.0)


def _once(found: list[tuple[complex, np.ndarray]]) -> list[tuple[complex, np.ndarray]]:
    """Without those that were met twice, at the end of one interval and the start of the next."""
    kept: list[tuple[complex, np.ndarray]] = []
    for value, shape in found:
        same = (
            abs(value - v) <= 1e-8 * abs(v) and _alike(shape[:, None], u[:, None])[0, 0] > 0.999
            for v, u in kept
        )
        if not any(same):
            kept.append((value, shape))
    return kept


@takes(speed=number("rad/s"), count=whole(1))
def matched_modes(
    machine: Machine, speed: float, count: int = 12, at: Any = "undeformed"
) -> list[Mode]:
    """The `count` lowest modes at `speed` (rad/s) of a machine with `WhirlDependentSupport`: each with the
    coefficients at its own frequency. `at`: as for `linearize`. Without such supports they are
    `modes(linearize(...))`.

    Eigenvalues are followed over the whirl frequency and taken where both meet, so that one mode may be met
    several times, or not at all; whirls of either sense take the coefficients at the size of their frequency.
    Not for use under `jit`; for derivatives `matched_eigenvalue`. Source: Lund, J. Eng. Ind. 96 (1974) 509.

    Raises `InputError` for another `at`, and for a speed that is not finite.
    """
    check_linearized(at)
    machine.check()
    if not whirl_dependent(machine):
        model = linearize_checked(machine, speed, at)
        return named(model, *lowest(model, count))
    return named(*Whirling(machine, at).modes(float(speed), count))


@takes(speed=number("rad/s"))
def matched_eigenvalue(
    machine: Machine, speed: Any, near: complex, at: Any = "undeformed"
) -> Complex[Array, ""]:
    """The eigenvalue (1/s) of `matched_modes` next to `near` (complex, Im > 0: what `matched_modes` found).
    Differentiable by every parameter and by the speed, exactly: by the implicit function theorem. NaN where
    none is met there.

    Raises `InputError` for another `at`, and for a speed that is not finite.
    """
    check_linearized(at)
    machine.check()
    return _eigenvalue(machine, jnp.asarray(speed, float), jnp.asarray(near, complex), at)


@eqx.filter_jit
def _eigenvalue(machine: Machine, speed, near, at) -> Array:
    def value(given, whirl):
        machine, speed = given
        values, _, _ = eigensystem(linearize_checked(with_whirl(machine, whirl), speed, at).A)
        return values[jnp.argmin(jnp.abs(values - near))]

    given = machine, speed
    whirl = root(lambda given, w: value(given, w).imag - w, given, near.imag, 40)
    return value(given, whirl)
