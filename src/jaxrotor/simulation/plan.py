"""Choosing the step, outside jit, by a rule and a short pilot run."""

import math
from dataclasses import dataclass, field, replace
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
from ..core.parameter import is_concrete, numbers
from ..core.protocol import AbstractPrescribed
from ..core.result_text import shows
from ..integrators.exponential import ExponentialAdams
from ..machine.field import initial_states, jacobian, n_free, relative_field
from ..machine.machine import Machine
from ..machine.system import assemble, jump_times
from ..profiles.motion import AbstractMotion
from ..profiles.schedule import AbstractSchedule
from .blame import not_finite
from .run_error import share_of_peaks

# Steps in a sample interval come in these numbers, so that few programs are compiled.
BUCKETS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128)
# Above this the multistep method is not surely stable (0.33 was seen at order 5, 0.3 at order 6).
_LARGEST_TURN = 0.26  # rad of rotation in a step
_PILOT_SAMPLES = 64
_DEFAULT_TOLERANCE = 5e-5
# Instants at which pilots run, at most.
_PILOTS = 8


@shows(speed="rad/s", top_speed="rad/s")
@dataclass(frozen=True)
class Plan:
    """How a run is stepped; give it to `simulate(..., step=plan)`.

    - `substeps`: steps in a sample interval. - `order`: of the exponential Adams method.
    - `speed`: rad/s at which the machine is linearised. - `top_speed`: the highest speed expected.
    - `error`: what the pilot saw, as part of each coordinate's peak; `tolerance`: what was asked.

    Plans that step alike are equal, whatever their pilots saw: that differs with every value of every
    parameter, and would have programs that hold a plan compiled anew for it.
    """

    substeps: int
    order: int
    speed: float
    top_speed: float
    error: float = field(compare=False)
    tolerance: float


def bucket(substeps: float) -> int:
    """The next bucket that has at least so many steps."""
    for size in BUCKETS:
        if size >= substeps - 1e-9:
            return size
    return 64 * math.ceil(substeps / 64 - 1e-9)


@takes(
    t_end=positive("s"),
    sample_rate=positive("Hz"),
    speed=number("rad/s"),
    tolerance=number(above=0.0, below=1.0),
    order=whole(2, 7),
)
def plan(
    machine: Machine,
    t_end: float,
    sample_rate: float,
    speed: Any = None,
    tolerance: float = _DEFAULT_TOLERANCE,
    order: int = 6,
) -> Plan:
    """The number of steps in a sample interval that keeps the error below `tolerance`.

    A first guess turns the machine, and the fastest of what is given in time, by a quarter radian a step
    at the highest speed that its drive reaches (or at `speed`). Pilots then run 64 samples at that speed
    with this step and with half of it, under the loads as they are there and behind jumps, and the step is
    refined until their difference, as part of each coordinate's peak, is below `tolerance`. What no pilot
    sees, `simulate` finds in the finished run. Raises `InputError` for a traced machine: plan first, then
    `jit`.
    """
    if not all(is_concrete(x) for x in jax.tree.leaves(machine)):
        raise InputError(
            "the step cannot be chosen inside jit or vmap: call `plan = jr.plan(machine, t_end, "
            "sample_rate)` before, and pass `step=plan` to `simulate`"
        )
    machine.check()
    machine = _numbers(machine)
    interval = 1.0 / sample_rate
    when, top = top_speed(machine, t_end, speed)
    substeps = fewest(max(top, float(top_frequency(machine))), interval)
    instants = jnp.asarray(_instants(machine, when, t_end))
    error = math.inf
    for _ in range(6):
        at = [instants, *(jnp.asarray(x) for x in (interval, substeps, top))]
        error = float(_pilot(machine, at[0], at[1], at[2], at[3], order))
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


def fewest(frequency: float, interval: float) -> int:
    """Steps in a sample interval that follow what turns or swings at `frequency` (rad/s)."""
    return bucket(frequency * interval / _LARGEST_TURN)


def unresolved(machine: Machine, plan: Plan, interval: float) -> bool:
    """Whether something swings by more than half a turn in a step: what the steps see tells nothing then."""
    fastest = max(plan.top_speed, float(top_frequency(_numbers(machine))))
    return fastest * interval / plan.substeps > math.pi


def refined(plan: Plan, error: float) -> Plan:
    """For a run by `plan` whose own error was above its tolerance."""
    growth = min(8.0, 1.1 * (error / plan.tolerance) ** (1 / (plan.order + 1)))
    return replace(plan, substeps=bucket(max(plan.substeps + 1, plan.substeps * growth)))


@eqx.filter_jit
def top_frequency(machine: Machine) -> Float[Array, ""]:
    """The highest one of all that is given in time, rad/s."""
    kinds = (AbstractSchedule, AbstractMotion)
    given = jax.tree.leaves(machine, is_leaf=lambda x: isinstance(x, kinds))
    found = [one.top_frequency() for one in given if isinstance(one, kinds)]
    return jnp.max(jnp.stack([jnp.zeros(()), *found]))


def _instants(machine: Machine, when: float, t_end: float) -> np.ndarray:
    """Of the pilots: `when`, and behind some of the jumps. (Two drives stand apart by what one has run ahead
    of the other: a pilot, which begins undeformed, has no sense there.)"""
    drives = sum(isinstance(station, AbstractPrescribed) for station in machine.stations)
    if drives + len(machine.motions) > 1:
        return np.array([when])
    jumps = np.unique(np.asarray(_jumps(machine)))
    jumps = jumps[(jumps > 0) & (jumps < t_end)]
    some = np.unique(np.linspace(0, jumps.size - 1, _PILOTS - 1).astype(int)) if jumps.size else []
    return np.append(np.nextafter(jumps[some], np.inf) if jumps.size else [], when)


@eqx.filter_jit
def _jumps(machine: Machine) -> Float[Array, " n"]:
    return jump_times(assemble(machine))


def _numbers(machine: Machine) -> Machine:
    """Free of what `grad` wraps around them: the choice of a step has no derivative."""
    return jax.tree.map(lambda x: jnp.asarray(numbers(x)), machine)


def top_speed(machine: Machine, t_end: float, speed: Any = None) -> tuple[float, float]:
    """When the drive turns fastest (s), and how fast (rad/s), or `speed` if that is higher."""
    times = np.linspace(0.0, t_end, 512)
    speeds = np.abs(np.asarray(_speeds(_numbers(machine), jnp.asarray(times))))
    i = int(np.argmax(speeds))
    own = 0.0 if speed is None else abs(float(numbers(speed)))
    return float(times[i]), max(float(speeds[i]), own)


@eqx.filter_jit
def _speeds(machine: Machine, times: Float[Array, " n"]) -> Float[Array, " n"]:
    return jax.vmap(lambda t: assemble(machine).reference(t)[1])(times)


@eqx.filter_jit
def _pilot(machine, instants, interval, substeps, top, order: int) -> Float[Array, ""]:
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
