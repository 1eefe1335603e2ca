"""One batch of machines, compiled once: runs that keep only what is asked of them."""

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Bool, Float

from ..core.quick import lightly_compiled
from ..machine.field import jacobian
from ..machine.machine import Machine
from ..machine.system import assemble
from ..objectives.measure import Seen
from ..search.instrumented import Instrumented
from ..simulation.checks import initial_speed
from ..simulation.judging import STEADY_GAP
from ..simulation.march_through import march_through
from ..simulation.prepared import Known, assembled, linear_parts, prepare
from ..simulation.response import Response
from ..simulation.run_info import RunInfo
from ..simulation.run_setup import RunSetup, stepped
from ..simulation.solver import is_planned
from ..simulation.start import start
from .outputs import TimeSeries, all_sensors, evaluated, needs_run, needs_states


class Setup(eqx.Module):
    """Everything that the machines of a sweep share. `run`: whose `speed` is the one that was given, for each
    machine may have its own. `linear`: A of the solver where none of them changes it, else `None`, one for
    each."""

    machine: Machine
    outputs: dict[str, Any]
    run: RunSetup
    linear: Float[Array, "... d d"] | None


def with_steps(setup: Setup, steps: int, evaluations: int | None = None) -> Setup:
    """Of an exponential solver, so many in a sample interval, with so many evaluations each."""
    if not is_planned(setup.run.solver):
        return setup
    solver = stepped(setup.run.solver, steps, None, evaluations)
    return dataclasses.replace(setup, run=dataclasses.replace(setup.run, solver=solver))


def _abreast(setup: Setup) -> Setup:
    return dataclasses.replace(setup, run=dataclasses.replace(setup.run, abreast=True))


class Outcome(NamedTuple):
    """Of a batch. `failed`: the first sample that is not finite, or -1."""

    values: dict[str, Array]
    failed: Array


def placed(machine: Machine, values: dict[str, Any]) -> Machine:
    return Instrumented(machine, {}).set(values).machine


def begun(setup: Setup, values: dict[str, Float[Array, ""]]) -> Float[Array, " d"]:
    """The state from which one machine starts."""
    machine = placed(setup.machine, values)
    initial = setup.run.initial
    speed = initial_speed(machine, initial, setup.run.speed)
    y0, missed = start(*assembled(machine, setup.run), initial, speed)
    if isinstance(initial, str) and initial == "steady":
        y0 = jnp.where(missed < STEADY_GAP, y0, jnp.nan)
    return y0


def member(
    setup: Setup, values: dict[str, Float[Array, ""]], y0: Float[Array, " d"] | None = None
) -> Outcome:
    """One machine of the sweep. `y0`: where it starts, if that is known."""
    machine = placed(setup.machine, values)
    if not any(needs_run(one) for one in setup.outputs.values()):
        return Outcome(evaluated(setup.outputs, None, machine), jnp.array(-1))
    samples = setup.run.times

    def states(watch):
        """At the samples, or what `watch` keeps of them."""
        first = begun(setup, values) if y0 is None else y0
        known = None if setup.linear is None else Known(setup.linear, None)
        system, balanced = assembled(machine, setup.run, known)
        prepared = prepare(system, balanced, setup.run, known)
        return march_through(system, prepared, setup.run, first, watch=watch).kept

    if needs_states(setup.outputs):
        y = states(None)
        response: Any = Response(machine, samples, y, RunInfo("sweep"))
        fine = jnp.isfinite(y).all(axis=1)
        return _told(setup, machine, response, fine)
    sensors = all_sensors(setup.outputs)

    def watch(t, y):
        seen = Response(machine, t, y, RunInfo("sweep"))
        signals = tuple(sensor.signal(seen) for sensor in sensors)
        return signals, jnp.isfinite(y).all(axis=1)

    signals, fine = states(watch)
    return _told(setup, machine, Seen(samples, sensors, signals), fine)


