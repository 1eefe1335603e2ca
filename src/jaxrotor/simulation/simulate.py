"""Runs a machine through time: check, plan, start, then one program that assembles, prepares and marches."""

import dataclasses
import math
import time
from contextlib import nullcontext
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..core.arguments import number, positive
from ..core.errors import SimulationInterrupted
from ..core.gate import either, takes
from ..core.notice import muted
from ..core.parameter import is_concrete, numbers, require_x64
from ..core.quick import lightly_compiled
from ..integrators.exponential import ExponentialAdams
from ..integrators.progress import interruptible, progress_bar
from ..machine.machine import Machine
from ..machine.system import System
from .beginning import begun
from .checks import sample_count, turns_freely
from .condensing import condensed_for
from .judging import judge, speed_reached, tell_attitude
from .march_through import Marched, march_through
from .planned import RETRIES, Plan, refined
from .prepared import Prepared
from .ranges import tell_ranges
from .response import Response
from .run_info import RunInfo, tell_error
from .run_setup import RunSetup, roomy, set_up
from .shaken import tell_turns
from .simulation import Initial, Simulation, as_simulation, end_or_simulation
from .solver import is_planned, solver_for
from .state import State
from .step_choice import Asked, find_plan, plan_for, plans, unresolved

# Times that a run of a line without a drive is planned anew for the speed that it reached.
_PLANS = 4


@takes(
    t_end=end_or_simulation,
    step=either(Plan, positive("s")),
    sample_rate=positive("Hz"),
    solver=None,
    tolerance=number(above=0.0, below=1.0),
    rtol=number(above=0.0, below=1.0),
    atol=positive(),
)
def simulate(
    machine: Machine,
    t_end: float | Simulation,
    sample_rate: float | None = None,
    initial: Initial | State = "static",
    speed: Float[Array, ""] | float | None = None,
    solver: diffrax.AbstractSolver[Any] | None = None,
    step: Plan | float | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    adjoint: diffrax.AbstractAdjoint | None = None,
    tolerance: float | None = None,
    progress: bool | None = None,
) -> Response:
    """Runs `machine` from t = 0 to `t_end` (s) and samples it at `sample_rate` (Hz).

    **Arguments:**

    - `t_end` to `tolerance`: as `jr.Simulation` has them; in place of `t_end` a whole `Simulation` may stand,
      which brings the rest. Inside `jit` or `vmap` the exponential solvers need a `step`: plan before.
    - `progress`: a progress bar, lines where stderr is a file; by default for runs expected to take over
      two seconds.

    Raises `InputError` for wrong input and `ConvergenceError` where no step or no start is found, before
    anything runs; `SimulationFailed`, with the samples up to there, where the numbers leave the finite ones;
    `SimulationInterrupted`, a `KeyboardInterrupt` with the samples so far, where Ctrl-C stops a run that
    lasts over two seconds. In a batch (under `vmap`) a member that fails is NaN from there on, the others
    unharmed.
    """
    require_x64()
    simulation = as_simulation(
        t_end,
        dict(
            sample_rate=sample_rate,
            initial=initial,
            speed=speed,
            solver=solver,
            step=step,
            tolerance=tolerance,
            rtol=rtol,
            atol=atol,
            adjoint=adjoint,
        ),
    )
    speed = simulation.check(machine)
    machine = condensed_for(machine, simulation)
    by_plan = is_planned(solver_for(machine, simulation.solver))
    with muted(progress is False):
        run = _planned if by_plan else _adaptive
        response, checks = run(machine, simulation, speed, progress)
    if is_concrete(response.y):
        judge(response, simulation.initial, checks)
        tell_attitude(response)
        tell_error(response.info)
        tell_ranges(response)
        tell_turns(response)
    return response


def settled(machine: Machine, simulation: Simulation) -> Simulation:
    """With solver and step chosen for `machine`, as `simulate` chooses them: such a one may run inside `jit`,
    and for machines like this one."""
    solver, step = solver_for(machine, simulation.solver), simulation.step
    if is_planned(solver) and step is None:
        if machine.is_driven or not turns_freely(machine):
            step = plan_for(machine, simulation, simulation.speed)
        else:  # what speed a line without a drive reaches is known when it has run
            simulate(machine, simulation, progress=False)
            ran = condensed_for(machine, simulation)
            step = plan_for(ran, simulation, simulation.check(machine))
            if ran is not machine:  # whose state has other parts
                step = dataclasses.replace(step, parts=None)
    return dataclasses.replace(simulation, solver=solver, step=step, tolerance=None)


def for_slopes(simulation: Simulation, reverse: bool) -> Simulation:
    """Ready to be differentiated by one mode: adaptive solvers know one at a time, and the others are
    quicker by the one that they know of."""
    forward = isinstance(simulation.adjoint, diffrax.ForwardMode)
    if simulation.adjoint is not None and forward != reverse:
        return simulation
    adjoint = diffrax.ForwardMode()
    if reverse:
        planned = is_planned(simulation.solver)
        adjoint = None if planned else diffrax.RecursiveCheckpointAdjoint()
    return dataclasses.replace(simulation, adjoint=adjoint)


