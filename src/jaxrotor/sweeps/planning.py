"""The steps of each machine of a sweep: one plan for all, and finer ones for those that need them."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..core.block_matrix import Places
from ..core.errors import ConvergenceError, InputError
from ..core.quick import lightly_compiled
from ..integrators.exponential import ExponentialAdams
from ..integrators.fitted_weights import Parts
from ..machine.field import n_free
from ..machine.layout import count_of_free
from ..machine.machine import Machine
from ..machine.system import assemble_both
from ..objectives.peak import PeakValue
from ..sensors.sensor import Tachometer
from ..simulation.assembling import system_of
from ..simulation.checks import initial_speed
from ..simulation.pilot import pilot
from ..simulation.planned import BUCKETS, Plan, fewest
from ..simulation.prepared import reach_of, rungs_of
from ..simulation.prescribed import Prescribed, looks, prescribed
from ..simulation.simulation import Simulation
from ..simulation.state_parts import parts_of
from ..simulation.step_choice import Asked, begins_abruptly, find_plan, plan_for
from .batch import Setup, placed, run_batch, with_steps
from .cases import Cases
from .memory import rows_at_once

# Of a machine for which no step is found: it is not run.
NO_STEP = -1
# Machines that may have no step before the sweep as a whole is refused.
_TRIES = 8
# A guess of more steps in a sample interval is none: numbers would leave the finite ones first.
_MOST_STEPS = 4096
# Of a line that no drive holds: machines tried for the speed that they reach, and how often.
_SCOUTS, _ROUNDS = 64, 4


class Steps(NamedTuple):
    """`substeps`: (n,) of each machine, `NO_STEP` where none is found, 0 where the solver chooses. `speed`:
    rad/s, at which all are linearised. `reason`: why some have none. `evaluations`: of the field in a
    step."""

    substeps: np.ndarray
    speed: float
    reason: str = ""
    evaluations: int = 1


def steps_of(setup: Setup, cases: Cases, simulation: Simulation) -> Steps:
    """For an exponential solver. Raises `InputError` where no machine has a step."""
    first = row_of(setup.machine, cases.values, 0)
    own = float(initial_speed(first, simulation.initial, simulation.speed))
    ones, step, rate = np.ones(len(cases), int), simulation.step, simulation.sample_rate
    if isinstance(step, Plan):
        return Steps(ones * step.substeps, step.speed, evaluations=step.evaluations)
    given = prescribed_of(setup.machine, cases.values, looks(simulation.t_end))
    when, top = _top_speeds(given, simulation.t_end, own)
    good = np.isfinite(top) & (top / rate < 0.25 * _MOST_STEPS)
    if not good.any():
        good[:] = True  # let the plan itself say what is wrong
    if step is not None:
        row = int(np.argmax(np.where(good, top, -1.0)))
        fastest = row_of(setup.machine, cases.values, row)
        planned = plan_for(fastest, simulation, own)
        return Steps(ones * planned.substeps, planned.speed, evaluations=planned.evaluations)
    if not setup.machine.is_driven:
        top = _reached(setup, cases, simulation, top, good)
    planned, good = _planned(setup, cases, simulation, top, good)
    swing = np.asarray(given.frequency)[good]
    least = fewest(float(np.max(swing, initial=0.0, where=np.isfinite(swing))), 1.0 / rate)
    planned = dataclasses.replace(planned, substeps=max(planned.substeps, least))
    steady = simulation.start == "steady"
    abrupt = begins_abruptly(given, planned.top_speed, own, steady)
    substeps, reason = _substeps(
        setup.machine, cases.values, planned, when, abrupt, 1.0 / rate, good
    )
    return Steps(substeps, planned.speed, reason, planned.evaluations)


def parts_of_all(setup: Setup, cases: Cases, large: int) -> Places | None:
    """Parts of the state that no machine of the table mixes, by the first, one in the middle and the last;
    `large`: states from which on they pay."""
    rows = count_of_free(setup.machine)
    if not isinstance(setup.run.solver, ExponentialAdams) or 2 * rows <= large:
        return None
    n, reach = len(cases), reach_of(setup.run)
    systems = [
        system_of(row_of(setup.machine, cases.values, row), nominal=True)
        for row in sorted({0, n // 2, n - 1})
    ]
    A = np.concatenate([np.asarray(rungs_of(system, *reach)[1]) for system in systems])
    parts = parts_of(A, rows, large)
    return None if parts.single else parts.rows


def row_of(machine: Machine, values: dict[str, np.ndarray], row: int) -> Machine:
    return placed(machine, {path: jnp.asarray(x[row]) for path, x in values.items()})


def _rows(values: dict[str, np.ndarray], rows: np.ndarray, size: int) -> dict[str, jax.Array]:
    """A batch of those rows, filled up by the last one."""
    filled = rows[np.minimum(np.arange(size), rows.size - 1)]
    return {path: jnp.asarray(x[filled]) for path, x in values.items()}


def prescribed_of(machine: Machine, values: dict, times: np.ndarray) -> Prescribed:
    """What each of the machines is given in time, (n, ...)."""
    batch = {path: jnp.asarray(x) for path, x in values.items()}
    return _prescribed_of(machine, batch, jnp.asarray(times))


@lightly_compiled
def _prescribed_of(machine: Machine, values: dict, times: jax.Array) -> Prescribed:
    return jax.lax.map(lambda own: prescribed(placed(machine, own), times), values)


def _top_speeds(given: Prescribed, t_end: float, own: float):
    """When each machine's drive turns fastest (s), and how fast (rad/s), or `own` if that is higher."""
    times, speeds = looks(t_end), np.abs(np.asarray(given.speeds))
    speeds = np.where(np.isnan(speeds), np.inf, speeds)
    return times[np.argmax(speeds, axis=1)], np.maximum(speeds.max(axis=1), abs(own))


