"""Where a machine loses its stability."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, numbers, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..machine.machine import Machine
from .eigen import eigensystem
from .linearise import linearize
from .whirling import refuse_whirl_dependent


@takes(start=number("rad/s"), stop=number("rad/s"), points=whole(2))
def stability_threshold(
    machine: Machine, start: float, stop: float, points: int = 61, at: Any = "undeformed"
) -> Float[Array, ""]:
    """The lowest speed (rad/s) between `start` and `stop` at which an oscillating mode loses its damping.

    A scan of `points` speeds finds where, the secant method on Re lambda the speed itself; its derivatives by
    every parameter are exact. Raises `InputError` where the machine stays stable (or is unstable at `start`).
    """
    machine.check()
    refuse_whirl_dependent(machine, "stability_threshold")
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