def _planned(machine: Machine, simulation: Simulation, speed, progress) -> tuple[Response, Array]:
    """By an exponential solver, whose steps are planned, and planned anew where the run shows more than a
    pilot could see."""
    plan = plan_for(machine, simulation, speed)
    interval = 1.0 / simulation.sample_rate
    name = type(simulation.solver or ExponentialAdams()).__name__
    for turn in range(_PLANS):
        info = RunInfo(
            name,
            evaluations=plan.evaluations,
            order=plan.order if name == "ExponentialAdams" else 4,
            substeps=plan.substeps,
            span=plan.span,
            initial=simulation.start,
            step=jnp.asarray(interval / plan.steps_a_sample),
            linearised_at=jnp.asarray(plan.speed),
            planned_top_speed=jnp.asarray(plan.top_speed),
            pilot_error=jnp.asarray(plan.error),
            tolerance=jnp.asarray(plan.tolerance),
        )
        response, checks = _run(machine, simulation, speed, plan, info, progress)
        concrete = is_concrete(response.y) and _is_known(machine, simulation, speed)
        # a plan that was chosen follows all that is given in time; one of the user's own may not
        own = simulation.step is not None
        if concrete and own and unresolved(machine, plan, simulation.t_end, interval):
            error = jnp.maximum(response.info.error, 1.0)
            response = eqx.tree_at(lambda r: r.info.error, response, error)
        if not concrete or own or turn == _PLANS - 1:
            break
        reached, planned = speed_reached(response), plan.top_speed
        error = float(numbers(response.info.error))
        asked = Asked.of(simulation, speed)
        if reached is not None and (
            reached > 1.1 * planned + 1.0 or (turn > 0 and reached < 0.8 * planned)
        ):
            # a line that no drive holds found a speed of its own: plan for that. (A run that went astray
            # counts with at most ten times the plan, and may have been too fast.)
            reached = min(reached, 10 * planned + 1000.0)
            better = find_plan(machine, asked._replace(speed=reached, order=plan.order))
        elif plan.misses(error) and (np.isfinite(error) or turn < RETRIES):
            better = refined(plan, error)  # something moved that no pilot saw
        else:
            break
        plan = plans.put(machine, asked, better)
    return response, checks


def _adaptive(machine: Machine, simulation: Simulation, speed, progress) -> tuple[Response, Array]:
    name = type(solver_for(machine, simulation.solver)).__name__
    info = RunInfo(name, initial=simulation.start, step=simulation.step)
    return _run(machine, simulation, speed, None, info, progress)


def _run(
    machine: Machine,
    simulation: Simulation,
    speed: Float[Array, ""],
    plan: Plan | None,
    info: RunInfo,
    progress: bool | None,
) -> tuple[Response, Array]:
    """Once, with its clock, its bar and an ear for Ctrl-C. The checks say how good the start is."""
    count = sample_count(simulation.t_end, simulation.sample_rate)
    setup = set_up(machine, simulation, speed, plan, count)
    concrete = _is_known(machine, simulation, speed)
    # derivatives are traced through known values: each thread has transformations of its own
    given = jax.tree.leaves((machine, speed, simulation.initial))
    alone = not any(isinstance(x, Tracer) for x in given)
    began = time.perf_counter()

    def told_of(t, y, **more) -> Response:
        seconds = jnp.asarray(time.perf_counter() - began)
        return Response(machine, t, y, dataclasses.replace(info, seconds=seconds, **more))

    expected = None if plan is None else math.ceil(count * plan.steps_a_sample)
    with progress_bar(count, expected, progress) if concrete else nullcontext() as under_way:
        told = under_way is not None
        own = roomy(setup, told) if alone else setup

        def call():
            system, y0, checks, prepared = begun(machine, own, alone)
            found = *_march(system, own.started, y0, prepared, told, concrete), checks
            return jax.block_until_ready((found, system)) if concrete else (found, system)

        try:
            found = interruptible(call) if told and alone else call()
        except (Exception, KeyboardInterrupt):
            y = under_way.so_far() if told and under_way.stop else None
            if y is None:
                raise
            t = jnp.arange(len(y)) * setup.interval
            raise SimulationInterrupted(
                f"the simulation was stopped at t = {float(t[-1]):.6g} s of {simulation.t_end:g} s",
                told_of(t, jnp.asarray(y)),
            ) from None
    (y, steps, error, checks), system = found
    if own.count > count:
        y = jax.device_put(np.asarray(y)[:count])
    gap = checks if simulation.start == "steady" else None
    response = told_of(setup.times, y, steps=steps, error=error, steady_gap=gap)
    if not alone:  # not assembled anew, which would be a part of the program once more
        vars(response)["_system"] = system
    return response, checks


@lightly_compiled
def _march(
    system: System, setup: RunSetup, y0: Array, prepared: Prepared, told: bool, judged: bool
) -> Marched:
    """`judged`: with the run's own error."""
    return march_through(system, prepared, setup, y0, told=told, judged=judged)


def _is_known(machine: Machine, simulation: Simulation, speed: Any) -> bool:
    return all(is_concrete(x) for x in jax.tree.leaves((machine, speed, simulation.initial)))
