"""A simulation as compiled programs take it, and the march through its samples: one for runs, sweeps and
energy audits."""

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..integrators.adaptive import adaptive_samples
from ..integrators.defect import Defect
from ..integrators.exponential import ETD4RK, AbstractExponential, ExponentialAdams
from ..integrators.march import march
from ..integrators.step_times import knots
from ..machine.field import jacobian, n_free, vector_field
from ..machine.machine import Machine
from ..machine.system import System, assemble, jump_times
from .plan import Plan
from .run_error import by_samples, run_error
from .sampling_grid import Grid, Ticking, grid_of
from .simulation import ATOL, RTOL, Simulation
from .solver import is_planned, solver_for, tolerances
from .start import needs_balanced


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
    count: int = eqx.field(static=True)  # samples
    grid: Grid | None = eqx.field(static=True)

    @property
    def times(self) -> Float[Array, " nt"]:
        return jnp.arange(self.count) * self.interval


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
        solver = stepped(solver, plan.substeps, plan.order)
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


def stepped(solver: Any, substeps: int, order: int | None = None) -> AbstractExponential:
    """With so many steps in a sample interval."""
    if isinstance(solver, ETD4RK):
        return ETD4RK(substeps, solver.linear_part)
    solver = ExponentialAdams() if solver is None else solver
    return ExponentialAdams(order or solver.order_, substeps, solver.linear_part)


class Prepared(NamedTuple):
    """What a march needs beside the setup. `linear`: A of the exponential solvers; `by_speed`: dA/dw, where
    the run's error is wanted."""

    system: System
    linear: Float[Array, "d d"] | None
    by_speed: Float[Array, "d d"] | None


def assembled(machine: Machine, setup: RunSetup) -> tuple[System, System | None]:
    """The system, and where the run needs it the one without what turns with the shaft."""
    solver = setup.solver
    linear = is_planned(solver) and solver.linear_part is None  # pyright: ignore
    needed = linear or needs_balanced(setup.initial)
    return assemble(machine), assemble(machine, nominal=True) if needed else None


def prepare(
    system: System,
    balanced: System | None,
    setup: RunSetup,
    linear: Any = None,
    judged: bool = False,
) -> Prepared:
    """`linear`: A, where it is known beforehand. `judged`: whether the march is to tell its error."""
    if not is_planned(setup.solver):
        return Prepared(system, None, None)
    A, w = setup.solver.linear_part if linear is None else linear, setup.linearised_at  # pyright: ignore
    if A is not None:
        return Prepared(system, A, jnp.zeros_like(A) if judged else None)
    assert balanced is not None
    if not judged:
        return Prepared(system, jacobian(balanced, w), None)
    A, rest = jax.vmap(lambda w: jacobian(balanced, w))(jnp.stack([w, 0.0]))
    by_speed = jnp.where(w != 0.0, (A - rest) / jnp.where(w != 0.0, w, 1.0), 0.0)
    return Prepared(system, A, by_speed)


class Marched(NamedTuple):
    """`kept`: the states at the samples, or what `watch` kept of them; `error`: the run's own, as part of
    each coordinate's peak, where it was asked for."""

    kept: Any
    steps: Array
    error: Array | None


def march_through(
    prepared: Prepared,
    setup: RunSetup,
    y0: Float[Array, " d"],
    field: Callable = vector_field,
    watch: Callable | None = None,
    told: bool = False,
) -> Marched:
    """From `y0` through the samples. States of `field` beyond the machine's own follow it (accounts of
    energy). `watch`: what is kept of a block of instants and states, in place of these. `told`: samples are
    handed over while they come."""
    system, samples, jumps = prepared.system, setup.times, jump_times(prepared.system)
    terms = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]
    d = 2 * n_free(system) + system.n_states()
    extra = y0.size - d
    ticking = None if setup.grid is None else Ticking(setup.grid, system, setup.count, d)
    if prepared.linear is not None:
        return _planned(prepared, setup, terms, samples, jumps, y0, extra, ticking, watch, told)
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


def _planned(
    prepared: Prepared, setup: RunSetup, terms, samples, jumps, y0, extra: int, ticking, watch, told
) -> Marched:
    solver, system = setup.solver, prepared.system
    A = jnp.pad(prepared.linear, ((0, extra), (0, extra)))  # pyright: ignore
    coarse, steps = samples.shape[0], (setup.count - 1) * solver.substeps  # pyright: ignore
    if ticking is not None:
        samples = ticking.fine(samples)
        solver = stepped(solver, -(-solver.substeps // ticking.refine))  # pyright: ignore
    at = knots(samples, jumps)
    # of our own A the leading rows, rates of the coordinates, are all there is
    rows = n_free(system) if solver.linear_part is None else 0  # pyright: ignore
    if isinstance(solver, ETD4RK):
        solver = ETD4RK(solver.substeps, A, at.lengths, rows)
    else:
        solver = ExponentialAdams(solver.order_, solver.substeps, A, at.lengths, rows)  # pyright: ignore
    state = solver.init(terms, samples[0], samples[1], y0, system)
    judged = prepared.by_speed is not None
    if judged:
        none = Defect.none(y0.size - rows)
        state = eqx.tree_at(lambda s: s.memory.defect, state, none, is_leaf=lambda x: x is None)
    ticks = None
    if ticking is not None:
        due = jnp.zeros((at.times.size, ticking.due.shape[1]), bool).at[at.samples].set(ticking.due)
        ticks = (ticking.tick, due)
    wanted = at.samples if ticking is None else at.samples[:: ticking.refine][:coarse]
    knots_wanted = at._replace(samples=wanted)
    found = march(solver, terms, knots_wanted, y0, system, state, told, ticks, watch)
    if not judged:
        return Marched(jax.tree.map(lambda x: x[wanted], found), jnp.asarray(steps), None)
    y, defects = found
    error = run_error(
        solver.flow(state),
        (samples[1] - samples[0]) / solver.substeps,
        solver.substeps,
        prepared.by_speed,  # pyright: ignore
        setup.linearised_at,
        samples,
        y[at.samples],
        by_samples(at, defects),
        system,
    )
    return Marched(y[wanted], jnp.asarray(steps), error)
