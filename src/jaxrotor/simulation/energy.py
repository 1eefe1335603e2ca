"""The energy audit: what went in, what is stored, what was lost."""

import dataclasses
import math
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, positive
from ..core.errors import InputError, SimulationFailed
from ..core.gate import either, takes
from ..core.kinematics import from_turning
from ..core.protocol import (
    AbstractAttachment,
    Acting,
    Energetic,
    Massive,
    Powered,
    first_of,
    is_massive,
)
from ..core.quick import lightly_compiled, traced
from ..core.result_text import shows
from ..machine.field import Evaluation, evaluate, watched_field
from ..machine.layout import joined
from ..machine.lineup import line_up
from ..machine.machine import Machine
from ..machine.seen import seen
from ..machine.system import Actor, System, clock
from .assembling import system_of
from .beginning import Begun, begun
from .checks import sample_count
from .condensing import condensed_for
from .march_through import march_through
from .planned import RETRIES, Plan, refined
from .run_setup import RunSetup, roomy, set_up
from .simulation import Simulation, as_simulation, end_or_simulation
from .solver import is_planned, solver_for
from .step_choice import plan_for

# An error in the motion appears twice over in its energy: the step is planned finer than a run's.
_TOLERANCE = 1e-6
_RTOL = 1e-8


@shows(t="s", kinetic="J", elastic="J", potential="J", work_in="J", lost="J", relative="")
class EnergyAudit(eqx.Module):
    """Energies over time, (nt,) each, J.

    `kinetic + elastic + potential - work_in + lost` should be constant; `residual` is how far it is
    from its first value. `work_in` is done by drives (reactions of given motions) and by loads.
    """

    t: Float[Array, " nt"]
    kinetic: Float[Array, " nt"]
    elastic: Float[Array, " nt"]
    potential: Float[Array, " nt"]
    work_in: Float[Array, " nt"]
    lost: Float[Array, " nt"]

    @property
    def residual(self) -> Float[Array, " nt"]:
        total = self.kinetic + self.elastic + self.potential - self.work_in + self.lost
        return total - total[..., :1]

    @property
    def exchanged(self) -> Float[Array, ""]:
        """The largest energy that any of the accounts has moved, J."""
        accounts = (self.kinetic, self.elastic, self.potential, self.work_in, self.lost)
        return jnp.max(jnp.stack([jnp.ptp(x, axis=-1) for x in accounts]), axis=0)

    @property
    def relative(self) -> Float[Array, ""]:
        """Largest residual as part of the energy exchanged."""
        return jnp.max(jnp.abs(self.residual), axis=-1) / self.exchanged


