"""One batch of machines, compiled once: runs that keep only what is asked of them."""

from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..design.measure import Seen
from ..inverse.bench import Bench
from ..machine.field import jacobian, vector_field
from ..machine.machine import Machine
from ..machine.system import assemble, jump_times
from ..solve.adaptive import adaptive_samples, tolerances
from ..solve.checks import initial_speed
from ..solve.exponential import ETD4RK, ExponentialAdams
from ..solve.grid import Grid, Ticking
from ..solve.response import Response, RunInfo
from ..solve.simulate import march_samples, start
from .outputs import all_sensors, evaluated, needs_run, needs_states


class Setup(eqx.Module):
    """Everything that the machines of a sweep share. `linear`: A of the solver where none of them changes it,
    else `None`, one for each."""

    machine: Machine
    outputs: dict[str, Any]
    solver: Any
    initial: Any
    speed: Any
    linear: Float[Array, "d d"] | None
    linearised_at: Float[Array, ""]
    numbers: Float[Array, "2"]  # rtol, atol
    interval: Float[Array, ""]
    count: int = eqx.field(static=True)  # samples
    grid: Grid | None = eqx.field(static=True)


class Outcome(NamedTuple):
    """Of a batch. `failed`: the first sample that is not finite, or -1."""

    values: dict[str, Array]
    failed: Array


def placed(machine: Machine, values: dict[str, Any]) -> Machine:
    return Bench(machine, {}).set(values).machine


def member(setup: Setup, values: dict[str, Float[Array, ""]]) -> Outcome:
    """One machine of the sweep."""
    machine = placed(setup.machine, values)
    if not any(needs_run(one) for one in setup.outputs.values()):
        return Outcome(evaluated(setup.outputs, None, machine), jnp.array(-1))
    samples = jnp.arange(setup.count) * setup.interval
    if needs_states(setup.outputs):
        y = _states(setup, machine, samples, None)
        response: Any = Response(machine, samples, y, RunInfo("sweep"))
        fine = jnp.isfinite(y).all(axis=1)
        return _told(setup, machine, response, fine)
    sensors = all_sensors(setup.outputs)

    def watch(t, y):
        seen = Response(machine, t, y, RunInfo("sweep"))
        signals = tuple(sensor.signal(seen) for sensor in sensors)
        return signals, jnp.isfinite(y).all(axis=1)

    signals, fine = _states(setup, machine, samples, watch)
    return _told(setup, machine, Seen(samples, sensors, signals), fine)


def _told(setup: Setup, machine: Machine, seen: Any, fine: Bool[Array, " nt"]) -> Outcome:
    failed = jnp.where(fine.all(), -1, jnp.argmin(fine))
    values = evaluated(setup.outputs, seen, machine)
    # series keep what they had; a number of half a run would mislead
    whole = {
        name: jnp.where((failed < 0) | (value.ndim > 0), value, jnp.nan)
        for name, value in values.items()
    }
    return Outcome(whole, failed)


def _states(setup: Setup, machine: Machine, samples: Array, watch) -> Any:
    """The states at the samples, or what `watch` keeps of them."""
    system = assemble(machine)
    speed = initial_speed(machine, setup.initial, setup.speed)
    y0, _ = start(machine, system, setup.initial, speed)
    terms = diffrax.ODETerm(vector_field)  # pyright: ignore[reportArgumentType]
    jumps = jump_times(machine)
    ticking = None if setup.grid is None else Ticking(setup.grid, system, setup.count, y0.size)
    solver = setup.solver
    if isinstance(solver, (ExponentialAdams, ETD4RK)):
        A = setup.linear
        if A is None:
            A = jacobian(assemble(machine, nominal=True), setup.linearised_at)
        return march_samples(
            solver, A, terms, samples, jumps, y0, system, 0, ticking, watch, own=True
        )
    relative, absolute = tolerances(system, setup.numbers[0], setup.numbers[1])
    y, _ = adaptive_samples(
        solver, terms, samples, jumps, y0, system, relative, absolute, ticking=ticking
    )  # fmt: skip
    return y if watch is None else watch(samples, y)


@eqx.filter_jit
def run_batch(setup: Setup, values: dict[str, Float[Array, " b"]]) -> Outcome:
    """All machines of a batch at once."""
    return jax.vmap(lambda own: member(setup, own))(values)


@eqx.filter_jit
def _changes(machine: Machine, speed, values: dict, steps: dict) -> Array:
    def linear(values):
        return jacobian(assemble(placed(machine, values), nominal=True), speed)

    return jnp.max(jnp.abs(jax.jvp(linear, (values,), (steps,))[1]))


def shares_linear(machine: Machine, speed: float, values: dict[str, np.ndarray]) -> bool:
    """Whether no swept parameter enters the solver's linear part: its derivative along each is exactly zero, at
    three rows of the table."""
    n = next(iter(values.values())).size
    for row in {0, n // 2, n - 1}:
        at = {path: jnp.asarray(x[row]) for path, x in values.items()}
        for path in values:
            one = {p: jnp.asarray(1.0 if p == path else 0.0) for p in values}
            if float(_changes(machine, jnp.asarray(speed), at, one)) != 0.0:
                return False
    return True


def linear_part(machine: Machine, speed: float) -> Array:
    return _linear(machine, jnp.asarray(speed))


@eqx.filter_jit
def _linear(machine: Machine, speed):
    return jacobian(assemble(machine, nominal=True), speed)
