"""One machine many times over: tolerance studies, maps, Monte Carlo, training data."""

import contextlib
import dataclasses
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Unpack

import jax.numpy as jnp
import numpy as np
import xarray as xr
from tqdm import tqdm

from ..core.arguments import mapping, path, whole
from ..core.errors import InputError, StoreError
from ..core.gate import takes
from ..core.parameter import require_x64
from ..machine.machine import Machine
from ..simulation.checks import check_machine, sample_count
from ..simulation.planned import Plan
from ..simulation.run_setup import set_up as run_setup
from ..simulation.simulation import Settings, Simulation, as_simulation
from ..simulation.solver import is_planned
from .batch import Setup, linear_part, shares_linear, with_steps
from .cases import Cases, as_cases
from .checks import check_cases, check_start
from .engine import Engine, engine_for
from .identity import fingerprint
from .layout import check_names, chunks_of, filled, finished, kept, layout_of
from .memory import check_chunk, chunk_size
from .outputs import checked, needs_run, with_units
from .planning import NO_STEP, Steps, parts_of_all, row_of, steps_of
from .store import Kept, Store

# States from which on parts of them have weights of their own: where each machine has its own weights, and
# where all have them in common, so that products with them are of matrices.
_LARGE, _LARGE_IN_COMMON = 24, 128


@takes(parameters=None, outputs=mapping, store=path, chunk=whole(1))
def sweep(
    machine: Machine,
    parameters: Cases | Mapping[str, Any],
    outputs: Mapping[str, Any],
    simulation: Simulation | None = None,
    *,
    store: str | Path | None = None,
    resume: bool = True,
    chunk: int | None = None,
    client: Any = None,
    progress: bool | None = None,
    **settings: Unpack[Settings],
) -> xr.Dataset:
    """Runs `machine` once for each row of `parameters` and keeps `outputs` of each run.

    **Arguments:**

    - `parameters`: `Cases` (a grid, a sample, a table), or a mapping path -> (n,) values, SI.
    - `outputs`: name -> a measure of runs (`PeakValue(...)`) or of machines (`TotalMass()`), a `TimeSeries`,
      an `OverSpeed`, or a bare sensor. Runs are reduced while they are computed: only what sensors see is
      kept.
    - `simulation`: how each is run, a `Simulation`, or its fields as keywords (`t_end=2.0, speed=100.0`); by
      default 1 s at 1000 Hz. The step is planned for each machine: those that need a finer one are run
      together.
    - `store`: a Zarr folder, written chunk by chunk; a sweep that was stopped goes on there (`resume`), with
      the chunks and steps that it had, and one of something else is refused. Left out, results are kept in
      memory.
    - `chunk`: machines in a batch; by default from the memory there is.
    - `client`: of Dask distributed, which then runs the chunks.
    - `progress`: a progress bar; by default where a person looks on.

    All local devices share each batch; under `jax.distributed` every process runs its share of the chunks,
    and all of them write to one store.

    **Returns** an `xarray.Dataset` over `case` (a grid: over its axes), with the parameters, the outputs, and
    `failure`: where a run failed, when and why; its numbers are NaN (a series: from there on), the others
    unharmed. `steps_a_sample` is -1 of a machine for which no step was found and 0 where the solver chooses.
    Raises `InputError` for wrong input before anything runs, and `StoreError` for a store that cannot be read
    or written, and where another process left chunks of it undone.
    """
    require_x64()
    check_chunk(chunk)
    engine = engine_for(client)
    if store is None and not engine.alone:
        raise InputError(
            "store: several processes run this sweep: give a folder that all of them see"
        )
    simulation = simulation_of(simulation, settings)
    setup, cases = _asked(machine, parameters, outputs, simulation)

    def planned() -> Steps:
        return _planned(setup, cases, simulation)

    began = time.perf_counter()
    if store is None:
        steps = planned()
        setup = _stepped(setup, cases, steps)
        size = chunk_size(setup, chunk, len(cases), engine.width)
        keep = Kept(*layout_of(setup, cases, steps, size))
    else:
        keep = Store(Path(store))
        told = fingerprint(setup, cases, simulation)
        _open_or_make(keep, resume, engine, told, setup, cases, planned, chunk)
        steps, size = keep.steps()
        setup = _stepped(setup, cases, steps)
    _run_all(keep, engine, setup, cases, steps.substeps, size, progress)
    if keep.missing().size:
        raise StoreError(
            f"`{store}`: another process left {keep.missing().size} chunks undone: see what it says, "
            "then resume"
        )
    return finished(keep.dataset(), cases, setup, time.perf_counter() - began)


def simulation_of(given: Simulation | None, settings: Settings) -> Simulation:
    """What was given, whole or by keywords; of what is left out 1 s at 1000 Hz."""
    defaults: Any = {} if given is not None else {"t_end": 1.0, "sample_rate": 1000.0}
    return as_simulation(given, defaults | settings)


