"""The march of a run through its samples: one for runs, sweeps and energy audits."""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import equinox as eqx
import equinox.internal as eqxi
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..integrators.adaptive import adaptive_samples
from ..integrators.defect import Defect
from ..integrators.exponential import ETD4RK
from ..integrators.fitted import Method, run_through
from ..integrators.march import march
from ..integrators.rosenbrock import Rosenbrock
from ..integrators.step_times import knots
from ..machine.field import n_free, vector_field
from ..machine.line_speed import line_speed
from ..machine.slopes_by_parts import SlopesByParts
from ..machine.system import System, jump_times
from .prepared import Prepared, ticking_of
from .run_error import Flow, by_samples, error_by_blocks, run_error
from .run_setup import RunSetup, stepped
from .solver import tolerances

_FORWARD = "adjoint: a run with diffrax.ForwardMode() knows no reverse mode: leave it out"


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
        _slopes(system, setup, extra),
    )
    return Marched(y if watch is None else watch(samples, y), steps, None)


# With fewer states a tangent of the field for each is as quick.
_FEW = 40


def _slopes(system: System, setup: RunSetup, extra: int) -> SlopesByParts | None:
    """What `Rosenbrock` is given, of a field of the machine's own states that is large enough."""
    stiff = isinstance(setup.solver, Rosenbrock)
    size = 2 * n_free(system) + system.n_states()
    if not stiff or extra or size < _FEW or not SlopesByParts.serve(system):
        return None
    return SlopesByParts.of(system)


def _by_blocks(
    system: System, prepared: Prepared, setup: RunSetup, field, y0, ticking, watch, told, judged
) -> Marched:
    blocks, ladder = prepared.blocks, prepared.ladder
    assert blocks is not None and ladder is not None
    refine = 1 if ticking is None else ticking.refine
    forward = isinstance(setup.adjoint, diffrax.ForwardMode)
    course = run_through(
        lambda t, y: field(t, y, system),
        ladder,
        dataclasses.replace(blocks, samples=blocks.samples[::refine]),
        lambda t, y: line_speed(t, y, system),
        y0,
        Method(
            setup.solver.evaluations,  # pyright: ignore
            judged,
            lasting=setup.room is not None,
            forward=forward,
            abreast=setup.abreast,
        ),
        None if ticking is None else ticking.tick,
        watch,
        told,
    )
    steps = jnp.asarray(setup.intervals * setup.substeps)
    error = None
    if judged and watch is None:
        error = error_by_blocks(ladder, course, setup.interval, setup.intervals, system)
    kept = eqxi.nondifferentiable_backward(course.kept, msg=_FORWARD) if forward else course.kept
    return Marched(kept, steps, error)


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
