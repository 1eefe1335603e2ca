"""A simulation as compiled programs take it: one for runs, sweeps and energy audits."""

import dataclasses
from typing import Any

import diffrax
import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..core.block_matrix import Places
from ..integrators.blocks import LENGTH
from ..integrators.exponential import ETD4RK, AbstractExponential, ExponentialAdams
from ..integrators.progress import PARTS
from ..machine.machine import Machine
from .planned import Plan
from .sampling_grid import Grid, grid_of
from .simulation import ATOL, RTOL, Simulation
from .solver import is_planned, may_span, solver_for


class Room(eqx.Module):
    """For runs of any length and step: the numbers of a run's own intervals, and steps in each. `most`: of
    intervals, steps in all, and steps in an interval."""

    intervals: Int[Array, ""]
    substeps: Int[Array, ""]
    most: tuple[int, int, int] = eqx.field(static=True)


class RunSetup(eqx.Module):
    """Numbers that may change are arrays, so that another value is not another program.

    `linearised_at`: rad/s, of the exponential solvers' linear part; `slowest`: rad/s, of the Adams method's
    `rung_speeds`, `excitation`, rad/s, and `parts` of the state: a plan's. `step`: of adaptive solvers,
    fixed, s. `span`: sample intervals in a step of the Adams method, a power of two; where it is above one,
    its `substeps` are one. `abreast`: whether it is one of a batch, and nothing is differentiated through it.
    """

    solver: diffrax.AbstractSolver[Any]
    initial: Any
    speed: Float[Array, ""] | None
    linearised_at: Float[Array, ""]
    slowest: Float[Array, ""]
    excitation: Float[Array, ""]
    tolerances: Float[Array, "2"]  # rtol, atol
    step: Float[Array, ""] | None
    interval: Float[Array, ""]
    adjoint: diffrax.AbstractAdjoint | None
    count: int = eqx.field(static=True)  # samples, or where there is room the most of them
    grid: Grid | None = eqx.field(static=True)
    room: Room | None = None
    block: int = eqx.field(static=True, default=LENGTH)  # steps by the same weights
    abreast: bool = eqx.field(static=True, default=False)
    parts: Places | None = eqx.field(static=True, default=None)
    span: int = eqx.field(static=True, default=1)

    @property
    def started(self) -> "RunSetup":
        """What goes on from the start: programs are the same however it starts."""
        return dataclasses.replace(self, initial=None)

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

    @property
    def steps(self) -> int | Array:
        """In all."""
        return -(-self.intervals // self.span) * self.substeps

    @property
    def regular(self) -> Float[Array, ""]:
        """Length of a step, s."""
        return self.interval * self.span / self.substeps

    @property
    def most_steps(self) -> int:
        """In all, as a run with room for them has."""
        if self.room is not None:
            return self.room.most[1]
        return _roomy(-(-(self.count - 1) // self.span) * self.solver.substeps, 100)  # pyright: ignore


def roomy(setup: RunSetup, told: bool) -> RunSetup:
    """One program for it and for others like it that are shorter or longer, or step otherwise; for those that
    nothing is differentiated through backwards. `told`: whether samples are handed over while they come."""
    if not isinstance(setup.solver, ExponentialAdams) or setup.grid is not None:
        return setup
    intervals, substeps = setup.count - 1, setup.solver.substeps
    steps = -(-intervals // setup.span) * substeps
    most = _roomy(intervals, 100), _roomy(steps, 100), _roomy(substeps, 8)
    # what is handed over of a short run comes in short parts
    block = 8 if told and most[1] < LENGTH * PARTS else setup.block
    room = Room(jnp.asarray(intervals), jnp.asarray(substeps), most)
    solver = stepped(setup.solver, 1)
    return dataclasses.replace(setup, solver=solver, count=most[0] + 1, room=room, block=block)


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
        jnp.asarray(0.0 if plan is None else plan.slowest, float),
        jnp.asarray(0.0 if plan is None else plan.excitation, float),
        jnp.asarray([rtol, atol], float),
        step,
        jnp.asarray(1.0 / simulation.sample_rate, float),
        simulation.adjoint,
        count,
        grid_of(machine, simulation.sample_rate),
        block=LENGTH if plan is None else plan.block,
        parts=plan.parts.rows_of(machine) if plan and plan.parts else None,
        span=plan.span if plan is not None and may_span(solver, machine) else 1,
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
