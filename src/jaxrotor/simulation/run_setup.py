"""A simulation as compiled programs take it, and the march through its samples: one for runs, sweeps and
energy audits."""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..integrators.adaptive import adaptive_samples
from ..integrators.blocks import LENGTH, Blocks, blocks_of
from ..integrators.defect import Defect
from ..integrators.exponential import ETD4RK, AbstractExponential, ExponentialAdams
from ..integrators.fitted import Method, run_through
from ..integrators.ladder import Ladder, ladder_of, rung_speeds
from ..integrators.march import march
from ..integrators.progress import PARTS
from ..integrators.step_times import knots
from ..machine.field import jacobians, n_free, vector_field
from ..machine.line_speed import line_speed
from ..machine.machine import Machine
from ..machine.system import System, assemble, jump_times
from .plan import Plan
from .run_error import Flow, by_samples, error_by_blocks, run_error
from .sampling_grid import Grid, Ticking, grid_of
from .simulation import ATOL, RTOL, Simulation
from .solver import is_planned, solver_for, tolerances
from .start import needs_balanced


class Room(eqx.Module):
    """For runs of any length and step: the numbers of a run's own intervals, and steps in each. `most`: of
    intervals, steps in all, and steps in an interval. `length`: of a block."""

    intervals: Int[Array, ""]
    substeps: Int[Array, ""]
    most: tuple[int, int, int] = eqx.field(static=True)
    length: int = eqx.field(static=True)


class RunSetup(eqx.Module):
    """Numbers that may change are arrays, so that another value is not another program.

    `linearised_at`: rad/s, of the exponential solvers' linear part. `step`: of adaptive solvers, fixed, s.
    """

    solver: diffrax.AbstractSolver[Any]
    initial: Any
    speed: Float[Array, ""] | None
    linearised_at: Float[Array, ""]
    tolerances: Float[Array, "2"]  # rtol, atol
    step: Float[Array, ""] | None
    interval: Float[Array, ""]
    adjoint: diffrax.AbstractAdjoint | None
    count: int = eqx.field(static=True)  # samples, or where there is room the most of them
    grid: Grid | None = eqx.field(static=True)
    room: Room | None = None

    @property
    def times(self) -> Float[Array, " nt"]:
        at = jnp.arange(self.count)
        if self.room is not None:
            at = jnp.minimum(at, self.room.intervals)
        return at * self.interval

    @property
    def intervals(self) -> int | Array:
        return self.count - 1 if self.room is None else self.room.intervals

    @property
    def substeps(self) -> int | Array:
        return self.solver.substeps if self.room is None else self.room.substeps  # pyright: ignore


def roomy(setup: RunSetup, told: bool) -> RunSetup:
    """One program for it and for others like it that are shorter or longer, or step otherwise; for those that
    nothing is differentiated through backwards. `told`: whether samples are handed over while they come."""
    if not isinstance(setup.solver, ExponentialAdams) or setup.grid is not None:
        return setup
    intervals, substeps = setup.count - 1, setup.solver.substeps
    most = _roomy(intervals, 100), _roomy(intervals * substeps, 100), _roomy(substeps, 8)
    # what is handed over of a short run comes in short parts
    length = 8 if told and most[1] < LENGTH * PARTS else LENGTH
    room = Room(jnp.asarray(intervals), jnp.asarray(substeps), most, length)
    solver = stepped(setup.solver, 1)
    return dataclasses.replace(setup, solver=solver, count=most[0] + 1, room=room)


def _roomy(count: int, size: int) -> int:
    """The next of 1, 1.5, 2, 3, 4, 6, ... sizes."""
    while size < count:
        size = size * 3 // 2 if size * 3 // 2 >= count else size * 2
    return size


def set_up(
    machine: Machine,
    simulation: Simulation,
    speed: Float[Array, ""] | None,
    plan: Plan | None,
    count: int,
) -> RunSetup:
    """`plan`: of an exponential solver, which takes its steps; `speed`: at the start, rad/s."""
    solver = solver_for(machine, simulation.solver)
    step = None
    if plan is not None:
        solver = stepped(solver, plan.substeps, plan.order, plan.evaluations)
    elif not is_planned(solver) and simulation.step is not None:
        step = jnp.asarray(simulation.step, float)
    rtol, atol = (
        default if own is None else own
        for own, default in ((simulation.rtol, RTOL), (simulation.atol, ATOL))
    )
    return RunSetup(
        ExponentialAdams() if solver is None else solver,
        simulation.initial,
        speed,
        jnp.asarray(0.0 if plan is None else plan.speed, float),
        jnp.asarray([rtol, atol], float),
        step,
        jnp.asarray(1.0 / simulation.sample_rate, float),
        simulation.adjoint,
        count,
        grid_of(machine, simulation.sample_rate),
    )


