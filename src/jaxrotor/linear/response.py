"""Steady vibration under harmonic forces."""

import warnings
from collections.abc import Sequence
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.arguments import names, number, numbers
from ..core.bar import with_bar
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.quick import traced
from ..core.result_text import HERTZ, shows
from ..core.threads import one_thread
from ..machine.machine import Machine
from ..machine.system import assemble
from ..simulation.state import to_flat
from .condensing import condensed_below
from .coordinates import coordinate_order, internal_order, row_of
from .instant import prepare
from .linearise import LinearModel, check_linearized, linearize_checked, model_of
from .observe import Output, outputs_of, sensitivity, watched
from .poles import beside_poles, beside_poles_numbers, poles_of
from .resolvent import resolvent
from .steady import steady
from .whirling import whirl_dependent, with_whirl

Kind = Literal["receptance", "mobility", "accelerance"]
POWER = {"receptance": 0, "mobility": 1, "accelerance": 2}


@shows(frequencies=HERTZ)
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

    plot = plot_door()

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
    and by `jax.vmap` over machines and speeds. Where a response has no bound (a free spin at 0 rad/s, a mode
    damped by less than 1e-9 at its own frequency) it is inf, with a warning; what does not meet that
    motion is finite there too. Raises `InputError` for a name that the machine does not have, and for
    frequencies or a speed that are not finite.
    """
    check_kind(kind)
    inputs, outputs = as_names(inputs), as_names(outputs)
    frequencies = jnp.atleast_1d(jnp.asarray(frequencies, float))
    check_linearized(at)
    machine.check()
    asked = known(frequencies)
    if asked is not None:
        pushed = {name.rpartition(".")[0] for name in inputs}
        at_stations = tuple(k for k, name in enumerate(machine.wiring.stations) if name in pushed)
        machine = condensed_below(machine, float(np.abs(asked).max(initial=0.0)), at, at_stations)
    labels = coordinate_order(machine)[3]
    found = outputs_of(machine, labels, outputs)
    columns = np.array([row_of(labels, i) for i in inputs])

    def responses(machine: Machine, frequencies: Array) -> Array:
        model, C = observed(machine, found, speed, at)
        each = _responses if traced(model, C, frequencies) else _responses_numbers
        return each(model, C, columns, frequencies, POWER[kind])

    if whirl_dependent(machine):

        def alone(w: Array) -> Array:
            return responses(with_whirl(machine, w), w[None])[0]

        if traced(machine, frequencies, speed, at):
            values = jax.lax.map(alone, frequencies)
        else:
            values = jnp.stack([alone(w) for w in frequencies])
    else:
        values = responses(machine, frequencies)
    _warn_unbounded(values, frequencies, outputs, inputs)
    return FrequencyResponse(
        frequencies, values, outputs, inputs, kind, tuple(o.unit for o in found)
    )


@eqx.filter_jit
def _responses(model: LinearModel, C: Array, columns: np.ndarray, frequencies, power: int) -> Array:
    poles = poles_of(model.A, model.M)

    def response(s):
        return as_complex(C) @ solve(model.A, s, model.B[:, columns]) * s**power

    return jax.lax.map(lambda w: beside_poles(response, poles, w), frequencies)


@one_thread
def _responses_numbers(
    model: LinearModel, C, columns: np.ndarray, frequencies, power: int
) -> Array:
    """`_responses`, where no derivative is asked."""
    A, M, B, C = map(np.asarray, (model.A, model.M, model.B[:, columns], C))
    poles = poles_of(A, M)

    def response(s):
        return C @ resolvent(A, len(M), s, B) * s**power

    along = map(float, with_bar(np.asarray(frequencies), "response"))
    found = [beside_poles_numbers(response, poles, w) for w in along]
    return jnp.asarray(np.stack(found))


def _warn_unbounded(values: Array, frequencies: Array, outputs, inputs) -> None:
    numbers = known(values)
    if numbers is None or not np.any(np.isinf(numbers)):
        return
    f, o, i = np.argwhere(np.isinf(numbers))[0]
    warnings.warn(
        f"`{outputs[o]}` by `{inputs[i]}` at {float(frequencies[f]):.6g} rad/s has no bound, for "
        f"nothing holds or "
        "damps that motion: it is given as inf; leave that frequency out, damp the motion, or hold it "
        "by `fixed`",
        stacklevel=3,
    )


def check_kind(kind: str) -> None:
    if kind not in POWER:
        raise InputError(f"kind must be one of {', '.join(POWER)}, but is {kind!r}")


def as_names(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)


def observed(
    machine: Machine, outputs: tuple[Output, ...], speed: Any, at: Any
) -> tuple[LinearModel, Float[Array, "outputs d"]]:
    """The linear model of a machine that has been checked, and what turns its state into the outputs."""
    speed = jnp.asarray(speed, float)
    if traced(machine, speed, at) or all(o.kind == "coordinate" for o in outputs):
        model = linearize_checked(machine, speed, at)
        return model, output_rows(machine, outputs, model)
    prepared = prepare(machine)
    found = steady(prepared, float(speed), at)
    reference = (prepared.angle, speed, jnp.zeros(()))
    C = np.asarray(watched(machine, outputs, prepared.system, jnp.asarray(found.y), reference))
    C = C[:, internal_order(coordinate_order(machine)[2], C.shape[1])]
    return model_of(machine, found, float(speed)), jnp.asarray(C)


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
    """(i w - A)^-1 b, for a real w, or (w - A)^-1 b for a complex one; rows and columns scaled to a like
    size."""
    s = w if jnp.iscomplexobj(w) else jax.lax.complex(jnp.zeros_like(w), w)
    matrix = s * jnp.eye(A.shape[0]) - as_complex(A)
    rows = jax.lax.stop_gradient(jnp.max(jnp.abs(matrix), axis=1))
    scaled = matrix / rows[:, None]
    columns = jax.lax.stop_gradient(jnp.max(jnp.abs(scaled), axis=0))
    right = (as_complex(b).T / rows).T
    return (jnp.linalg.solve(scaled / columns, right).T / columns).T