def _told(setup: Setup, machine: Machine, seen: Any, fine: Bool[Array, " nt"]) -> Outcome:
    failed = jnp.where(fine.all(), -1, jnp.argmin(fine))
    values = evaluated(setup.outputs, seen, machine)
    # series keep what they had; a number of half a run would mislead
    whole = {
        name: jnp.where(_sound(setup.outputs[name], failed, value), value, jnp.nan)
        for name, value in values.items()
    }
    return Outcome(whole, failed)


def _sound(output: Any, failed: Array, value: Array) -> Array:
    if not isinstance(output, TimeSeries):
        return failed < 0
    return (failed < 0) | (jnp.arange(value.shape[0]) * output.every < failed)


@lightly_compiled
def run_batch(setup: Setup, values: dict[str, Float[Array, " b"]]) -> Outcome:
    """All machines of a batch at once."""
    setup = _abreast(setup)
    return jax.vmap(lambda own: member(setup, own))(values)


@lightly_compiled
def _begun_batch(setup: Setup, values: dict[str, Float[Array, " b"]]) -> Float[Array, "b d"]:
    return jax.vmap(lambda own: begun(setup, own))(values)


@lightly_compiled
def _run_sharded(setup: Setup, values, y0, mesh: Mesh) -> Outcome:
    arrays, rest = eqx.partition(_abreast(setup), eqx.is_array)

    def share(arrays, values, y0):
        return jax.vmap(lambda own, y: member(eqx.combine(arrays, rest), own, y))(values, y0)

    rows = PartitionSpec(mesh.axis_names[0])
    return jax.shard_map(
        share, mesh=mesh, in_specs=(PartitionSpec(), rows, rows), out_specs=rows, check_vma=False
    )(arrays, values, y0)


def run_sharded(setup: Setup, values: dict[str, Float[Array, " b"]], mesh: Mesh) -> Outcome:
    """The same with the batch divided among devices, each of which runs a program of its own.

    Split by the compiler instead, loops would ask all devices whether one of them goes on. The starts are
    found on one device: batched LAPACK calls of several devices of one processor wait for each other for ever
    (docs/solving.md).
    """
    y0 = jnp.zeros((next(iter(values.values())).size, 0))
    if any(needs_run(one) for one in setup.outputs.values()):
        y0 = _begun_batch(setup, values)
    rows = NamedSharding(mesh, PartitionSpec(mesh.axis_names[0]))
    return _run_sharded(setup, jax.device_put(values, rows), jax.device_put(y0, rows), mesh)


def solves_as_it_runs(setup: Setup) -> bool:
    """Whether runs call LAPACK at every step, in the field or the solver: then devices of one processor
    cannot share a batch."""
    implicit = not is_planned(setup.run.solver)
    return implicit or jax.eval_shape(assemble, setup.machine).mass is not None


@lightly_compiled
def _changes(machine: Machine, speed, values: dict, steps: dict) -> Array:
    def linear(values):
        return jacobian(assemble(placed(machine, values), nominal=True), speed)

    return jnp.max(jnp.abs(jax.jvp(linear, (values,), (steps,))[1]))


def shares_linear(machine: Machine, speed: float, values: dict[str, np.ndarray]) -> bool:
    """Whether no swept parameter enters the solver's linear part: its derivative along each is exactly zero,
    at three rows of the table."""
    n = next(iter(values.values())).size
    for row in {0, n // 2, n - 1}:
        at = {path: jnp.asarray(x[row]) for path, x in values.items()}
        for path in values:
            one = {p: jnp.asarray(1.0 if p == path else 0.0) for p in values}
            if float(_changes(machine, jnp.asarray(speed), at, one)) != 0.0:
                return False
    return True


@lightly_compiled
def linear_part(machine: Machine, run: RunSetup) -> Array:
    """As `linear_parts` has it."""
    return linear_parts(run, assemble(machine, nominal=True))
