"""Choosing the step, outside jit, by a rule and short pilot runs."""

import math
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, positive, whole
from ..core.errors import ConvergenceError, InputError
from ..core.gate import takes
from ..core.parameter import is_concrete
from ..core.protocol import AbstractPrescribed
from ..core.quick import quickly_compiled
from ..integrators.exponential import ExponentialAdams
from ..machine.field import initial_states, jacobian, n_free, relative_field
from ..machine.machine import Machine
from ..machine.system import assemble
from .blame import not_finite
from .plan import Plan, bucket, fewest
from .prescribed import Prescribed, fastest, in_numbers, prescribed_until, top_speed
from .run_error import share_of_peaks
from .simulation import Simulation, as_simulation, end_or_simulation

_PILOT_SAMPLES = 64
# Instants at which pilots run, at most.
_PILOTS = 8


@takes(
    t_end=end_or_simulation,
    sample_rate=positive("Hz"),
    speed=number("rad/s"),
    tolerance=number(above=0.0, below=1.0),
    order=whole(2, 7),
)
def plan(
    machine: Machine,
    t_end: float | Simulation,
    sample_rate: float | None = None,
    speed: Any = None,
    tolerance: float | None = None,
    order: int | None = None,
) -> Plan:
    """The number of steps in a sample interval that keeps the error below `tolerance` (by default 5e-5).

    A first guess turns the machine, and the fastest of what is given in time, by a quarter radian a step
    at the highest speed that its drive reaches (or at `speed`). Pilots then run 64 samples at that speed
    with this step and with half of it, under the loads as they are there and behind jumps, and the step is
    refined until their difference, as part of each coordinate's peak, is below `tolerance`. What no pilot
    sees, `simulate` finds in the finished run.

    `t_end` (s) may be a whole `Simulation`, which brings the rest. Raises `InputError` for wrong input and
    for a traced machine (plan first, then `jit`), `ConvergenceError` where no step is found.
    """
    simulation = as_simulation(
        t_end, dict(sample_rate=sample_rate, speed=speed, tolerance=tolerance)
    )
    return find_plan(
        machine,
        simulation.t_end,
        simulation.sample_rate,
        simulation.speed,
        simulation.planned_tolerance,
        order or simulation.order,
    )


def find_plan(
    machine: Machine, t_end: float, sample_rate: float, speed: Any, tolerance: float, order: int
) -> Plan:
    if not all(is_concrete(x) for x in jax.tree.leaves(machine)):
        raise InputError(
            "the step cannot be chosen inside jit or vmap: call `plan = jr.plan(machine, t_end, "
            "sample_rate)` before, and pass `step=plan` to `simulate`"
        )
    machine.check()
    given, machine = prescribed_until(machine, t_end), in_numbers(machine)
    interval = 1.0 / sample_rate
    when, top = fastest(given, t_end, speed)
    substeps = fewest(max(top, float(given.frequency)), interval)
    instants = jnp.asarray(_instants(machine, given, when, t_end))
    error = math.inf
    for _ in range(6):
        at = [instants, *(jnp.asarray(x) for x in (interval, substeps, top))]
        error = float(pilot(machine, at[0], at[1], at[2], at[3], order))
        if error <= tolerance:
            break
        if not math.isfinite(error):
            substeps = bucket(2 * substeps)
            continue
        growth = min(4.0, 1.05 * (error / tolerance) ** (1 / (order + 1)))
        substeps = bucket(max(substeps + 1, substeps * growth))
    else:
        blame = None if math.isfinite(error) else not_finite(machine, instants)
        if blame:
            raise InputError(f"{blame} before anything moves: mend its law")
        raise ConvergenceError(
            f"no step was found that keeps the error below {tolerance:g}: at {substeps} steps a "
            f"sample the pilot still differs by {error:.1e}; raise the sample rate, give "
            "shafts without damping some (rayleigh=..., their short waves ring for ever), or choose a solver "
            "for stiff nonlinearity such as jr.Rosenbrock()"
        )
    return Plan(substeps, order, 0.5 * top, top, error, tolerance)


