"""Choosing the step, outside jit, by a rule and short pilot runs (pilot.py)."""

import math
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from ..core.arguments import number, positive, whole
from ..core.errors import ConvergenceError, InputError
from ..core.gate import takes
from ..core.parameter import is_concrete, numbers
from ..core.protocol import AbstractPrescribed
from ..integrators.blocks import LENGTH, LONGEST
from ..machine.layout import count_of_free
from ..machine.machine import Machine
from .assembling import nominal_of, system_of
from .blame import not_finite
from .condensing import condensed_for
from .known_chains import known_chains
from .pilot import RUNGS, highest_rungs, pilots
from .planned import (
    SPANNING,
    SPANNING_ASKED,
    Plan,
    any_bucket,
    bucket,
    in_whole,
    longest_turn,
)
from .prepared import Known, rungs_of
from .prescribed import Prescribed, fastest, in_numbers, looks, prescribed, prescribed_until
from .remembered import Remembered
from .simulation import Simulation, as_simulation, end_or_simulation
from .solver import is_adams, may_span
from .state_parts import StateParts, opened, parts_of
from .step_search import longest_step, that_pays

# Part of its highest speed from which on a line counts as turning when it starts.
_SLOW = 0.25
# Plans that are kept.
_KEPT = 64
# Instants at which pilots run, at most.
_PILOTS = 8


@takes(
    t_end=end_or_simulation,
    sample_rate=positive("Hz"),
    speed=number("rad/s"),
    tolerance=number(above=0.0, below=1.0),
    order=whole(3, 6),
)
def plan(
    machine: Machine,
    t_end: float | Simulation,
    sample_rate: float | None = None,
    speed: Any = None,
    tolerance: float | None = None,
    order: int | None = None,
) -> Plan:
    """The number of steps in a sample interval, or of sample intervals in a step, that keeps the error below
    `tolerance` (by default 5e-5).

    A first guess turns the machine, and the fastest of what is given in time, by a radian a step at the
    highest speed that its drive reaches (or at `speed`). Pilots then run a hundred steps at that speed with
    this step and with half of it, under the loads as they are there and behind jumps, and the step is refined
    until their difference, as part of each coordinate's peak, is below `tolerance`. What no pilot sees,
    `simulate` finds in the finished run. A plan that was found is kept: the same is not planned twice.

    `t_end` (s) may be a whole `Simulation`, which brings the rest. Raises `InputError` for wrong input and
    for a traced machine (plan first, then `jit`), `ConvergenceError` where no step is found.
    """
    simulation = as_simulation(
        t_end, dict(sample_rate=sample_rate, speed=speed, tolerance=tolerance)
    )
    # with the speed at the start as `simulate` has it, which is not to plan anew
    given = simulation.speed
    asked = Asked.of(simulation, simulation.check(machine) if given is None else given)
    machine = condensed_for(machine, simulation)
    return find_plan(machine, asked if order is None else asked._replace(order=order))


class Asked(NamedTuple):
    """What a plan is for. `speed`: at the start, or reached, rad/s. `steady`: whether the run starts on its
    periodic whirl. `spanning`: as of a `Plan`. `adams`: whether the Adams method steps."""

    t_end: float
    sample_rate: float
    speed: float | None
    tolerance: float
    order: int
    steady: bool
    spanning: float = SPANNING
    adams: bool = True

    @classmethod
    def of(cls, simulation: Simulation, speed: Any) -> "Asked":
        own = None if speed is None or not is_concrete(speed) else float(numbers(speed))
        t_end, rate, steady = simulation.t_end, simulation.sample_rate, simulation.start == "steady"
        tolerance, order = simulation.planned_tolerance, simulation.order
        spanning = SPANNING if simulation.tolerance is None else SPANNING_ASKED
        adams = is_adams(simulation.solver)
        return cls(t_end, rate, own, tolerance, order, steady, spanning, adams)


plans: Remembered[Plan] = Remembered(_KEPT)


def find_plan(machine: Machine, asked: Asked) -> Plan:
    """The one that was found before, or a new one."""
    if not all(is_concrete(x) for x in jax.tree.leaves(machine)):
        raise InputError(
            "the step cannot be chosen inside jit or vmap: call `plan = jr.plan(machine, t_end, "
            "sample_rate)` before, and pass `step=plan` to `simulate`"
        )
    return plans.get(machine, asked) or plans.put(machine, asked, _new_plan(machine, asked))