@takes(
    t_end=end_or_simulation,
    step=either(Plan, positive("s")),
    speed=number("rad/s"),
    sample_rate=positive("Hz"),
    rtol=number(above=0.0, below=1.0),
)
def energy_audit(
    machine: Machine,
    t_end: float | Simulation,
    sample_rate: float | None = None,
    initial: Any = "static",
    speed: Any = None,
    step: Plan | float | None = None,
    rtol: float | None = None,
) -> EnergyAudit:
    """Runs the machine with its powers integrated beside it, by the same solver and step.

    Energies and losses come from the elements' own `energy`, `power_lost`, `kinetic_energy` and
    `height_energy`, which are written apart from their forces, so a balance means something. An
    attachment without an energy of its own is a load: its power counts as work put in. Arguments as
    for `simulate`, a whole `Simulation` among them, but what they leave open is finer: the step is planned
    for an error of 1e-6, no longer than from sample to sample, and an adaptive solver keeps to `rtol` 1e-8.
    Raises `InputError` for wrong input, and where an elastic element keeps no account of its energy;
    `ConvergenceError` where no step is found; `SimulationFailed` where the run leaves the finite numbers,
    with the audit until there as its `response`.
    """
    settings = dict(sample_rate=sample_rate, initial=initial, speed=speed, step=step, rtol=rtol)
    simulation = as_simulation(t_end, settings)
    speed = simulation.check(machine)
    for name, element in machine.elements().items():
        if isinstance(element, Acting) and not isinstance(element, (Energetic, AbstractAttachment)):
            raise InputError(
                f"`{name}`: {type(element).__name__} keeps no account of its energy: let the class "
                "inherit jaxrotor.protocols.Energetic and define energy and power_lost"
            )
    machine = condensed_for(machine, simulation, simulation.tolerance or _TOLERANCE)
    plan = None
    if is_planned(solver_for(machine, simulation.solver)):
        if simulation.step is None and simulation.tolerance is None:
            simulation = dataclasses.replace(simulation, tolerance=_TOLERANCE)
        plan = plan_for(machine, simulation, speed)
        if simulation.step is None:  # powers are products of states: no weight knows how these ring
            plan = plan.by_samples()
    elif simulation.step is None:
        rtol = simulation.rtol or _RTOL
        simulation = dataclasses.replace(simulation, rtol=rtol, atol=simulation.atol or 1e-3 * rtol)
    count = sample_count(simulation.t_end, simulation.sample_rate)
    retries = 0 if plan is None or simulation.step is not None else RETRIES
    setup, y, sample = _marched(machine, simulation, speed, plan, count)
    while sample is not None and plan is not None and retries:
        plan, retries = refined(plan, math.inf), retries - 1  # something moved that no pilot saw
        setup, y, sample = _marched(machine, simulation, speed, plan, count)
    audit = _audit(machine, system_of(machine), setup.times, y)
    if sample is not None:
        t = np.asarray(setup.times)
        raise SimulationFailed(
            f"energy_audit: the run left the finite numbers between t = {t[max(0, sample - 1)]:.6g} s and "
            f"{t[sample]:.6g} s: take a smaller step (step=...), or look for an instability of the machine "
            f"there; the {sample} samples before are in the exception's `response`",
            jax.tree.map(lambda x: x[:sample], audit),
        )
    return audit


def _marched(
    machine: Machine, simulation: Simulation, speed: Any, plan: Plan | None, count: int
) -> tuple[RunSetup, Float[Array, "nt d+2"], int | None]:
    """And the first sample that is not finite."""
    setup = set_up(machine, simulation, speed, plan, count)
    alone = not traced(machine, setup)
    own = roomy(setup, told=False) if alone else setup
    y = _march(machine, own.started, begun(machine, own, alone, extra=2))[:count]
    if not alone:
        return setup, y, None
    fine = np.isfinite(np.asarray(y)).all(axis=1)
    return setup, y, None if fine.all() else int(np.argmin(fine))


@lightly_compiled
def _march(machine: Machine, setup: RunSetup, begun: Begun) -> Float[Array, "nt d+2"]:
    """States, with the work put in and what was lost behind them."""
    system, y0, _, prepared = begun
    books = _books(machine, system)

    def field(t, y, system):
        return _field_and_powers(t, y, system, books)

    return march_through(system, prepared, setup, jnp.concatenate([y0, jnp.zeros(2)]), field).kept


@eqx.filter_jit  # as `relative_field`
def _field_and_powers(t, y, system: System, books) -> Float[Array, " d+2"]:
    dy, ev = watched_field(t, y[:-2], system)
    return jnp.concatenate([dy, jnp.stack(_powers(t, ev, system, books))])


@lightly_compiled
def _audit(machine: Machine, system: System, t: Array, y: Array) -> EnergyAudit:
    books, d = _books(machine, system), y.shape[1] - 2
    stored = jax.vmap(lambda t, y: _stored(t, evaluate(t, y, system), system, books))
    kinetic, elastic, potential = stored(t, y[:, :d])
    return EnergyAudit(t, kinetic, elastic, potential, y[:, d], y[:, d + 1])


class _Book(NamedTuple):
    """Of stacked elements that keep accounts or act from outside."""

    actor: Actor
    energetic: bool

    @property
    def element(self) -> Any:
        return self.actor.element