def stepped(
    solver: Any, substeps: int, order: int | None = None, evaluations: int | None = None
) -> AbstractExponential:
    """With so many steps in a sample interval, and evaluations of the field in a step."""
    if isinstance(solver, ETD4RK):
        return ETD4RK(substeps, solver.linear_part)
    solver = ExponentialAdams() if solver is None else solver
    return ExponentialAdams(
        order or solver.order_,
        substeps,
        solver.linear_part,
        evaluations=evaluations or solver.evaluations,
    )


class Prepared(eqx.Module):
    """What a march needs beside system and setup. Of `ETD4RK`, `linear`: A, and `by_speed`: dA/dw. Of the
    Adams method, the `blocks` of its steps, and the `ladder` of their weights."""

    linear: Float[Array, "d d"] | None = None
    by_speed: Float[Array, "d d"] | None = None
    blocks: Blocks | None = None
    ladder: Ladder | None = None


def assembled(machine: Machine, setup: RunSetup) -> tuple[System, System | None]:
    """The system, and where the run needs it the one without what turns with the shaft."""
    solver = setup.solver
    linear = is_planned(solver) and solver.linear_part is None  # pyright: ignore
    needed = linear or needs_balanced(setup.initial)
    return assemble(machine), assemble(machine, nominal=True) if needed else None


def linear_parts(solver: Any, balanced: System, linearised_at: Float[Array, ""]) -> Array:
    """A at some speeds, (s, d, d): of `ETD4RK` at that one (rad/s) and at rest; of the Adams method at each
    rung below twice of it."""
    speeds = rung_speeds(2 * linearised_at)
    if isinstance(solver, ETD4RK):
        speeds = jnp.stack([linearised_at, jnp.zeros(())])
    return jacobians(balanced, speeds)


def prepare(
    system: System,
    balanced: System | None,
    setup: RunSetup,
    linear: Any = None,
    extra: int = 0,
) -> Prepared:
    """`linear`: as `linear_parts`, where it is known beforehand. `extra`: states that follow the machine's
    own."""
    solver, w = setup.solver, setup.linearised_at
    if not is_planned(solver):
        return Prepared()
    if solver.linear_part is not None:  # pyright: ignore
        A = solver.linear_part  # pyright: ignore
        A, speeds = jnp.stack([A, A]) if isinstance(solver, ETD4RK) else A[None], w[None]
    else:
        A = linear_parts(solver, balanced, w) if linear is None else linear  # pyright: ignore
        speeds = rung_speeds(2 * w)
    A = jnp.pad(A, [(0, 0), (0, extra), (0, extra)])
    if isinstance(solver, ETD4RK):
        by_speed = jnp.where(w != 0.0, (A[0] - A[1]) / jnp.where(w != 0.0, w, 1.0), 0.0)
        return Prepared(linear=A[0], by_speed=by_speed)
    ticking = ticking_of(setup, system)
    refine = 1 if ticking is None else ticking.refine
    interval, substeps = setup.interval / refine, -(-setup.substeps // refine)
    blocks = blocks_of(
        interval,
        setup.intervals * refine,
        substeps,
        solver.order_,  # pyright: ignore
        jump_times(system),
        None if ticking is None else ticking.due,
        length=LENGTH if setup.room is None else setup.room.length,
        room=None if setup.room is None else setup.room.most,
    )
    # of our own A the leading rows, rates of the coordinates, are all there is
    rows = n_free(system) if solver.linear_part is None else 0  # pyright: ignore
    of_parts = jax.vmap(lambda t: system.reference(t)[1])(blocks.starts)
    start = system.reference(jnp.zeros(()))[1] if setup.speed is None else setup.speed
    ladder = ladder_of(
        speeds,
        A,
        interval / substeps,
        solver.order_,  # pyright: ignore
        rows,
        blocks,
        of_parts,
        start,
    )
    return Prepared(blocks=blocks, ladder=ladder)


def ticking_of(setup: RunSetup, system: System) -> Ticking | None:
    d = 2 * n_free(system) + system.n_states()
    return None if setup.grid is None else Ticking(setup.grid, system, setup.count, d)


class Marched(NamedTuple):
    """`kept`: the states at the samples, or what `watch` kept of them; `error`: the run's own, as part of
    each coordinate's peak, where it was asked for."""

    kept: Any
    steps: Array
    error: Array | None


def march_through(
    system: System,
    prepared: Prepared,
    setup: RunSetup,
    y0: Float[Array, " d"],
    field: Callable = vector_field,
    watch: Callable | None = None,
    told: bool = False,
    judged: bool = False,
) -> Marched:
    """From `y0` through the samples. States of `field` beyond the machine's own follow it (accounts of
    energy). `watch`: what is kept of a block of instants and states, in place of these. `told`: samples are
    handed over while they come. `judged`: whether it is to tell its error."""
    samples = setup.times
    ticking = ticking_of(setup, system)
    if prepared.ladder is not None:
        return _by_blocks(system, prepared, setup, field, y0, ticking, watch, told, judged)
    jumps = jump_times(system)
    terms = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]
    if prepared.linear is not None:
        return _by_single_steps(
            system, prepared, setup, terms, samples, jumps, y0, ticking, watch, told, judged
        )
    extra = y0.size - 2 * n_free(system) - system.n_states()
    relative, absolute = tolerances(system, setup.tolerances[0], setup.tolerances[1], extra)
    y, steps = adaptive_samples(
        setup.solver,
        terms,
        samples,
        jumps,
        y0,
        system,
        relative,
        absolute,
        setup.step,
        setup.adjoint,
        told,
        ticking,
    )
    return Marched(y if watch is None else watch(samples, y), steps, None)


