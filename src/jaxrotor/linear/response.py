"""Steady vibration under harmonic forces."""

from collections.abc import Sequence
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..arguments import names, number, numbers
from ..errors import InputError
from ..gate import takes
from ..machine.machine import Machine
from ..machine.system import assemble
from ..solve.state import to_flat
from .linearise import LinearModel, coordinate_order, internal_order, linearize
from .observe import Output, outputs_of, sensitivity

Kind = Literal["receptance", "mobility", "accelerance"]
POWER = {"receptance": 0, "mobility": 1, "accelerance": 2}


class FrequencyResponse(eqx.Module):
    """Complex amplitudes: `values` (frequency, output, input) per unit force or moment, or (speed, output)
    for unbalance. `frequencies`: rad/s (the speeds themselves for unbalance). The phase is that of the
    output against the input (for unbalance, against the rotor's own x axis): negative lags.

    `units`: of each output, SI; a mobility is per second, an accelerance per second squared."""

    frequencies: Float[Array, " f"]
    values: Complex[Array, "..."]
    outputs: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    kind: str = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)

    @property
    def magnitude(self) -> Float[Array, "..."]:
        return jnp.abs(self.values)

    @property
    def phase(self) -> Float[Array, "..."]:
        """rad, -pi to pi."""
        return jnp.angle(self.values)


@takes(inputs=names, outputs=names, frequencies=numbers("rad/s"), speed=number("rad/s"))
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

    - `inputs`: `"main.y"`, ...: the force (N) or moment (N·m) along that coordinate.
    - `outputs`: a coordinate (m, rad), an element's own signal such as `"shaft.torque"` (N·m), or
      `"bearing.force.x"`, the generalized force ON the first station that the bearing holds.
    - `frequencies`: rad/s. - `kind`: the output, its rate, or its second derivative per unit force.

    A torque at `"engine.phi"` and `"shaft.torque"` out is the forced torsional vibration. Differentiable,
    and by `jax.vmap` over machines and speeds.
    """
    check_kind(kind)
    inputs, outputs = as_names(inputs), as_names(outputs)
    frequencies = jnp.atleast_1d(jnp.asarray(frequencies, float))
    model = linearize(machine, speed, at)
    found = outputs_of(machine, model.coordinates, outputs)
    columns = np.array([model.row(i) for i in inputs])
    C = output_rows(machine, found, model)

    def one(w):
        return as_complex(C) @ solve(model.A, w, model.B[:, columns]) * (1j * w) ** POWER[kind]

    values = jax.lax.map(one, frequencies)
    return FrequencyResponse(
        frequencies, values, outputs, inputs, kind, tuple(o.unit for o in found)
    )


def check_kind(kind: str) -> None:
    if kind not in POWER:
        raise InputError(f"kind must be one of {', '.join(POWER)}, but is {kind!r}")


def as_names(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)


def output_rows(
    machine: Machine, outputs: tuple[Output, ...], model: LinearModel
) -> Float[Array, "outputs d"]:
    """What turns the model's state into the outputs."""
    if all(o.kind == "coordinate" for o in outputs):
        rows = np.array([model.row(f"{o.element}.{o.what}") for o in outputs])
        return jnp.eye(model.A.shape[0])[rows]
    system = assemble(machine, nominal=True)
    zero = jnp.zeros(())
    reference = (system.reference(zero)[0], model.speed, zero)
    y = to_flat(model.state, system, reference)
    C = sensitivity(machine, outputs, system, y, reference)
    return C[:, internal_order(coordinate_order(machine)[2], C.shape[1])]


def as_complex(x: Array) -> Array:
    """Not by promotion: its derivative warns of what it drops."""
    return x if jnp.iscomplexobj(x) else jax.lax.complex(x, jnp.zeros_like(x))


def solve(A: Array, w: Array, b: Array) -> Array:
    """(i w - A)^-1 b, rows and columns scaled to a like size."""
    matrix = jax.lax.complex(-A, w * jnp.eye(A.shape[0]))
    rows = jax.lax.stop_gradient(jnp.max(jnp.abs(matrix), axis=1))
    scaled = matrix / rows[:, None]
    columns = jax.lax.stop_gradient(jnp.max(jnp.abs(scaled), axis=0))
    right = (as_complex(b).T / rows).T
    return (jnp.linalg.solve(scaled / columns, right).T / columns).T