def plan_for(machine: Machine, simulation: Simulation, speed: Any) -> Plan:
    """What an exponential solver is to step by: the plan that was given, one for the step that was, or one
    that is chosen. `speed`: at the start, rad/s."""
    step, order, rate = simulation.step, simulation.order, simulation.sample_rate
    if isinstance(step, Plan):
        return step
    if step is None:
        t_end, tolerance = simulation.t_end, simulation.planned_tolerance
        return find_plan(machine, t_end, rate, speed, tolerance, order)
    try:
        valid = 0 < float(step) < float("inf")
    except (TypeError, ValueError):  # a tracer's refusal is a TypeError
        valid = False
    if not valid:
        raise InputError(f"step must be a Plan or a positive number in s, but is {step!r}")
    top = 0.0
    if all(is_concrete(x) for x in jax.tree.leaves((machine, speed))):
        top = top_speed(machine, simulation.t_end, speed)[1]
    nan = float("nan")
    return Plan(bucket(1.0 / rate / float(step)), order, 0.5 * top, top, nan, nan)


def unresolved(machine: Machine, plan: Plan, t_end: float, interval: float) -> bool:
    """Whether something swings by more than half a turn in a step: what the steps see tells nothing then."""
    given = prescribed_until(machine, t_end)
    return max(plan.top_speed, float(given.frequency)) * interval / plan.substeps > math.pi


def _instants(machine: Machine, given: Prescribed, when: float, t_end: float) -> np.ndarray:
    """Of the pilots: `when`, and behind some of the jumps. (Two drives stand apart by what one has run ahead
    of the other: a pilot, which begins undeformed, has no sense there.)"""
    drives = sum(isinstance(station, AbstractPrescribed) for station in machine.stations)
    if drives + len(machine.motions) > 1:
        return np.array([when])
    jumps = np.unique(np.asarray(given.jumps))
    jumps = jumps[(jumps > 0) & (jumps < t_end)]
    some = np.unique(np.linspace(0, jumps.size - 1, _PILOTS - 1).astype(int)) if jumps.size else []
    return np.append(np.nextafter(jumps[some], np.inf) if jumps.size else [], when)


@quickly_compiled
def pilot(machine, instants, interval, substeps, top, order: int) -> Float[Array, ""]:
    """Largest difference between a step and its half, over all pilots, as part of the peak.

    The number of steps is traced: one program serves every step that is tried.
    """
    if instants.ndim == 0:
        return _pilot_at(machine, instants, interval, substeps, top, order)
    # the last at top speed, the others at the drive's own there
    own = jnp.abs(jax.vmap(lambda t: assemble(machine).reference(t)[1])(instants))
    speeds = jnp.where(own > 0, own, top).at[-1].set(top)
    return jnp.max(
        jax.lax.map(
            lambda x: _pilot_at(machine, x[0], interval, substeps, x[1], order), (instants, speeds)
        )
    )


def _pilot_at(machine, when, interval, substeps, top, order: int) -> Float[Array, ""]:
    system = assemble(machine)
    A = jacobian(assemble(machine, nominal=True), 0.5 * top)
    n = n_free(system)
    y0 = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])
    solver = ExponentialAdams(order, 1, A, None, n)
    angle = system.reference(when)[0]

    # at a constant speed, loads as they are at that instant: no jump falls into the pilot
    def turning(t, y, system):
        return relative_field(when, y, system, (angle + top * (t - when), top, jnp.zeros_like(t)))

    terms = diffrax.ODETerm(turning)

    def run(count):
        h = interval / count
        state = solver.init(terms, when, when + h, y0, system)

        def sample(carry, k):
            def step(i, carry):
                y, memory = carry
                t = when + k * interval + i * h
                now = eqx.tree_at(lambda s: s.memory, state, memory)
                none = jnp.array(False)
                y, memory = solver.advance(terms, t, t + h, y, system, now, none, 0)
                return y, memory

            carry = jax.lax.fori_loop(0, count, step, carry)
            return carry, carry[0]

        return jax.lax.scan(sample, (y0, state.memory), jnp.arange(_PILOT_SAMPLES))[1]

    coarse, fine = jax.lax.map(run, jnp.stack([substeps, 2 * substeps]))
    error = jnp.max(jnp.abs(coarse - fine)[:, :n], axis=0)
    peak = jnp.max(jnp.abs(fine)[:, :n], axis=0)
    return share_of_peaks(error, peak, system)