def _by_blocks(
    system: System, prepared: Prepared, setup: RunSetup, field, y0, ticking, watch, told, judged
) -> Marched:
    blocks, ladder = prepared.blocks, prepared.ladder
    assert blocks is not None and ladder is not None
    refine = 1 if ticking is None else ticking.refine
    course = run_through(
        lambda t, y: field(t, y, system),
        ladder,
        dataclasses.replace(blocks, samples=blocks.samples[::refine]),
        lambda t, y: line_speed(t, y, system),
        y0,
        Method(setup.solver.evaluations, judged, setup.room is not None),  # pyright: ignore
        None if ticking is None else ticking.tick,
        watch,
        told,
    )
    steps = jnp.asarray(setup.intervals * setup.substeps)
    error = None
    if judged and watch is None:
        error = error_by_blocks(ladder, course, setup.interval, setup.intervals, system)
    return Marched(course.kept, steps, error)


def _by_single_steps(
    system: System,
    prepared: Prepared,
    setup: RunSetup,
    terms,
    samples,
    jumps,
    y0,
    ticking,
    watch,
    told,
    judged,
) -> Marched:
    solver, A = setup.solver, prepared.linear
    coarse, steps = samples.shape[0], (setup.count - 1) * solver.substeps  # pyright: ignore
    if ticking is not None:
        samples = ticking.fine(samples)
        solver = stepped(solver, -(-solver.substeps // ticking.refine))  # pyright: ignore
    at = knots(samples, jumps)
    rows = n_free(system) if solver.linear_part is None else 0  # pyright: ignore
    solver = ETD4RK(solver.substeps, A, at.lengths, rows)  # pyright: ignore
    state = solver.init(terms, samples[0], samples[1], y0, system)
    if judged := judged and watch is None:
        none = Defect.none(y0.size - rows)
        state = eqx.tree_at(lambda s: s.memory.defect, state, none, is_leaf=lambda x: x is None)
    ticks = None
    if ticking is not None:
        due = jnp.zeros((at.times.size, ticking.due.shape[1]), bool).at[at.samples].set(ticking.due)
        ticks = (ticking.tick, due)
    wanted = at.samples if ticking is None else at.samples[:: ticking.refine][:coarse]
    found = march(solver, terms, at._replace(samples=wanted), y0, system, state, told, ticks, watch)
    if not judged:
        return Marched(jax.tree.map(lambda x: x[wanted], found), jnp.asarray(steps), None)
    y, defects = found
    interval = samples[1] - samples[0]
    flow = Flow(setup.linearised_at, *solver.flow(state), prepared.by_speed[rows:])  # pyright: ignore
    error = run_error(
        lambda w: flow,
        interval / solver.substeps,
        y[at.samples],
        by_samples(at, defects),
        interval,
        samples.shape[0] - 1,
        system,
    )
    return Marched(y[wanted], jnp.asarray(steps), error)
