"""Steady vibration: frequency response, and the response to unbalance."""

from collections.abc import Sequence
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..errors import InputError
from ..machine.field import n_free, relative_field
from ..machine.machine import Machine
from ..machine.system import assemble
from ..solve.state import to_flat
from .linearise import LinearModel, coordinate_order, linearize, row_of

# Angles of a turn at which the forces of what turns with the shaft are looked at.
_ANGLES = 16

Kind = Literal["receptance", "mobility", "accelerance"]
_POWER = {"receptance": 0, "mobility": 1, "accelerance": 2}


class FrequencyResponse(eqx.Module):
    """Complex amplitudes: `values` (frequency, output, input) per unit force or moment, or (speed, output)
    for unbalance. `frequencies`: rad/s (the speeds themselves for unbalance). The phase is that of the
    output against the input (for unbalance, against the rotor's own x axis): negative lags."""

    frequencies: Float[Array, " f"]
    values: Complex[Array, "..."]
    outputs: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    kind: str = eqx.field(static=True)

    @property
    def magnitude(self) -> Float[Array, "..."]:
        return jnp.abs(self.values)

    @property
    def phase(self) -> Float[Array, "..."]:
        """rad, -pi to pi."""
        return jnp.angle(self.values)


def frequency_response(
    machine: Machine,
    inputs: str | Sequence[str],
    outputs: str | Sequence[str],
    frequencies: Any,
    speed: Any = 0.0,
    kind: Kind = "receptance",
    at: Any = "equilibrium",
) -> FrequencyResponse:
    """Steady vibration of `outputs` under harmonic forces at `inputs`, the machine turning at `speed`.

    - `inputs`, `outputs`: `"main.y"`, ...; the force (N) or moment (N·m) and the motion (m, rad) along that
      coordinate. - `frequencies`: rad/s. - `kind`: motion, its rate, or its acceleration per unit force.

    Differentiable, and by `jax.vmap` over machines and speeds.
    """
    if kind not in _POWER:
        raise InputError(f"kind must be one of {', '.join(_POWER)}, but is {kind!r}")
    inputs = (inputs,) if isinstance(inputs, str) else tuple(inputs)
    outputs = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    frequencies = jnp.atleast_1d(jnp.asarray(frequencies, float))
    model = linearize(machine, speed, at)
    columns, rows = [model.row(i) for i in inputs], [model.row(o) for o in outputs]

    def one(w):
        H = _solve(model.A, w, model.B[:, np.array(columns)])
        return H[np.array(rows)] * (1j * w) ** _POWER[kind]

    return FrequencyResponse(frequencies, jax.lax.map(one, frequencies), outputs, inputs, kind)


def _solve(A: Array, w: Array, b: Array) -> Array:
    """(i w - A)^-1 b, rows and columns scaled to a like size."""
    matrix = 1j * w * jnp.eye(A.shape[0]) - A
    rows = jax.lax.stop_gradient(jnp.max(jnp.abs(matrix), axis=1))
    scaled = matrix / rows[:, None]
    columns = jax.lax.stop_gradient(jnp.max(jnp.abs(scaled), axis=0))
    right = (b.T / rows).T
    return (jnp.linalg.solve(scaled / columns, right).T / columns).T


def unbalance_response(
    machine: Machine,
    outputs: str | Sequence[str],
    speeds: Any,
    kind: Kind = "receptance",
    at: Any = "equilibrium",
) -> FrequencyResponse:
    """Steady synchronous vibration of `outputs` at `speeds` (rad/s) under the machine's own unbalance.

    The forces are those of the vector field itself: what a turn of the unbalanced machine in the steady
    state of the balanced one has at once per turn (so static and dynamic unbalance, imperfections and any
    part that turns with the shaft count alike). The motion is Re(value e^(i phi)), phi the shaft's angle.
    """
    outputs = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    speeds = jnp.atleast_1d(jnp.asarray(speeds, float))
    machine.check()
    labels = coordinate_order(machine)[3]
    rows = [row_of(labels, o) for o in outputs]

    def one(w):
        model = linearize(machine, w, at)
        x = _solve(model.A, w, _synchronous(machine, model))
        return x[np.array(rows)] * (1j * w) ** _POWER[kind]

    values = jax.lax.map(one, speeds)
    return FrequencyResponse(speeds, values, outputs, (), kind)


def _synchronous(machine: Machine, model: LinearModel) -> Complex[Array, " d"]:
    """Once-per-turn part of dx/dt that unbalance adds, in the model's order."""
    zero = jnp.zeros(())
    actual, nominal = assemble(machine), assemble(machine, nominal=True)
    n = n_free(actual)

    def excess(angle):
        reference = (angle, model.speed, zero)
        y = to_flat(model.state, nominal, (nominal.reference(zero)[0], model.speed, zero))
        field = relative_field(zero, y, actual, reference)
        return field - relative_field(zero, y, nominal, reference)

    angles = 2 * jnp.pi * jnp.arange(_ANGLES) / _ANGLES
    forces = jax.vmap(excess)(angles)
    first = 2 / _ANGLES * jnp.exp(-1j * angles) @ forces
    order = coordinate_order(machine)[2]
    return first[np.concatenate([order, n + order, np.arange(2 * n, first.shape[0])])]
