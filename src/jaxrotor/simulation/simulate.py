"""Runs a machine through time."""

import dataclasses
import time
from contextlib import nullcontext
from functools import partial
from typing import Any, Literal

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float

from ..core.arguments import number, positive
from ..core.errors import InputError, SimulationInterrupted
from ..core.gate import either, takes
from ..core.parameter import is_concrete, numbers, require_x64
from ..integrators.adaptive import adaptive_samples
from ..integrators.defect import Defect
from ..integrators.exponential import ETD4RK, ExponentialAdams
from ..integrators.march import march
from ..integrators.progress import interruptible, progress_bar
from ..integrators.step_times import knots
from ..machine.field import initial_states, jacobian, n_free, vector_field
from ..machine.machine import Machine
from ..machine.system import System, assemble, jump_times
from .attitude import tell_attitude
from .checks import (
    check_solver,
    initial_speed,
    judge,
    refuse_sampled_whirl,
    sample_count,
    speed_beyond,
    tell_error,
)
from .equilibrium import resting, running
from .plan import Plan, bucket, plan as make_plan, refined, top_speed, unresolved
from .ranges import tell_ranges
from .response import Response, RunInfo
from .run_error import by_samples, run_error
from .sampling_grid import Grid, Ticking, grid_of
from .solver import is_planned, solver_for, tolerances
from .state import State, to_flat
from .steady import steady_whirl

# Times that a run of a line without a drive is planned anew for the speed that it reached.
_PLANS = 4

Initial = Literal["static", "running", "steady", "undeformed"]


@takes(
    t_end=positive("s"),
    step=either(Plan, positive("s")),
    sample_rate=positive("Hz"),
    solver=None,
    rtol=number(above=0.0, below=1.0),
    atol=positive(),
)
def simulate(
    machine: Machine,
    t_end: float,
    sample_rate: float,
    initial: Initial | State = "static",
    speed: Float[Array, ""] | float | None = None,
    solver: diffrax.AbstractSolver | None = None,
    step: Plan | float | None = None,
    rtol: float = 1e-7,
    atol: float = 1e-10,
    adjoint: diffrax.AbstractAdjoint | None = None,
    progress: bool | None = None,
) -> Response:
    """Runs `machine` from t = 0 to `t_end` (s) and samples it at `sample_rate` (Hz).

    **Arguments:**

    - `initial`: `"static"`, resting under its weight and every load's value at t = 0 and standstill, with
      the line's speed added; `"running"`, where the balanced machine stays at that speed, its films
      carrying; `"steady"`, the periodic whirl at `speed`; `"undeformed"`; or a `State`.
    - `speed`: rad/s, of the whole line at the start. A driven line starts with its drive; there it
      may be left out. A `State` brings its own.
    - `solver`: by default `ExponentialAdams`, or where a part of the machine is not smooth (backlash, a
      clutch, a limited governor, an oil film, a rub) `Rosenbrock`; any solver of diffrax may be given.
      `ETD4RK` and `ExponentialAdams` step onto the samples; others adapt their step to `rtol` and `atol`
      (SI; of a free spin's angle `rtol` counts in rad).
    - `step`: for the exponential solvers, a `Plan` or a largest step in s. By default `jr.plan`
      chooses; inside `jit` or `vmap` it must be given.
    - `adjoint`: of diffrax, for the other solvers, whose default knows reverse mode alone: give
      `diffrax.ForwardMode()` for forward mode. The exponential ones need none: both modes work.
    - `progress`: a progress bar, lines where stderr is a file; by default for runs expected to take over
      two seconds.

    Raises `InputError` for wrong input, before anything runs, and `SimulationFailed`, with the
    samples up to there, where the numbers leave the finite ones; `SimulationInterrupted`, a
    `KeyboardInterrupt` with the samples so far, where Ctrl-C stops a run that lasts over two seconds. In a
    batch (under `vmap`) a member that fails is NaN from there on, the others unharmed.
    """
    require_x64()
    check_solver(machine, solver, step, rtol, atol)
    machine.check()
    count = sample_count(t_end, sample_rate, len(machine.wiring.stations))
    speed = initial_speed(machine, initial, speed)
    words = initial if isinstance(initial, str) else "given state"
    interval = jnp.asarray(1.0 / sample_rate, float)
    grid = grid_of(machine, sample_rate)
    refuse_sampled_whirl(initial, grid is not None)
    given = jax.tree.leaves((machine, speed, initial))
    concrete = all(is_concrete(x) for x in given)
    # derivatives are traced through known values: each thread has transformations of its own
    alone = not any(isinstance(x, Tracer) for x in given)

    def run(solver, info, settings, bar):
        began = time.perf_counter()
        expected = None if info.substeps is None else count * info.substeps
        with progress_bar(count, expected, bar) if concrete else nullcontext() as under_way:
            told = under_way is not None
            asked = (machine, initial, speed, solver, interval, settings, count, step is not None)
            call = partial(_run, *asked, adjoint, told, grid, concrete)
            try:
                apart = told and alone
                found = interruptible(lambda: jax.block_until_ready(call())) if apart else call()
            except (Exception, KeyboardInterrupt):
                y = under_way.so_far() if told and under_way.stop else None
                if y is None:
                    raise
                t = jnp.arange(len(y)) * interval
                seconds = jnp.asarray(time.perf_counter() - began)
                raise SimulationInterrupted(
                    f"the simulation was stopped at t = {float(t[-1]):.6g} s of {t_end:g} s",
                    Response(
                        machine, t, jnp.asarray(y), dataclasses.replace(info, seconds=seconds)
                    ),
                ) from None
            y, steps, checks, error = found
            if concrete:
                jax.block_until_ready(y)
        info = dataclasses.replace(
            info,
            steps=steps,
            error=error,
            seconds=jnp.asarray(time.perf_counter() - began),
            steady_gap=checks if words == "steady" else None,
        )
        return Response(machine, jnp.arange(count) * interval, y, info), checks

    solver = solver_for(machine, solver)
    if is_planned(solver):
        chosen = chosen_plan(machine, t_end, sample_rate, speed, solver, step)
        for _ in range(_PLANS):
            sized = with_substeps(solver, chosen)
            info = planned(sized, chosen, sample_rate, words)
            response, checks = run(sized, info, jnp.asarray([chosen.speed]), progress)
            if concrete and unresolved(machine, chosen, 1.0 / sample_rate):
                error = jnp.maximum(response.info.error, 1.0)
                response = eqx.tree_at(lambda r: r.info.error, response, error)
            if not concrete or step is not None:
                break
            faster = speed_beyond(response, chosen.top_speed)
            error = float(numbers(response.info.error))
            if faster is not None:
                # a line that no drive holds found a speed of its own: plan for that
                chosen = make_plan(machine, t_end, sample_rate, faster, order=chosen.order)
            elif chosen.tolerance < error < float("inf"):
                chosen = refined(chosen, error)  # something moved that no pilot saw
            else:
                break
    else:
        if isinstance(step, Plan):
            raise InputError("a Plan is for the exponential solvers: give a step in s, or none")
        info = RunInfo(type(solver).__name__, initial=words, step=step)
        settings = jnp.asarray([rtol, atol, 0.0 if step is None else step])
        response, checks = run(solver, info, settings, progress)
    if concrete and is_concrete(response.y):
        judge(response, initial, checks)
        tell_attitude(response)
        tell_error(response.info)
        tell_ranges(response)
    return response


