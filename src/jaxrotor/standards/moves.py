"""What moves the numbers of the checks: each one's first change with the linear model, as forms of it
(`linear/slopes.py`), from which follow the derivatives by every parameter of the machine."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array

from ..core.parameter import numbers
from ..linear.eigen import eigensystem_numbers
from ..linear.linearise import models_at, rates_over_speed
from ..linear.loops import AXES, channels, opened
from ..linear.resolvent import resolvent
from ..linear.slopes import Form
from ..linear.torsion import torsional
from ..machine.machine import Machine
from .amplification import Resonances
from .placed import Excited, Probe, excited
from .stability import lowest_forward

# Of the gap to a peak's nearer flank: for slopes by differences of numbers, and of forms, which are exact.
_STEP, _FINE = 2e-3, 1e-4
# Eigenvalues so near to each other are one.
_ONE = 1e-6


class Rows(NamedTuple):
    """As `placed.Seen`, of numbers."""

    one: np.ndarray
    other: np.ndarray


# Of what decides weights and where they are.
SIZES = ("kg", "m", "kg/m^3")


class Numbers(NamedTuple):
    """A number that `function` of the machine tells, which is not traced: it is known how parameters in
    `units` move it by differences; `None`: in any but angles."""

    function: Callable[[Machine], float]
    units: tuple[str, ...] | None


class Term(NamedTuple):
    """`weight` times a form of `machine`, linear about `at`; or times a function of the machine itself."""

    weight: float
    machine: Machine
    at: Any
    form: Form | Numbers | Callable[[Machine], Array]


Moves = tuple[Term, ...]
"""Their sum, to first order."""


def scaled(moves: Moves, by: float) -> Moves:
    return tuple(term._replace(weight=term.weight * by) for term in moves) if by else ()


class Whirl:
    """A machine under placed unbalance, with all its stations. It is looked at among `speeds`, rad/s."""

    def __init__(
        self, machine: Machine, unbalance: Any, probes: Sequence[Probe], speeds: Any, at: Any
    ):
        self.given, self.machine, self.at, self.unbalance = machine, machine.full(), at, unbalance
        speeds = np.atleast_1d(np.asarray(speeds, float))
        run, seen = excited(self.machine, unbalance, probes, float(speeds.max()), at)
        self.probes = probes
        self.seen = [Rows(*map(numbers, one)) for one in seen]
        self.rates = rates_over_speed(self.machine, np.linspace(speeds.min(), speeds.max(), 9), at)
        self.forces = numbers(run.forces)

    def _motion(self, w: float) -> tuple[np.ndarray, np.ndarray]:
        (A, B), n = self.rates(w), self.forces.size
        return A, resolvent(A, n, 1j * w, w**2 * (B @ self.forces))

    def level(self, w: float, seen: Rows) -> float:
        """log of what a probe reads."""
        q = self._motion(w)[1][: self.forces.size]
        return float(np.log(abs(seen.one @ q) + abs(seen.other @ q)))

    def of_level(self, w: float, seen: Rows) -> Moves:
        """Of the log amplitude at a speed."""
        A, x = self._motion(w)
        n = self.forces.size
        read = [(row, row @ x[:n]) for row in seen]
        size = sum(abs(z) for _, z in read)
        pull = np.zeros(len(A), complex)
        for row, z in read:
            if z != 0:
                pull[:n] += np.conj(z) / abs(z) / size * row
        balanced: Any = scipy.linalg.matrix_balance(A, permute=False, separate=True)
        inside, (scale, _) = balanced
        left = np.linalg.solve(1j * w * np.eye(len(A)) - inside.T, scale * pull) / scale
        found = (Term(1.0, self.given, self.at, Form(w, left, x, w**2 * self.forces)),)
        if self.unbalance is not None:
            return found
        back = w**2 * (left @ self.rates(w)[1])

        def own(machine: Machine) -> Array:
            run: Excited = excited(machine.full(), None, self.probes, w, self.at)[0]
            return (back @ run.forces).real

        return (*found, Term(1.0, self.given, self.at, own))

    def of_peak(self, found: Resonances, k: int, seen: Rows) -> dict[str, Moves]:
        """Of "speed", "low", "high" of a peak, rad/s."""
        w, low, high = (float(x[k]) for x in (found.speeds, found.low, found.high))
        gaps = [abs(w - x) for x in (low, high) if np.isfinite(x)]
        gap = min(gaps, default=1e-2 * w)
        h, e = _FINE * gap, _STEP * gap

        def level(x: float) -> float:
            return self.level(x, seen)

        a, b, c, d, m = (level(w + j * e) for j in (-2, -1, 1, 2, 0))
        bend = (-a + 16 * b - 30 * m + 16 * c - d) / (12 * e**2)
        ahead, behind = self.of_level(w + h, seen), self.of_level(w - h, seen)
        place = scaled(ahead, -0.5 / (h * bend)) + scaled(behind, 0.5 / (h * bend))
        top = self.of_level(w, seen)
        out = {"speed": place, "low": (), "high": ()}
        for name, x in (("low", low), ("high", high)):
            if np.isfinite(x):
                a, b, c, d = (level(x + j * e) for j in (-2, -1, 1, 2))
                slope = (a - 8 * b + 8 * c - d) / (12 * e)
                out[name] = scaled(top, 1 / slope) + scaled(self.of_level(x, seen), -1 / slope)
        return out


def of_factor(found: Resonances, k: int, moves: dict[str, Moves]) -> Moves:
    """Of the amplification factor; none where there is none."""
    w, low, high = (float(x[k]) for x in (found.speeds, found.low, found.high))
    lower, upper = ((1.0, 0.0), (0.0, 1.0))
    if np.isnan(low) and np.isnan(high):
        return ()
    if np.isnan(low):
        lower, upper = (0.0, 0.0), (0.0, 2.0)
    elif np.isnan(high):
        lower, upper = (2.0, 0.0), (0.0, 0.0)
    down, up = lower[0], upper[1]
    width = (down * (w - low) if down else 0.0) + (up * (high - w) if up else 0.0)
    by_width = -w / width**2
    return (
        scaled(moves["speed"], 1 / width + by_width * (down - up))
        + scaled(moves["low"], -by_width * down)
        + scaled(moves["high"], by_width * up)
    )


def of_sensitivity(machine: Machine, loop: str, speed: float, at: Any, frequency: float) -> Moves:
    """Of |1/(1 + L)| at its peak, rad/s, of an axis of a magnetic bearing, "bearing.v". How its controller
    answers does not follow the steady state (a linear one's does not, away from the current's limit)."""
    full, (name, _, axis) = machine.full(), loop.rpartition(".")
    found, k = opened(full, (name,), speed, at), AXES.index(axis)
    A, E, C = (numbers(x) for x in (found.A, found.E[:, k], found.C[k]))
    s = 1j * frequency
    x = resolvent(A, found.n, s, E)
    left = np.linalg.solve((s * np.eye(len(A)) - A).T, C.astype(complex))
    own = 1.0 + C @ x
    turn = np.conj(own) / abs(own)
    state = models_at(full, at)(speed).state

    def outside(machine: Machine) -> Array:
        entering, seen = channels(machine.full(), (name,), state, jnp.asarray(speed))
        return jnp.real(turn * (left @ entering[:, k] + seen[k] @ x))

    none = np.zeros(found.n)
    form = Form(speed, turn * left, x, none)
    return Term(1.0, machine, at, form), Term(1.0, machine, at, outside)


def of_decrement(
    machine: Machine, speed: float, at: Any, coupling: float, shares: dict[str, float]
) -> tuple[Moves, float]:
    """Of the log decrement of the lowest forward lateral mode, with a cross coupling (N/m)
    shared between stations; and its slope by that."""
    model = models_at(machine.full(), at)(speed)
    numeric = jax.tree.map(numbers, model)
    A, B, n = np.asarray(model.A), np.asarray(model.B), model.M.shape[0]
    rows = []
    for station, share in shares.items():
        x, y = model.row(f"{station}.x"), model.row(f"{station}.y")
        rows.append((x, y, -share if model.spins[x] < 0 else share))
    slope = np.zeros_like(A)
    for x, y, share in rows:  # as `stability._loaded`
        slope[:, y] -= share * B[:, x]
        slope[:, x] += share * B[:, y]
    values, right, left = eigensystem_numbers(A + coupling * slope)
    k, there = lowest_forward(numeric, values, right, np)
    if not there:
        return (), 0.0
    value = complex(values[k])
    a, b = value.real, value.imag
    change = -2 * np.pi * (1 / b + 1j * a / b**2)
    same = np.flatnonzero(abs(values - values[k]) < _ONE * abs(values[k]))
    found, by_coupling = [], 0.0
    for j in same:
        u, x = change * left[j] / same.size, right[:, j]
        force = np.zeros(n, complex)
        for row, column, share in rows:
            force[row] -= coupling * share * x[column]
            force[column] += coupling * share * x[row]
        found.append(Term(1.0, machine, at, Form(speed, u, x, force)))
        by_coupling += float(np.real(u @ slope @ x))
    return tuple(found), by_coupling


def of_torsion(machine: Machine, speed: float, at: Any) -> list[tuple[float, Moves]]:
    """Natural frequencies of torsion, rad/s, rising, with what moves each; nothing where internal states
    take part."""
    whole = models_at(machine.full(), at)(speed)
    model = torsional(whole)
    M, D, K = (np.asarray(x) for x in (model.M, model.C + model.G, model.K))
    n, m = whole.M.shape[0], len(M)
    rows = [i for i, (_, c) in enumerate(whole.coordinates) if c == "phi"]
    natural = np.asarray(model.natural_frequencies)
    inside = np.asarray(model.A).shape[0] > 2 * m
    if inside:
        return [(float(w), ()) for w in natural if w > 0]
    values, right, left = eigensystem_numbers(np.asarray(model.A))
    out = []
    for w in natural[natural > 0]:
        away = abs(abs(values) - w) + np.where(np.imag(values) > 0, 0.0, np.inf)
        k = int(np.argmin(away))
        value, x = values[k], right[:m, k]
        y = np.linalg.solve(M.T, left[k, m:])
        # dλ = -y (λ² dM + λ dD + dK) x / y (2 λ M + D) x
        change = np.conj(value) / abs(value) / (y @ (2 * value * M + D) @ x)
        shape, other = np.zeros(n, complex), np.zeros(n, complex)
        shape[rows], other[rows] = x, change * y
        size = len(np.asarray(whole.A))
        u, state = np.zeros(size, complex), np.zeros(size, complex)
        big = [np.asarray(g) for g in (whole.M, whole.C + whole.G, whole.K)]
        u[n : 2 * n] = big[0].T @ other
        state[:n], state[n : 2 * n] = shape, value * shape
        force = (value**2 * big[0] + value * big[1] + big[2]) @ shape
        out.append((float(w), (Term(1.0, machine, at, Form(speed, u, state, force)),)))
    return out
