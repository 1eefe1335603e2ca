"""Runs a machine through time."""

import time
from typing import Any, Literal

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..errors import InputError, SimulationFailed
from ..machine.field import initial_states, jacobian, n_free, vector_field
from ..machine.machine import Machine
from ..machine.system import System, assemble, jump_times
from ..parameter import is_concrete, require_x64
from .equilibrium import refuse_unbalanced, resting, unbalanced_loads
from .exponential import ETD4RK, ExponentialAdams
from .knots import knots
from .march import march
from .plan import Plan, bucket, plan as make_plan
from .progress import meter
from .response import Response, RunInfo
from .state import State, to_flat
from .steady import steady_whirl

Initial = Literal["static", "steady", "undeformed"]

# A periodic whirl found by shooting must come back to this part of its size.
_STEADY_GAP = 1e-7


def simulate(
    machine: Machine,
    t_end: float,
    sample_rate: float,
    initial: Initial | State = "static",
    speed: Float[Array, ""] | float | None = None,
    solver: diffrax.AbstractSolver | None = None,
    step: Plan | float | None = None,
    rtol: float = 1e-7,
    atol: float = 1e-10,
    adjoint: diffrax.AbstractAdjoint | None = None,
    progress: bool | None = None,
) -> Response:
    """Runs `machine` from t = 0 to `t_end` (s) and samples it at `sample_rate` (Hz).

    **Arguments:**

    - `initial`: `"static"`, resting under its weight, with the line's speed added; `"steady"`, the
      periodic whirl at `speed`; `"undeformed"`; or a `State`.
    - `speed`: rad/s, of the whole line at the start. A driven line starts with its drive; there it
      may be left out. A `State` brings its own.
    - `solver`: by default `ExponentialAdams`; any solver of diffrax may be given. `ETD4RK` and
      `ExponentialAdams` step onto the samples; others adapt their step to `rtol` and `atol`.
    - `step`: for the exponential solvers, a `Plan` or a largest step in s. By default `jr.plan`
      chooses; inside `jit` or `vmap` it must be given.
    - `adjoint`: of diffrax, for the other solvers. The exponential ones need none: forward and
      reverse mode both work.
    - `progress`: a progress bar; by default for runs expected to take over two seconds.

    Raises `InputError` for wrong input, before anything runs, and `SimulationFailed`, with the
    samples up to there, where the numbers leave the finite ones. In a batch (under `vmap`) a member
    that fails is NaN from there on, the others unharmed.
    """
    require_x64()
    machine.check()
    count = _samples(t_end, sample_rate)
    speed = _initial_speed(machine, initial, speed)
    exponential = solver is None or isinstance(solver, (ExponentialAdams, ETD4RK))
    if exponential:
        chosen = _plan(machine, t_end, sample_rate, speed, solver, step)
        solver = _with_substeps(solver, chosen)
        known = dict(
            order=chosen.order if isinstance(solver, ExponentialAdams) else 4,
            substeps=chosen.substeps,
            step=1.0 / sample_rate / chosen.substeps,
            linearised_at=chosen.speed,
            planned_top_speed=chosen.top_speed,
            pilot_error=chosen.error,
            tolerance=chosen.tolerance,
        )
        numbers = jnp.asarray([chosen.speed])
    else:
        if step is not None and isinstance(step, Plan):
            raise InputError("a Plan is for the exponential solvers: give a step in s, or none")
        known = dict(order=None, substeps=None, step=step)
        numbers = jnp.asarray([rtol, atol, 0.0 if step is None else step])
    interval = jnp.asarray(1.0 / sample_rate, float)
    concrete = all(is_concrete(x) for x in jax.tree.leaves((machine, speed, initial)))
    watch = meter(count, exponential, known["substeps"], progress) if concrete else None
    began = time.perf_counter()
    try:
        y, steps, checks = _run(
            machine, initial, speed, solver, interval, numbers, count, step is not None, adjoint, watch
        )
        if concrete:
            y.block_until_ready()
    finally:
        if watch is not None:
            watch.close()
    info = RunInfo(
        solver=type(solver).__name__,
        initial=initial if isinstance(initial, str) else "given state",
        order=known["order"],
        substeps=known["substeps"],
        **{k: None if v is None else jnp.asarray(v, float) for k, v in known.items()
           if k not in ("order", "substeps")},
        steps=steps,
        seconds=jnp.asarray(time.perf_counter() - began),
        steady_gap=checks if initial == "steady" else None,
    )
    response = Response(machine, jnp.arange(count) * interval, y, info)
    if concrete and is_concrete(y):
        _judge(response, initial, checks)
    return response