def _asked(machine, parameters, outputs, simulation: Simulation) -> tuple[Setup, Cases]:
    """Checked, but not planned: no linear part, no number of steps."""
    setup, cases = asked(machine, parameters, outputs, simulation)
    if any(needs_run(one) for one in setup.outputs.values()):
        check_start(row_of(machine, cases.values, 0), simulation)
    return setup, cases


def asked(
    machine: Machine, parameters: Any, outputs: Mapping[str, Any], simulation: Simulation
) -> tuple[Setup, Cases]:
    """The arguments of `sweep`, judged as far as they can be before anything runs; raises `InputError`."""
    check_machine(machine)
    cases = as_cases(parameters)
    wanted = with_units(checked(outputs), machine)
    check_names(wanted, cases)
    check_cases(machine, cases)
    if any(needs_run(one) for one in wanted.values()):
        simulation.check(row_of(machine, cases.values, 0))
    step, speed = simulation.step, simulation.speed
    plan = step if isinstance(step, Plan) else None
    speed = None if speed is None else jnp.asarray(speed, float)
    count = sample_count(simulation.t_end, simulation.sample_rate)
    run = run_setup(machine, simulation, speed, plan, count)
    return Setup(machine, wanted, run, None), cases


def set_up(machine, cases, outputs, simulation: Simulation) -> tuple[Setup, np.ndarray]:
    """Ready to run, and the steps in a sample interval of each machine."""
    setup, cases = _asked(machine, cases, outputs, simulation)
    steps = _planned(setup, cases, simulation)
    return _stepped(setup, cases, steps), steps.substeps


def _planned(setup: Setup, cases: Cases, simulation: Simulation) -> Steps:
    runs = any(needs_run(one) for one in setup.outputs.values())
    if not runs or not is_planned(setup.run.solver):
        return Steps(np.zeros(len(cases), int), 0.0)
    return steps_of(setup, cases, simulation)


def _stepped(setup: Setup, cases: Cases, steps: Steps) -> Setup:
    """With the linear part, if all share one."""
    run = dataclasses.replace(setup.run, linearised_at=jnp.asarray(steps.speed, float))
    setup = dataclasses.replace(setup, run=run)
    setup, solver = with_steps(setup, 1, steps.evaluations), run.solver
    if not steps.substeps.any() or not is_planned(solver):
        return setup
    own = getattr(solver, "linear_part", None)
    if own is not None:
        return dataclasses.replace(setup, linear=jnp.asarray(own))
    linear, large = None, _LARGE
    if shares_linear(setup.machine, steps.speed, cases.values):
        first = row_of(setup.machine, cases.values, 0)
        linear, large = linear_part(first, setup.run), _LARGE_IN_COMMON
    run = dataclasses.replace(setup.run, parts=parts_of_all(setup, cases, large))
    return dataclasses.replace(setup, run=run, linear=linear)


def _open_or_make(keep: Store, resume, engine: Engine, told, setup, cases, planned, chunk) -> None:
    """The first process makes the store, the others wait for it."""
    try:
        if engine.leads and not keep.exists():
            steps = planned()
            ready = _stepped(setup, cases, steps)
            size = chunk_size(ready, chunk, len(cases), engine.width)
            keep.create(*layout_of(ready, cases, steps, size), told)
        elif engine.leads:
            if not resume:
                raise InputError(
                    f"`{keep.path}`: is there already: choose another folder, or resume"
                )
            damaged = keep.open(told)
            if damaged:
                words = f"{damaged} chunks were damaged since they were written: they are run again"
                print(f"`{keep.path}`: {words}", file=sys.stderr)
    finally:
        engine.meet("store")
    if not engine.leads:
        keep.open(told)


def _run_all(keep: Store | Kept, engine: Engine, setup, cases, substeps, size, progress) -> None:
    chunks = chunks_of(substeps, size)
    tasks = []
    for n in keep.missing():
        if engine.mine(n):
            rows = filled(chunks[n], size)
            values = {path: x[rows] for path, x in cases.values.items()}
            tasks.append((int(n), values, int(substeps[rows[0]])))
    bar = tqdm(
        total=sum(len(chunks[n]) for n, _, _ in tasks),
        unit="run",
        desc=f"sweep, {len(tasks)} of {len(chunks)} chunks",
        file=sys.stderr,
        leave=False,
        disable=None if progress is None else not progress,
    )

    def done(n: int, values: dict[str, np.ndarray]) -> None:
        keep.write(n, slice(n * size, (n + 1) * size), values)
        bar.update(len(chunks[n]))

    try:
        with bar:
            for n, _, steps in tasks:
                if steps == NO_STEP:
                    done(n, {})
            able = [task for task in tasks if task[2] != NO_STEP]
            with contextlib.closing(engine.run(setup, able)) as outcomes:
                for n, outcome in outcomes:
                    done(n, kept(outcome, setup))
    except Exception:
        engine.meet("done")  # the others must not wait for ever
        raise
    engine.meet("done")