def chosen_plan(machine, t_end, sample_rate, speed, solver, step) -> Plan:
    if isinstance(step, Plan):
        return step
    order = solver.order_ if isinstance(solver, ExponentialAdams) else 6
    if step is None:
        return make_plan(machine, t_end, sample_rate, speed, order=order)
    try:
        valid = 0 < float(step) < float("inf")
    except (TypeError, ValueError):  # a tracer's refusal is a TypeError
        valid = False
    if not valid:
        raise InputError(f"step must be a Plan or a positive number in s, but is {step!r}")
    top = 0.0
    if all(is_concrete(x) for x in jax.tree.leaves((machine, speed))):
        top = top_speed(machine, t_end, speed)[1]
    nan = float("nan")
    return Plan(bucket(1.0 / sample_rate / float(step)), order, 0.5 * top, top, nan, nan)


def planned(solver, chosen: Plan, sample_rate: float, initial: str) -> RunInfo:
    """What a plan says of the run to come."""
    return RunInfo(
        type(solver).__name__,
        order=chosen.order if isinstance(solver, ExponentialAdams) else 4,
        substeps=chosen.substeps,
        initial=initial,
        step=jnp.asarray(1.0 / sample_rate / chosen.substeps),
        linearised_at=jnp.asarray(chosen.speed),
        planned_top_speed=jnp.asarray(chosen.top_speed),
        pilot_error=jnp.asarray(chosen.error),
        tolerance=jnp.asarray(chosen.tolerance),
    )


def with_substeps(solver, chosen: Plan) -> ExponentialAdams | ETD4RK:
    if solver is None:
        return ExponentialAdams(chosen.order, chosen.substeps)
    if isinstance(solver, ExponentialAdams):
        solver = ExponentialAdams(chosen.order, 1, solver.linear_part)
    return with_count(solver, chosen.substeps)


def with_count(solver, substeps: int) -> ExponentialAdams | ETD4RK:
    if isinstance(solver, ETD4RK):
        return ETD4RK(substeps, solver.linear_part)
    return ExponentialAdams(solver.order_, substeps, solver.linear_part)