def _samples(t_end: Any, sample_rate: Any) -> int:
    for name, value, unit in (("t_end", t_end, "s"), ("sample_rate", sample_rate, "Hz")):
        if not is_concrete(value):
            raise InputError(f"{name} sets the number of samples, so it must be a plain number")
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise InputError(f"{name} must be a number in {unit}, but is {value!r}") from None
        if not (0 < number < float("inf")):
            raise InputError(f"{name} must be positive and finite, but is {number:g} {unit}")
    count = int(float(t_end) * float(sample_rate) + 1e-9) + 1
    if count < 3:
        raise InputError(
            f"t_end = {t_end:g} s at sample_rate = {sample_rate:g} Hz gives {count} samples: "
            "raise one of them"
        )
    return count


def _initial_speed(machine: Machine, initial: Any, speed: Any) -> Float[Array, ""]:
    if not isinstance(initial, State) and initial not in ("static", "steady", "undeformed"):
        raise InputError(
            'initial must be "static", "steady", "undeformed" or a State, but is ' + repr(initial)
        )
    if isinstance(initial, State):
        if speed is not None:
            raise InputError("a State brings its own speeds: leave `speed` out")
        shape = (len(machine.stations), 6)
        for name in ("position", "velocity"):
            if jnp.shape(getattr(initial, name)) != shape:
                raise InputError(
                    f"initial.{name} must have shape {shape} (stations, coordinates), but has "
                    f"{jnp.shape(getattr(initial, name))}"
                )
        return jnp.zeros(())
    if speed is not None:
        try:
            speed = jnp.asarray(speed, float)
        except (TypeError, ValueError):
            raise InputError(f"speed must be a number in rad/s, but is {speed!r}") from None
        if speed.shape != () or (is_concrete(speed) and not bool(jnp.isfinite(speed))):
            raise InputError(f"speed must be one finite number in rad/s, but is {speed}")
    driven, w0 = _drive_speed(machine)
    if driven and speed is not None and is_concrete(speed - w0):
        if abs(float(speed) - float(w0)) > 1e-9 * max(1.0, abs(float(w0))):
            raise InputError(
                f"speed is {float(speed):g} rad/s, but the drive starts at {float(w0):g} rad/s: "
                "leave speed out, or change the drive's profile"
            )
    if driven:
        speed = w0
    speed = jnp.zeros(()) if speed is None else speed
    if isinstance(initial, str) and initial == "steady" and is_concrete(speed) and float(speed) == 0:
        raise InputError('initial="steady" needs a speed other than 0 rad/s: give `speed`')
    return speed


def _drive_speed(machine: Machine) -> tuple[bool, Array]:
    system = assemble(machine)
    driven = bool(system.ground) or any(
        c == 5 and motion >= 0
        for group in system.layout.stations
        for row in group.motions
        for c, motion in zip(group.held, row)
    )
    return driven, system.reference(jnp.zeros(()))[1] if driven else jnp.zeros(())


def _plan(machine, t_end, sample_rate, speed, solver, step) -> Plan:
    if isinstance(step, Plan):
        return step
    order = solver.order_ if isinstance(solver, ExponentialAdams) else 6
    if step is None:
        known = speed if is_concrete(speed) else None
        return make_plan(machine, t_end, sample_rate, known, order=order)
    if not is_concrete(step) or not float(step) > 0:
        raise InputError(f"step must be a Plan or a positive number in s, but is {step!r}")
    nan = float("nan")
    return Plan(bucket(1.0 / sample_rate / float(step)), order, 0.0, nan, nan, nan)


def _with_substeps(solver, chosen: Plan):
    if solver is None:
        return ExponentialAdams(chosen.order, chosen.substeps)
    if isinstance(solver, ETD4RK):
        return ETD4RK(chosen.substeps, solver.linear_part)
    return ExponentialAdams(chosen.order, chosen.substeps, solver.linear_part)