def _planned(setup: Setup, cases: Cases, simulation: Simulation, top, good):
    """A plan for the fastest machine that has one; and which may have one."""
    good, error = good.copy(), None
    for row in np.argsort(-np.where(good, top, -1.0), kind="stable")[:_TRIES]:
        if not good[row]:
            break
        machine = row_of(setup.machine, cases.values, row)
        try:
            asked = Asked.of(simulation, float(top[row]))
            return find_plan(machine, asked).by_samples(), good
        except (InputError, ConvergenceError) as found:
            error, good[row] = error or found, False
    raise error if error else ConvergenceError("cases: none of them has a finite speed")


def _reached(setup: Setup, cases: Cases, simulation: Simulation, top, good) -> np.ndarray:
    """Speeds that lines without a drive reach: found by running some of them, as `simulate` does with one."""
    few = np.unique(np.linspace(0, len(cases) - 1, min(_SCOUTS, len(cases))).astype(int))
    ends = {int(f(x)) for x in cases.values.values() for f in (np.argmin, np.argmax)}
    few = np.array(sorted({*few.tolist(), *ends} & set(np.flatnonzero(good).tolist())))
    stations = setup.machine.wiring.stations
    seen = {s: PeakValue(Tachometer(s)) for s in stations}
    # those in between may be a little faster
    margin = 1.0 if few.size == len(cases) else 1.1
    size = min(few.size, rows_at_once(setup.machine))
    top = top.copy()
    for turn in range(_ROUNDS):
        planned, _ = _planned(setup, cases, simulation, top, good)
        run = dataclasses.replace(setup.run, linearised_at=jnp.asarray(planned.speed))
        scout = dataclasses.replace(setup, outputs=seen, run=run)
        scout = with_steps(scout, planned.substeps, planned.evaluations)
        found = []
        for first in range(0, few.size, size):
            rows = few[first : first + size]
            values = run_batch(scout, _rows(cases.values, rows, size)).values
            found.append(np.max([np.asarray(values[s])[: rows.size] for s in stations], axis=0))
        speeds = np.concatenate(found)
        most = 10 * planned.top_speed + 1000.0
        # one that went astray may only have had too long a step: once it counts with the most
        speeds = np.where(np.isfinite(speeds), speeds, most if turn == 0 else 0.0)
        top[few] = np.maximum(np.minimum(speeds, most), 0.0)
        if top[few].max() <= 1.1 * planned.top_speed + 1.0:
            break
    rest = np.setdiff1d(np.arange(len(cases)), few)
    top[rest] = np.maximum(top[rest], margin * top[few].max())
    return top


@lightly_compiled
def _pilots(given: Machine, values: dict, when: jax.Array, at: Any, plan: Plan):
    def one(own, when):
        abrupt, h, top = at
        machine = placed(given, own)
        system, balanced = assemble_both(machine)
        own = None if plan.parts is None else Parts(plan.parts.rows, n_free(system))
        return pilot(
            system,
            balanced,
            when,
            abrupt,
            h,
            top,
            plan.order,
            plan.evaluations,
            parts=own,
            excitation=plan.excitation,
        )

    return jax.vmap(one)(values, when)


def _substeps(machine: Machine, values, plan: Plan, when, abrupt: bool, interval, good):
    """Steps in a sample interval that each machine needs for the plan's tolerance: the plan's own, or
    more; and why some have none. Each is tried in a pilot at the plan's top speed with the plan's step,
    then those that miss the tolerance with the next finer one."""
    found = np.full(good.size, NO_STEP)
    left = np.flatnonzero(good)
    batch = min(good.size, rows_at_once(machine))
    for size in [size for size in BUCKETS if size >= plan.substeps] or [plan.substeps]:
        at = [jnp.asarray(x) for x in (abrupt, interval / size, 2 * plan.speed)]
        errors = []
        for first in range(0, left.size, batch):
            rows = left[np.minimum(np.arange(first, first + batch), left.size - 1)]
            own = _rows(values, rows, batch)
            got = np.asarray(_pilots(machine, own, jnp.asarray(when[rows]), at, plan))
            errors.append(got[: left.size - first])
        fine = np.concatenate(errors) <= plan.tolerance
        found[left[fine]] = size
        left = left[~fine]
        if not left.size:
            break
    reason = (
        f"no step was found that keeps the error below {plan.tolerance:g}: raise the sample rate, give a "
        "step, or choose a solver for stiff nonlinearity such as jr.Rosenbrock()"
    )
    if (found == NO_STEP).all():
        raise InputError(f"cases: {reason}")
    return found, reason if (found == NO_STEP).any() else ""