@eqx.filter_jit
def _run(
    machine,
    initial,
    speed,
    solver,
    interval,
    settings,
    count,
    fixed,
    adjoint,
    told: bool,
    grid: Grid | None,
    judged: bool,
):
    system = assemble(machine)
    samples = jnp.arange(count) * interval
    y0, checks = start(machine, system, initial, speed)
    jumps = jump_times(system)
    terms = diffrax.ODETerm(vector_field)  # pyright: ignore[reportArgumentType]
    ticking = None if grid is None else Ticking(grid, system, count, y0.size)
    if is_planned(solver):
        A, balanced = solver.linear_part, assemble(machine, nominal=True)
        by_speed = None
        if A is None and judged:
            speeds = jnp.stack([settings[0], 0.0])
            A, rest = jax.vmap(lambda w: jacobian(balanced, w))(speeds)
            turning = settings[0] != 0.0
            by_speed = jnp.where(turning, (A - rest) / jnp.where(turning, settings[0], 1.0), 0.0)
        elif A is None:
            A = jacobian(balanced, settings[0])
        elif judged:
            by_speed = jnp.zeros_like(A)
        if by_speed is not None:
            by_speed = (by_speed, settings[0])
        y = march_samples(
            solver, A, terms, samples, jumps, y0, system, told, ticking, judge=by_speed
        )
        y, error = y if by_speed is not None else (y, None)
        steps = jnp.asarray((count - 1) * solver.substeps)
    else:
        error = None
        relative, absolute = tolerances(system, settings[0], settings[1])
        length = settings[2] if fixed else None
        y, steps = adaptive_samples(
            solver,
            terms,
            samples,
            jumps,
            y0,
            system,
            relative,
            absolute,
            length,
            adjoint,
            told,
            ticking,
        )
    return y, steps, checks, error


def start(machine: Machine, system: System, initial, speed) -> tuple[Array, Array]:
    """The flat state at t = 0, and what to judge it by."""
    zero = jnp.zeros(())
    reference = system.reference(zero)
    n = n_free(system)
    if isinstance(initial, State):
        return to_flat(initial, system, reference), zero
    if initial == "steady":
        state, _, missed = steady_whirl(machine, system, speed)
        return to_flat(state, system, reference), missed
    checks = jnp.zeros((len(machine.wiring.stations), 6))
    if initial == "static":
        still = (reference[0], zero, zero)
        y, checks = resting(system, still)
    elif initial == "running":
        turning, balanced = (reference[0], speed, zero), assemble(machine, nominal=True)
        y, checks = running(balanced, turning)
    else:
        y = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])
    free = jnp.array(system.layout.free, int)
    turn = 1.0 if system.turn is None else system.turn[free % system.layout.n_mass]
    spins = (free // system.layout.n_mass == 5) * turn * (speed - reference[1])
    return y.at[n : 2 * n].add(spins), checks


def march_samples(
    solver,
    A,
    terms,
    samples,
    jumps,
    y0,
    system,
    told: bool = False,
    ticking: Ticking | None = None,
    watch=None,
    judge: tuple[Array, Array] | None = None,
) -> Any:
    """The states at the samples by an exponential solver, with everything it needs prepared; or what `watch`
    keeps of them. `judge`: dA/dw and the speed of A; then with the states comes their error."""
    coarse = samples.shape[0]
    if ticking is not None:
        samples = ticking.fine(samples)
        substeps = -(-solver.substeps // ticking.refine)
        solver = with_count(solver, substeps)
    at = knots(samples, jumps)
    # of our own A the leading rows, rates of the coordinates, are all there is
    rows = n_free(system) if solver.linear_part is None else 0
    if isinstance(solver, ETD4RK):
        solver = ETD4RK(solver.substeps, A, at.lengths, rows)
    else:
        solver = ExponentialAdams(solver.order_, solver.substeps, A, at.lengths, rows)
    state = solver.init(terms, samples[0], samples[1], y0, system)
    if judge is not None:
        none = Defect.none(y0.size - rows)
        state = eqx.tree_at(lambda s: s.memory.defect, state, none, is_leaf=lambda x: x is None)
    ticks = None
    if ticking is not None:
        due = jnp.zeros((at.times.size, ticking.due.shape[1]), bool).at[at.samples].set(ticking.due)
        ticks = (ticking.tick, due)
    wanted = at.samples if ticking is None else at.samples[:: ticking.refine][:coarse]
    found = march(solver, terms, at._replace(samples=wanted), y0, system, state, told, ticks, watch)
    if judge is not None:
        y, defects = found
        step = (samples[1] - samples[0]) / solver.substeps
        error = run_error(
            solver.flow(state),
            step,
            solver.substeps,
            *judge,
            samples,
            y[at.samples],
            by_samples(at, defects),
            system,
        )
        return y[wanted], error
    return jax.tree.map(lambda x: x[wanted], found)