def _new_plan(machine: Machine, asked: Asked) -> Plan:
    t_end, speed, tolerance, order = asked.t_end, asked.speed, asked.tolerance, asked.order
    machine.check()
    given, machine = prescribed_until(machine, t_end), in_numbers(machine)
    interval = 1.0 / asked.sample_rate
    when, top = fastest(given, t_end, speed)
    harsh = begins_abruptly(given, top, speed, asked.steady)
    instants = _instants(machine, given, when, t_end)
    forward = _direction(given, when, t_end, speed)
    speeds = _speeds_at(machine, instants, forward * top)
    slowest = _slowest(machine, given, speed)
    linear = {w: highest_rungs(machine, w, slowest) for w in set(speeds)}
    every = np.concatenate([A for _, A in linear.values()])
    parts, excitation = parts_of(every, count_of_free(machine)), np.asarray(given.excitation)

    def known(w: float, h: float) -> tuple[Known, Known]:
        """Of steps of h (s), and of half of it, by one call."""
        at, A = linear[w]
        steps = np.repeat([h, 0.5 * h], RUNGS)
        both = known_chains(np.tile(A, (2, 1, 1)), steps, np.tile(at, 2), excitation, order, parts)
        coarse = jax.tree.map(lambda x: x[:RUNGS], both)
        fine = jax.tree.map(lambda x: x[RUNGS:], both)
        return Known(A, coarse), Known(A, fine)

    def seen(substeps: float, evaluations: int) -> float:
        h = interval / substeps
        each = {w: known(w, h) for w in linear}
        every = jax.tree.map(lambda *x: jax.device_put(np.stack(x)), *(each[w] for w in speeds))
        reach = np.array(speeds), np.float64(slowest), excitation
        given = instants, np.bool_(harsh), np.float64(h), reach
        when, abrupt, step, reach = jax.device_put(given)
        found = pilots(
            system_of(machine), when, abrupt, step, reach, order, evaluations, every, parts
        )
        return float(found)

    first = longest_turn(max(top, float(given.frequency)), interval)
    spans = asked.adams and may_span(None, machine)
    first = any_bucket(first) if spans else bucket(first)
    found = longest_step(seen, first, order, tolerance, asked.spanning)
    if found is None:
        blame = (
            not_finite(machine, jax.device_put(instants))
            if not math.isfinite(seen(first, 1))
            else None
        )
        if blame:
            raise InputError(f"{blame} before anything moves: mend its law")
        raise ConvergenceError(
            f"no step was found that keeps the error below {tolerance:g}: raise the sample rate, give "
            "shafts without damping some (rayleigh=..., their short waves ring for ever), or choose a solver "
            "for stiff nonlinearity such as jr.Rosenbrock()"
        )
    steps, evaluations, error = found
    jumps = np.unique(np.asarray(given.jumps))
    inside = int(np.sum((jumps > 0) & (jumps < t_end)))
    substeps, span = in_whole(that_pays(steps, t_end / interval, inside, order))
    block = _block(machine, given, t_end, interval * span / substeps)
    half = 0.5 * forward * top
    lasting = lasting_parts(machine, forward * top, slowest, every)
    return Plan(
        substeps,
        order,
        half,
        top,
        error,
        tolerance,
        evaluations,
        block,
        slowest,
        lasting,
        span,
        asked.spanning,
        float(excitation),
    )


def _slowest(machine: Machine, given: Prescribed, speed: Any) -> float:
    """rad/s: the lowest speed of a run, whatever its direction; 0 where nobody knows, and where it turns
    back."""
    speeds = np.asarray(given.speeds)
    steady = np.isfinite(speeds).all() and (speeds.min() > 0 or speeds.max() < 0)
    if not (machine.is_driven and steady):
        return 0.0
    own = np.inf if speed is None else abs(float(numbers(speed)))
    return float(min(np.abs(speeds).min(), own))


def _block(machine: Machine, given: Prescribed, t_end: float, h: float) -> int:
    """Steps of h (s) in which the speed changes by less than the spacing of what weights are fitted to. Where
    it is not given nobody knows."""
    speeds = np.asarray(given.speeds)
    top = np.abs(speeds).max()
    if not (machine.is_driven and np.isfinite(speeds).all() and top > 0):
        return LENGTH
    change = np.abs(np.diff(speeds)).max() / (t_end / (speeds.size - 1)) * h
    most = min(t_end / h / 32, top / 32 / change if change > 0 else LONGEST)
    return next((n for n in (LONGEST, 2 * LENGTH) if n <= most), LENGTH)


