"""Critical speeds, directly: where a mode's frequency is so many times the speed."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..arguments import number, numbers, positive, whole
from ..errors import InputError
from ..gate import takes
from ..machine.machine import Machine
from .eigen import eigensystem
from .linearise import LinearModel, linearize
from .modes import Mode, named

_STEPS = 20


@takes(order=positive(), count=whole(1))
def critical_speeds(
    machine: Machine,
    order: float = 1.0,
    damped: bool = False,
    at: Any = "undeformed",
    count: int | None = None,
) -> Float[Array, " m"]:
    """Speeds (rad/s, rising) at which a mode's frequency is `order` times the speed.

    Undamped: `K u = w² (M - i G1/order) u`, with M, K at rest and G1 the gyroscopic matrix per speed: one
    eigenvalue problem gives all of them, forward and backward whirl and torsion (a machine with speed-
    dependent parts needs `damped=True`). `damped`: from there Im lambda(speed) = order speed is solved by
    the secant method on the full model at each speed; those that damping removes are left out. Derivatives by
    every parameter are exact in both modes. `count`: only the lowest so many (needed under `jit`).

    Source: Friswell et al., Dynamics of Rotating Machines (2010), sec. 6.8 and 6.9.
    """
    if not order > 0:
        raise InputError(f"order must be positive, but is {order!r}")
    machine.check()
    values = _undamped(machine, jnp.asarray(float(order)), at)
    if count is None:
        known = np.asarray(jax.lax.stop_gradient(values))
        values = values[: int(np.sum(np.isfinite(known)))]
    else:
        values = values[:count]
    if damped:
        values = _refined(machine, values, float(order), at)
        known = np.asarray(jax.lax.stop_gradient(values))
        keep = np.flatnonzero(np.isfinite(known))
        values = values[keep[np.argsort(known[keep])]]
    return values


@takes(order=positive(), count=whole(1))
def critical_modes(
    machine: Machine, order: float = 1.0, at: Any = "undeformed", count: int | None = None
) -> list[Mode]:
    """What whirls, twists or shuttles at each of the undamped `critical_speeds`, in their order: a mode's
    `frequency` is `order` times the speed. Unbalance excites forward whirl; a backward one by unequal
    supports alone, a torsional one hardly. Where two coincide (no gyroscopic effect) the sense of their whirl
    means nothing. Not for use under `jit`.
    """
    speeds = np.asarray(critical_speeds(machine, order, False, at, count))
    rest, G1 = at_rest(machine, at)
    M, K, G1 = (np.asarray(x) for x in (rest.M, rest.K, G1))
    n = M.shape[0]
    values, shapes = np.zeros(len(speeds), complex), np.zeros((n, len(speeds)), complex)
    for k, speed in enumerate(speeds):
        side = np.linalg.solve(M, np.hstack([-0.5 * (K + K.T), -G1 * speed]))
        found, right = np.linalg.eig(np.vstack([np.eye(n, 2 * n, n), side]))
        # of several at one speed each its own
        turn = int(np.sum(np.abs(speeds[:k] / speed - 1) < 1e-9))
        nearest = np.argsort(np.abs(found - 1j * order * speed))[turn]
        values[k], shapes[:, k] = 1j * order * speed, right[:n, nearest]
    # at rest no station has a sense to whirl in
    turning = eqx.tree_at(lambda m: m.spins, rest, linearize(machine, 1.0, at).spins)
    return named(turning, values, shapes)


def at_rest(machine: Machine, at: Any) -> tuple[LinearModel, Float[Array, "n n"]]:
    """The machine at rest, and there dG/d(speed)."""

    def gyroscopic(speed):
        model = linearize(machine, speed, at)
        return model.G, model

    zero = jnp.zeros(())
    _, per_speed, model = jax.jvp(gyroscopic, (zero,), (jnp.ones_like(zero),), has_aux=True)
    return model, per_speed


@eqx.filter_jit
def _undamped(machine: Machine, order, at) -> Array:
    rest, G = at_rest(machine, at)
    n = rest.M.shape[0]
    # the complex pencil as a real one of twice the size: i becomes [[0, -1], [1, 0]]
    G = G / order
    mass = jnp.block([[rest.M, G], [-G, rest.M]])
    stiffness = jnp.kron(jnp.eye(2), 0.5 * (rest.K + rest.K.T))
    values, _, _ = eigensystem(jnp.linalg.solve(mass, stiffness))
    squares = values.real
    size = jnp.max(jnp.abs(squares))
    real = (squares > 1e-12 * size) & (jnp.abs(values.imag) < 1e-6 * jnp.abs(squares))
    speeds = jnp.where(real, jnp.sqrt(jnp.where(real, squares, 1.0)), jnp.inf) / order
    # each root of the complex pencil and its conjugate's come in the doubled one
    return jnp.sort(speeds)[::2][:n]


@eqx.filter_jit
def _refined(machine: Machine, starts: Array, order: float, at) -> Array:
    """The speeds near `starts` at which a mode of the damped machine has `order` times that frequency."""

    def near(start):
        def gap(machine, speed):
            values, _, _ = eigensystem(linearize(machine, speed, at).A)
            target = order * jax.lax.stop_gradient(speed)
            i = jnp.argmin(jnp.abs(values - 1j * target))
            return values[i].imag - order * speed

        return root(gap, machine, start, _STEPS)

    return jax.lax.map(near, starts)


def root(
    gap: Callable[[Any, Array], Array],
    parameters: Any,
    start: Array,
    steps: int,
) -> Float[Array, ""]:
    """The zero of `gap(parameters, x)` near `start` by the secant method, NaN where none is reached.
    Exact derivatives by the parameters: the search is not differentiated, one Newton step after it is (the
    implicit function theorem).
    """

    def point(x):
        return x, jnp.full_like(x, jnp.nan)

    start, still = jax.tree.map(jax.lax.stop_gradient, (start, parameters))
    # the loop evaluates the first two points too: one copy of `gap` in the program
    first, second = start * (1 + 1e-4), start

    def step(k, state):
        (x, y), (x_before, y_before) = state
        given = jnp.where(k == 0, first, second)
        flat = jnp.abs(y - y_before) <= 1e-14 * jnp.abs(x)
        move = jnp.where(flat, 0.0, y * (x - x_before) / jnp.where(flat, 1.0, y - y_before))
        # a fifth of the way at most: eigenvalues change their order beyond
        new = jnp.where(k < 2, given, jnp.clip(x - move, 0.8 * x, 1.25 * x))
        return (new, gap(still, new)), (x, y)

    (x, _), _ = jax.lax.fori_loop(0, steps + 2, step, (point(first), point(first)))
    value, slope = jax.jvp(lambda x: gap(parameters, x), (x,), (jnp.ones_like(x),))
    out = x - value / jax.lax.stop_gradient(slope)
    return jnp.asarray(jnp.where(jnp.abs(value) < 1e-6 * jnp.abs(x), out, jnp.nan))


@takes(start=number("rad/s"), stop=number("rad/s"), points=whole(2))
def stability_threshold(
    machine: Machine, start: float, stop: float, points: int = 61, at: Any = "undeformed"
) -> Float[Array, ""]:
    """The lowest speed (rad/s) between `start` and `stop` at which an oscillating mode loses its damping.

    A scan of `points` speeds finds where, the secant method on Re lambda the speed itself; its derivatives by
    every parameter are exact. Raises `InputError` where the machine stays stable (or is unstable at `start`).
    """
    machine.check()
    numbers("rad/s", size=2, rising=True)([start, stop], "start and stop")
    speeds = np.linspace(start, stop, points)
    still = jax.tree.map(jax.lax.stop_gradient, machine)
    growth = np.asarray(_least_damped(still, jnp.asarray(speeds), at))
    unstable = growth > 1e-9 * np.abs(growth).max()
    if unstable[0] or not unstable.any():
        where = f"unstable at {start:g} rad/s already" if unstable[0] else "stable throughout"
        raise InputError(f"no threshold from {start:g} to {stop:g} rad/s: the machine is {where}")
    k = int(np.argmax(unstable))
    low, high = speeds[k - 1], speeds[k]
    s = growth[k - 1] / (growth[k - 1] - growth[k])
    return _threshold(machine, jnp.asarray(low + s * (high - low)), at)


@eqx.filter_jit
def _least_damped(machine: Machine, speeds: Array, at) -> Array:
    return jax.lax.map(lambda w: _growth(machine, w, at), speeds)


def _growth(machine: Machine, speed, at) -> Array:
    """Real part of the least damped oscillating mode, 1/s."""
    values, _, _ = eigensystem(linearize(machine, speed, at).A)
    oscillating = values.imag > 1e-6 * jnp.max(jnp.abs(values.imag))
    return jnp.max(jnp.where(oscillating, values.real, -jnp.inf))


@eqx.filter_jit
def _threshold(machine: Machine, start, at) -> Array:
    return root(lambda m, speed: _growth(m, speed, at), machine, start, 15)