def _books(machine: Machine, system: System) -> list[_Book]:
    layout, lineup = system.layout, line_up(machine)
    groups = [
        (element, (tuple(range(g.start, g.stop)),))
        for element, g in zip(system.stations, layout.stations)
    ]
    groups += joined(lineup, layout)
    late = [None if i is None else system.actors[i].late for i in system.acting]
    return [
        _Book(Actor(element, nodes, rows, own), isinstance(element, Energetic))
        for (element, nodes), rows, own in zip(groups, system.rows, late)
        if isinstance(element, (Energetic, Acting, Massive))
    ]


def _each(t, ev: Evaluation, book: _Book, method: str):
    actor = book.actor
    # by the clock that the field goes by: a load that jumped a moment before would have its work counted
    time, axis = clock(t, actor.late)
    return jax.vmap(
        lambda e, t, m, s: getattr(e, method)(t, m, s), in_axes=(-1, axis, -1, -1), out_axes=-1
    )(actor.element, time, actor.motions(*ev.nodes), actor.own_states(ev.states))


def _powers(t, ev: Evaluation, system: System, books) -> tuple[Array, Array]:
    """Power put in by drives and loads, and power lost, W."""
    put_in = jnp.sum(ev.reaction * ev.v)
    lost = jnp.zeros(())
    for book in books:
        if isinstance(book.element, Powered):
            put_in = put_in + jnp.sum(_each(t, ev, book, "power_in"))
        if book.energetic:
            lost = lost + jnp.sum(_each(t, ev, book, "power_lost"))
        elif isinstance(book.element, Acting):
            forces = _each(t, ev, book, "forces") or ()
            for nodes, force in zip(book.actor.nodes, forces):
                put_in = put_in + jnp.sum(force * ev.nodes[1][:, list(nodes)])
    if ev.answer is not None:
        put_in = put_in + _answered(ev, system)
    return put_in, lost


def _answered(ev: Evaluation, system: System) -> Array:
    """Power of what answers to accelerations and keeps no account, W."""
    total, first = jnp.zeros(()), 0
    assert ev.answer is not None
    for actor in system.inertial:
        nodes = list(actor.nodes[0])
        force = ev.answer[:, first : first + len(nodes)]
        if not isinstance(actor.element, Energetic):
            total += jnp.sum(force * ev.nodes[1][:, nodes])
        first += len(nodes)
    return total


def _stored(t, ev: Evaluation, system: System, books) -> tuple[Array, Array, Array]:
    """Kinetic, elastic and potential energy, J."""
    kinetic = potential = elastic = jnp.zeros(())
    invariant = system.layout.invariant
    for element, group in zip(system.stations, system.layout.stations):
        at = slice(group.start, group.stop)
        q, v = ev.q[:, at], ev.v[:, at]
        kinetic += jnp.sum(
            jax.vmap(
                lambda e, q, v: seen(e, invariant).kinetic_energy(q, v), in_axes=-1, out_axes=-1
            )(element, q, v)
        )
        potential += jnp.sum(
            jax.vmap(
                lambda e, q: seen(e, invariant).height_energy(q, system.gravity),
                in_axes=-1,
                out_axes=-1,
            )(element, q)
        )
    for book in books:
        element = book.element
        if is_massive(first_of(element)):
            motions = book.actor.motions(*ev.nodes)
            if invariant:
                motions = tuple(from_turning(*motion) for motion in motions)
            each = jax.vmap(
                lambda e, m: (e.kinetic_energy(m), e.height_energy(m, system.gravity)),
                in_axes=-1,
                out_axes=-1,
            )(element, motions)
            kinetic, potential = kinetic + jnp.sum(each[0]), potential + jnp.sum(each[1])
        if book.energetic:
            elastic += jnp.sum(_each(t, ev, book, "energy"))
    return kinetic, elastic, potential