def begins_abruptly(given: Prescribed, top: float, speed: Any, steady: bool) -> bool:
    """Whether a line, of which `given` is known, turns when all begins to act on it: one that runs up is not
    shaken so. `top`, `speed`: the highest and the first, rad/s."""
    own = 0.0 if speed is None else abs(float(numbers(speed)))
    first = np.abs(np.asarray(given.speeds)[..., 0]).max()
    return not steady and max(own, float(first)) > _SLOW * top


def _direction(given: Prescribed, when: float, t_end: float, speed: Any) -> float:
    """1 or -1: which way the line turns when it is fastest."""
    own = 0.0 if speed is None else float(numbers(speed))
    there = float(np.asarray(given.speeds)[np.argmin(np.abs(looks(t_end) - when))])
    return -1.0 if (own if abs(own) > abs(there) else there) < 0 else 1.0


def plan_for(machine: Machine, simulation: Simulation, speed: Any) -> Plan:
    """What an exponential solver is to step by: the plan that was given, one for the step that was, or one
    that is chosen. `speed`: at the start, rad/s."""
    step, order, rate = simulation.step, simulation.order, simulation.sample_rate
    spans = may_span(simulation.solver, machine)
    if isinstance(step, Plan):
        return step if spans else step.by_samples()
    if step is None:
        return find_plan(machine, Asked.of(simulation, speed))
    try:
        valid = 0 < float(step) < float("inf")
    except (TypeError, ValueError):  # a tracer's refusal is a TypeError
        valid = False
    if not valid:
        raise InputError(f"step must be a Plan or a positive number in s, but is {step!r}")
    top, forward, slowest, excitation = 0.0, 1.0, 0.0, 0.0
    if all(is_concrete(x) for x in jax.tree.leaves((machine, speed))):
        given, t_end = prescribed_until(machine, simulation.t_end), simulation.t_end
        when, top = fastest(given, t_end, speed)
        forward, slowest = _direction(given, when, t_end, speed), _slowest(machine, given, speed)
        excitation = float(given.excitation)
    nan = float("nan")
    # no pilot has seen whether forces change fast with the state: two evaluations bear more of that
    substeps, span = in_whole((any_bucket if spans else bucket)(1.0 / rate / float(step)))
    return Plan(
        substeps,
        order,
        0.5 * forward * top,
        top,
        nan,
        nan,
        2,
        slowest=slowest,
        span=span,
        excitation=excitation,
    )


def unresolved(machine: Machine, plan: Plan, t_end: float, interval: float) -> bool:
    """Whether something swings by more than half a turn in a step: what the steps see tells nothing then."""
    given = prescribed_until(machine, t_end)
    return max(plan.top_speed, float(given.frequency)) * interval / plan.steps_a_sample > math.pi


def _instants(machine: Machine, given: Prescribed, when: float, t_end: float) -> np.ndarray:
    """Of the pilots: behind some of the jumps, where the ground shakes most, and `when`. (Two drives stand
    apart by what one has run ahead of the other: a pilot, which begins undeformed, has no sense there.)"""
    shaking = np.asarray(given.shaking)
    chosen = np.array([*([looks(t_end)[np.argmax(shaking)]] if shaking.any() else []), when])
    drives = sum(isinstance(station, AbstractPrescribed) for station in machine.stations)
    if drives + len(machine.motions) > 1:
        return chosen
    jumps = np.unique(np.asarray(given.jumps))
    jumps = jumps[(jumps > 0) & (jumps < t_end)]
    some = np.unique(np.linspace(0, jumps.size - 1, _PILOTS - 1).astype(int)) if jumps.size else []
    return np.append(np.nextafter(jumps[some], np.inf) if jumps.size else [], chosen)


def _speeds_at(machine: Machine, instants: np.ndarray, top: float) -> list[float]:
    """rad/s: the last pilot's is `top`, the others' the drive's own there."""
    # as many as `looks`: the same program
    times = np.resize(instants, looks(1.0).size)
    own = np.asarray(prescribed(machine, jax.device_put(times)).speeds)[: instants.size]
    speeds = np.where(own != 0, own, top)
    speeds[-1] = top
    return speeds.tolist()


def lasting_parts(
    machine: Machine, top: float, slowest: float, A: Float[np.ndarray, "s d d"]
) -> StateParts | None:
    """What neither `A` mixes, nor those at other values of what is zero; `top`, `slowest`: rad/s."""
    parts, other = parts_of(A, count_of_free(machine)), opened(machine)
    if not parts.single and other is not None:
        reach = jax.device_put((np.float64(top), np.float64(slowest)))
        mixed = np.asarray(rungs_of(nominal_of(other), *reach)[1])
        parts = parts_of(np.concatenate([A, mixed]), parts.exact_rows)
    return StateParts.of(machine, parts)