@eqx.filter_jit
def _run(machine, initial, speed, solver, interval, numbers, count, fixed, adjoint, watch):
    system = assemble(machine)
    samples = jnp.arange(count) * interval
    y0, checks = _start(machine, system, initial, speed)
    jumps = jump_times(machine)
    terms = diffrax.ODETerm(vector_field)
    if isinstance(solver, (ExponentialAdams, ETD4RK)):
        y, steps = _march(machine, system, solver, terms, samples, jumps, y0, numbers[0], watch)
    else:
        if fixed:
            controller: Any = diffrax.ConstantStepSize()
        else:
            controller = diffrax.PIDController(rtol=numbers[0], atol=numbers[1])
        if jumps.size:
            inside = (jumps > samples[0]) & (jumps < samples[-1])
            controller = diffrax.ClipStepSizeController(
                controller, jump_ts=jnp.sort(jnp.where(inside, jumps, samples[-1] + 1.0))
            )
        options = {} if adjoint is None else dict(adjoint=adjoint)
        solution = diffrax.diffeqsolve(
            terms,
            solver,
            samples[0],
            samples[-1],
            numbers[2] if fixed else None,
            y0,
            system,
            saveat=diffrax.SaveAt(ts=samples),
            stepsize_controller=controller,
            max_steps=2**22,
            throw=False,
            **options,
        )
        y = jnp.where(jnp.isfinite(solution.ys), solution.ys, jnp.nan)  # pyright: ignore
        steps = solution.stats["num_steps"]
    return y, steps, checks


def _start(machine: Machine, system: System, initial, speed) -> tuple[Array, Array]:
    """The flat state at t = 0, and what to judge it by."""
    zero = jnp.zeros(())
    reference = system.reference(zero)
    n = n_free(system)
    if isinstance(initial, State):
        return to_flat(initial, system, reference), zero
    if initial == "steady":
        state, _, missed = steady_whirl(machine, system, speed)
        return to_flat(state, system, reference), missed
    checks = jnp.zeros((len(machine.stations), 6))
    if initial == "static":
        still = (reference[0], zero, zero)
        y = resting(system, still)
        checks = unbalanced_loads(system, y, still)
    else:
        y = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])
    free = jnp.array(system.layout.free, int)
    spins = (free // system.layout.n_mass == 5) * (speed - reference[1])
    return y.at[n : 2 * n].add(spins), checks


def _march(machine, system, solver, terms, samples, jumps, y0, at_speed, watch):
    """The exponential solvers, with everything they need prepared."""
    A = solver.linear_part
    if A is None:
        A = jacobian(assemble(machine, nominal=True), at_speed)
    at = knots(samples, jumps)
    solver = eqx.tree_at(
        lambda s: (s.linear_part, s.lengths), solver, (A, at.lengths), is_leaf=lambda x: x is None
    )
    state = solver.init(terms, samples[0], samples[1], y0, system)
    y = march(solver, terms, at.times, at.jumps, y0, system, state, watch)
    return y[at.samples], jnp.asarray((samples.shape[0] - 1) * solver.substeps)


def _judge(response: Response, initial, checks) -> None:
    """After a concrete run: is it one?"""
    if isinstance(initial, str) and initial == "static":
        refuse_unbalanced(response.machine, checks)
    if isinstance(initial, str) and initial == "steady" and not float(checks) < _STEADY_GAP:
        raise InputError(
            f"no periodic whirl was found: after a turn the state differs by {float(checks):.1e} of "
            "its size; the torques on the line do not balance at this speed, or it is unstable there"
        )
    sample = response.failed_at()
    if sample is not None:
        kept = response.until(sample)
        raise SimulationFailed(
            f"the run left the finite numbers between t = {float(response.t[max(0, sample - 1)]):.6g} s "
            f"and {float(response.t[sample]):.6g} s ({response.info.solver}, "
            f"{response.info.substeps or 'adaptive'} steps a sample): take a smaller step "
            "(step=...), or look for an instability of the machine there; "
            f"the {sample} samples before are in the exception's `response`",
            kept,
        )
