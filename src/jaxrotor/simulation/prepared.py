"""What a run is prepared by, beside its start: what is linear of the machine, its steps and their weights."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.quick import quickly_compiled
from ..integrators.blocks import LENGTH, Blocks, between_jumps, blocks_of
from ..integrators.exponential import ETD4RK, ExponentialAdams
from ..integrators.fitted_weights import Parts
from ..integrators.ladder import (
    Chains,
    Ladder,
    ladder_of,
    mixed_for,
    nearest_rungs,
    rung_speeds,
)
from ..machine.field import jacobians, n_free
from ..machine.layout import count_of_free
from ..machine.machine import Machine
from ..machine.system import System, jump_times
from .assembling import system_of, systems_of
from .known_chains import known_chains
from .remembered import Remembered
from .run_setup import RunSetup
from .sampling_grid import Ticking
from .solver import is_planned
from .start import needs_balanced
from .state_parts import parts_of


class Prepared(eqx.Module):
    """What a march needs beside system and setup. Of `ETD4RK`, `linear`: A, and `by_speed`: dA/dw. Of the
    Adams method, the `blocks` of its steps, and the `ladder` of their weights."""

    linear: Float[Array, "d d"] | None = None
    by_speed: Float[Array, "d d"] | None = None
    blocks: Blocks | None = None
    ladder: Ladder | None = None


class Known(NamedTuple):
    """What pilots and a run find by the same programs, compiled once: A at each rung, and of regular steps
    there, and each part of the state, what weights are mixed from."""

    linear: Any  # (s, d, d), JAX's or NumPy's
    chains: tuple[Chains, ...] | None = None


@quickly_compiled
def rungs_of(
    balanced: System, top: Float[Array, ""], slowest: Float[Array, ""]
) -> tuple[Float[Array, " s"], Float[Array, "s d d"]]:
    """The rungs of a machine, its nominal system, that turns up to `top`, and never below `slowest` (rad/s):
    speeds (rad/s), and A there."""
    speeds = rung_speeds(top, slowest)
    return speeds, jacobians(balanced, speeds)


class Steps(NamedTuple):
    """`blocks` of a run; speeds (rad/s) of their parts of intervals, and at the start."""

    blocks: Blocks
    of_parts: Float[Array, " o"]
    start: Float[Array, ""]


# A at each rung, of machines that have run last.
_rungs: Remembered[Array] = Remembered(2)


def known_of(machine: Machine, setup: RunSetup) -> Known | None:
    """For a run alone; `None` where its solver has another linear part or steps of its own."""
    solver = setup.solver
    if not isinstance(solver, ExponentialAdams) or solver.linear_part is not None:
        return None
    reach = reach_of(setup)
    linear = _rungs.get((machine, reach), None)
    if linear is None:
        balanced = system_of(machine, nominal=True)
        linear = _rungs.put((machine, reach), None, rungs_of(balanced, *reach)[1])
    return Known(linear)


def reach_of(setup: RunSetup) -> tuple[Array, Array]:
    """The highest and the lowest speed, rad/s."""
    return jax.device_put((2 * np.asarray(setup.linearised_at), np.asarray(setup.slowest)))


# Of the linear parts that have run last, and their steps: a machine whose unbalance or load alone is another
# has the same weights.
_ladders: Remembered[Ladder] = Remembered(2)


def with_ladder(
    machine: Machine, setup: RunSetup, known: Known, steps: Steps, extra: int = 0
) -> Prepared:
    """By programs that plans have used: outside of any other. `extra`: as of `prepare`."""
    order, rows = setup.solver.order_, count_of_free(machine)  # pyright: ignore
    of = known.linear, steps, setup.regular, reach_of(setup), setup.excitation
    ladder = _ladders.get(of, (order, rows, extra))
    if ladder is None:
        ladder = _ladders.put(
            of, (order, rows, extra), _ladder(setup, known, steps, order, rows, extra)
        )
    return Prepared(blocks=steps.blocks, ladder=ladder)


def _ladder(
    setup: RunSetup, known: Known, steps: Steps, order: int, rows: int, extra: int
) -> Ladder:
    of_parts = np.asarray(steps.of_parts)
    top, slowest = map(np.asarray, reach_of(setup))
    A, speeds = np.asarray(known.linear), np.asarray(rung_speeds(top, slowest, xp=np))
    A = np.pad(A, [(0, 0), (0, extra), (0, extra)])
    h = np.full(speeds.shape, np.asarray(setup.regular))
    parts, excitation = parts_of(A, rows), np.asarray(setup.excitation)
    chains, beside = known_chains(A, h, speeds, excitation, order, parts), None
    if of_parts.size:
        at = nearest_rungs(speeds, of_parts, xp=np)
        lengths = np.asarray(steps.blocks.lengths)
        beside = known_chains(A[at], lengths, of_parts, excitation, order, parts)
    here = jax.device_put((speeds, h[0]))
    of_parts = steps.of_parts, steps.blocks.lengths
    found = _mixed(here[0], here[1], order, *of_parts, setup.span, setup.excitation)
    mixed = jax.tree.map(np.asarray, found)
    # in NumPy's arrays: for each machine the least that is compiled
    own: Any = jax.tree.map(np.asarray, (speeds, A, h[0], steps))
    known_of_it: Any = dict(chains=chains, beside=beside, mixed=mixed, parts=parts, span=setup.span)
    known_of_it |= dict(excitation=excitation, xp=np)
    ladder = ladder_of(own[0], own[1], own[2], order, rows, *own[3], **known_of_it)
    return jax.device_put(ladder)


_mixed = quickly_compiled(mixed_for)


def assembled(
    machine: Machine, setup: RunSetup, known: Known | None = None
) -> tuple[System, System | None]:
    """The system, and where the run needs it the one without what turns with the shaft."""
    solver = setup.solver
    linear = known is None and is_planned(solver) and solver.linear_part is None  # pyright: ignore
    needed = linear or needs_balanced(setup.initial)
    return systems_of(machine) if needed else (system_of(machine), None)


def linear_parts(setup: RunSetup, balanced: System) -> Array:
    """A at some speeds, (s, d, d): of `ETD4RK` at one and at rest; of the Adams method at each rung."""
    speeds = rung_speeds(2 * setup.linearised_at, setup.slowest)
    if isinstance(setup.solver, ETD4RK):
        speeds = jnp.stack([setup.linearised_at, jnp.zeros(())])
    return jacobians(balanced, speeds)


def prepare(
    system: System,
    balanced: System | None,
    setup: RunSetup,
    known: Known | None = None,
    extra: int = 0,
) -> Prepared:
    """`known`: beforehand. `extra`: states that follow the machine's own."""
    solver, w = setup.solver, setup.linearised_at
    if not is_planned(solver):
        return Prepared()
    if solver.linear_part is not None:  # pyright: ignore
        A = solver.linear_part  # pyright: ignore
        A, speeds = jnp.stack([A, A]) if isinstance(solver, ETD4RK) else A[None], w[None]
    else:
        A = linear_parts(setup, balanced) if known is None else known.linear  # pyright: ignore
        speeds = rung_speeds(2 * w, setup.slowest)
    A = jnp.pad(A, [(0, 0), (0, extra), (0, extra)])
    if isinstance(solver, ETD4RK):
        by_speed = jnp.where(w != 0.0, (A[0] - A[1]) / jnp.where(w != 0.0, w, 1.0), 0.0)
        return Prepared(linear=A[0], by_speed=by_speed)
    refine, steps = steps_of(system, setup)
    # of our own A the leading rows, rates of the coordinates, are all there is
    rows = n_free(system) if solver.linear_part is None else 0  # pyright: ignore
    h = setup.regular if refine == 1 else setup.interval / refine / -(-setup.substeps // refine)
    parts = None
    if setup.parts is not None and rows and sum(map(len, setup.parts)) == A.shape[-1]:
        parts = Parts(setup.parts, rows)
    more: Any = dict(parts=parts, span=setup.span, excitation=setup.excitation)
    ladder = ladder_of(speeds, A, h, solver.order_, rows, *steps, **more)  # pyright: ignore
    return Prepared(blocks=steps.blocks, ladder=ladder)


def steps_of(system: System, setup: RunSetup) -> tuple[int, Steps]:
    """Of the Adams method; and into how many parts clocks refine a sample interval."""
    ticking = ticking_of(setup, system)
    refine = 1 if ticking is None else ticking.refine
    jumps, length = jump_times(system), setup.block
    if setup.room is None:
        # all steps of a block are gone through, used or not, of the short ones of a start too
        length = min(length, max(LENGTH, int(setup.steps) // 256))
    if jumps.size:  # with room or without it, so that members of batches are single runs
        order, most = setup.solver.order_, setup.most_steps  # pyright: ignore
        length = min(length, between_jumps(order, jumps.size, most, setup.span))
    blocks = blocks_of(
        setup.interval / refine,
        setup.intervals * refine,
        -(-setup.substeps // refine),
        setup.solver.order_,  # pyright: ignore
        jumps,
        None if ticking is None else ticking.due,
        length=length,
        room=None if setup.room is None else setup.room.most,
        span=setup.span,
    )
    of_parts = jax.vmap(lambda t: system.reference(t)[1])(blocks.starts)
    start = system.reference(jnp.zeros(()))[1] if setup.speed is None else setup.speed
    return refine, Steps(blocks, of_parts, start)


def ticking_of(setup: RunSetup, system: System) -> Ticking | None:
    d = 2 * n_free(system) + system.n_states()
    return None if setup.grid is None else Ticking(setup.grid, system, setup.count, d)
