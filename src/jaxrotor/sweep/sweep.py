"""One machine many times over: tolerance studies, maps, Monte Carlo, training data."""

import hashlib
import platform
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from tqdm import tqdm

from ..errors import InputError
from ..inverse.bench import Bench
from ..machine.machine import Machine
from ..parameter import require_x64
from ..solve.adaptive import is_smooth
from ..solve.checks import check_solver, initial_speed, sample_count
from ..solve.grid import grid_of
from ..solve.plan import Plan, top_speed
from ..solve.simulate import chosen_plan, with_substeps
from .batch import Outcome, Setup, linear_part, member, placed, shares_linear
from .cases import Cases
from .engine import engine_for
from .memory import chunk_size
from .outputs import checked, coordinates, needs_run, unit_of
from .planning import substeps_of
from .store import Kept, Store


def sweep(
    machine: Machine,
    parameters: Cases | Mapping[str, Any],
    outputs: Mapping[str, Any],
    *,
    t_end: float = 1.0,
    sample_rate: float = 1000.0,
    initial: Any = "static",
    speed: Any = None,
    solver: Any = None,
    step: Plan | float | None = None,
    rtol: float = 1e-7,
    atol: float = 1e-10,
    store: str | Path | None = None,
    resume: bool = True,
    chunk: int | None = None,
    client: Any = None,
    progress: bool | None = None,
) -> xr.Dataset:
    """Runs `machine` once for each row of `parameters` and keeps `outputs` of each run.

    **Arguments:**

    - `parameters`: `Cases` (a grid, a sample, a table), or a mapping path -> (n,) values, SI.
    - `outputs`: name -> a measure of runs (`PeakValue(...)`) or of machines (`TotalMass()`), a `TimeSeries`, an
      `OverSpeed`, or a bare sensor. Runs are reduced while they are computed: only what sensors see is kept.
    - `t_end` to `atol`: as for `simulate`. The step is planned for each machine: those that need a finer one are
      run together.
    - `store`: a Zarr folder, written chunk by chunk; a sweep that was stopped goes on there (`resume`), and one
      of something else is refused. Left out, results are kept in memory.
    - `chunk`: machines in a batch; by default from the memory there is.
    - `client`: of Dask distributed, which then runs the chunks.
    - `progress`: a progress bar; by default where a person looks on.

    All local devices share each batch; under `jax.distributed` every process runs its share of the chunks, and all of
    them write to one store.

    **Returns** an `xarray.Dataset` over `case` (a grid: over its axes), with the parameters, the outputs, and
    `failure`: where a run failed, when and why; its numbers are NaN, the others unharmed. Raises `InputError` for wrong
    input before anything runs.
    """
    require_x64()
    check_solver(machine, solver, None if isinstance(step, Plan) else step, rtol, atol)
    machine.check()
    cases = parameters if isinstance(parameters, Cases) else Cases(dict(parameters))
    wanted = checked(outputs)
    _check_paths(machine, cases)
    engine = engine_for(client)
    setup, substeps = _set_up(
        machine, cases, wanted, t_end, sample_rate, initial, speed, solver, step, rtol, atol
    )
    size = chunk_size(setup, chunk, len(cases), engine.width)
    chunks = _chunks(substeps, size)
    keep = _keeping(store, resume, engine, setup, cases, chunks, size, substeps)
    began = time.perf_counter()
    tasks = []
    for n in keep.missing():
        if engine.mine(n):
            rows = _filled(chunks[n], size)
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
    with bar:
        for n, outcome in engine.run(setup, tasks):
            keep.write(n, slice(n * size, (n + 1) * size), _kept(outcome, setup))
            bar.update(len(chunks[n]))
    engine.meet("done")
    return _finished(keep.dataset(), cases, time.perf_counter() - began)


def _check_paths(machine: Machine, cases: Cases) -> None:
    """Every path is a number of the machine, and every value is one that it may have."""
    bench = Bench(machine, {})
    for path, values in cases.values.items():
        bench.get(path)
        for extreme in {float(values.min()), float(values.max())}:
            bench.set({path: extreme})


def _set_up(machine, cases, outputs, t_end, sample_rate, initial, speed, solver, step, rtol, atol):
    count = sample_count(t_end, sample_rate)
    first = placed(machine, {p: jnp.asarray(x[0]) for p, x in cases.values.items()})
    initial_speed(first, initial, speed)
    ones = np.ones(len(cases), int)
    linear, at = None, 0.0
    runs = any(needs_run(one) for one in outputs.values())
    if solver is None and not is_smooth(machine):
        solver = diffrax.Kvaerno5()
    exponential = solver is None or hasattr(solver, "linear_part")
    if exponential and runs:
        fastest = _fastest(machine, cases, t_end, speed)
        planned = chosen_plan(fastest, t_end, sample_rate, speed, solver, step)
        substeps = ones * planned.substeps
        if step is None:
            when = top_speed(fastest, t_end, speed)[0]
            substeps = substeps_of(machine, cases.values, planned, when, 1.0 / sample_rate)
        at = planned.speed
        if shares_linear(machine, at, cases.values):
            linear = linear_part(first, at)
        solver = with_substeps(solver, planned)
    else:
        substeps = ones
    return Setup(
        machine,
        outputs,
        solver,
        initial,
        None if speed is None else jnp.asarray(speed, float),
        linear,
        jnp.asarray(at, float),
        jnp.asarray([rtol, atol]),
        jnp.asarray(1.0 / sample_rate, float),
        count,
        grid_of(machine, sample_rate),
    ), substeps


def _fastest(machine: Machine, cases: Cases, t_end: float, speed: Any) -> Machine:
    """Of the table's extremes the machine that turns fastest: the step is planned for it."""
    rows = {0, len(cases) - 1}
    for values in cases.values.values():
        rows |= {int(np.argmin(values)), int(np.argmax(values))}
    machines = [
        placed(machine, {p: jnp.asarray(x[row]) for p, x in cases.values.items()})
        for row in sorted(rows)
    ]
    return max(machines, key=lambda m: top_speed(m, t_end, speed)[1])


def _chunks(substeps: np.ndarray, size: int) -> list[np.ndarray]:
    """Rows of the table in each chunk: those of one number of steps together."""
    found = []
    for steps in np.unique(substeps):
        rows = np.flatnonzero(substeps == steps)
        found += [rows[first : first + size] for first in range(0, rows.size, size)]
    return found


def _filled(rows: np.ndarray, size: int) -> np.ndarray:
    """A batch of another size would be compiled anew: the last row fills it up."""
    return np.concatenate([rows, np.repeat(rows[-1], size - rows.size)])


def _keeping(store, resume, engine, setup, cases, chunks, size, substeps) -> "Store | Kept":
    layout = _layout(setup, cases, chunks, size, substeps)
    if store is None:
        return Kept(layout)
    told = _fingerprint(setup, cases, substeps, size)
    keep = Store(Path(store))
    if engine.leads and not keep.exists():
        keep.create(layout, size, told)
        engine.meet("store")
    else:
        if engine.leads and not resume:
            raise InputError(f"`{keep.path}`: is there already: choose another folder, or resume")
        if not engine.leads:
            engine.meet("store")
        keep.open(told)
        if engine.leads:
            engine.meet("store")
    return keep


def _layout(setup: Setup, cases: Cases, chunks, size: int, substeps) -> xr.Dataset:
    """Rows as they are run, a chunk after the other; `case` -1 fills up."""
    row = {path: jnp.asarray(x[0]) for path, x in cases.values.items()}
    shapes = eqx.filter_eval_shape(member, setup, row).values
    rows = np.concatenate([_filled(c, size) for c in chunks])
    own = np.concatenate([np.append(c, np.full(size - c.size, -1)) for c in chunks])
    t = np.arange(setup.count) * float(setup.interval)
    found = xr.Dataset(coords={"case": ("case", own)})
    for path, x in cases.values.items():
        found[path] = ("case", x[rows], {"units": _unit(setup.machine, path)})
    for name, output in setup.outputs.items():
        dims, coords = coordinates(output, t)
        shape = shapes[name].shape
        # of one's own measures nobody knows what their entries are
        names = [f"{name}_{d or i}" for i, d in enumerate(dims or [""] * len(shape))]
        values = np.full((rows.size, *shape), np.nan)
        found[name] = (("case", *names), values, {"units": unit_of(output)})
        for d, own_name in zip(dims, names):
            found = found.assign_coords({own_name: (own_name, coords[d])})
    found["failed_at"] = ("case", np.full(rows.size, np.nan), {"units": "s"})
    found["steps_a_sample"] = ("case", substeps[rows])
    found["done"] = ("chunk", np.zeros(len(chunks), np.int8))
    found.attrs.update(
        cases=cases.how,
        count=len(cases),
        solver=type(setup.solver).__name__,
        linear_part="shared" if setup.linear is not None else "one for each case",
        program=f"jaxrotor {_version()}, JAX {jax.__version__}, Python {platform.python_version()}",
    )
    return found


def _unit(machine: Machine, path: str) -> str:
    try:
        return Bench(machine, {}).unit(path)
    except InputError:
        return ""


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("jaxrotor")
    except PackageNotFoundError:
        return "(not installed)"


def _kept(outcome: Outcome, setup: Setup) -> dict[str, np.ndarray]:
    when = np.where(outcome.failed < 0, np.nan, outcome.failed * float(setup.interval))
    return {**outcome.values, "failed_at": when}


def _fingerprint(setup: Setup, cases: Cases, substeps, size: int) -> dict[str, str]:
    """What makes a sweep this one."""

    def digest(x: Any) -> str:
        leaves, structure = jax.tree.flatten(x)
        h = hashlib.sha256(str(structure).encode())
        for leaf in leaves:
            known = isinstance(leaf, (np.ndarray, jax.Array))
            h.update(np.asarray(leaf).tobytes() if known else repr(leaf).encode())
        return h.hexdigest()[:16]

    run = (setup.solver, setup.initial, setup.speed, setup.numbers, setup.interval, setup.count)
    return {
        "machine": digest(setup.machine),
        "cases": digest(dict(cases.values)),
        "outputs": digest(dict(setup.outputs)),
        "run": digest((run, np.asarray(substeps))),
        "chunk": str(size),
    }


def _finished(found: xr.Dataset, cases: Cases, seconds: float) -> xr.Dataset:
    found = found.isel(case=np.flatnonzero(found["case"].values >= 0)).sortby("case")
    found = found.drop_vars("done")
    when = np.asarray(found["failed_at"])
    words = [f"not finite from t = {t:.6g} s on" if np.isfinite(t) else "" for t in when]
    found["failure"] = ("case", np.array(words, dtype=object).astype(str))
    found.attrs["seconds"] = seconds
    if not cases.axes:
        return found
    shape = [x.size for x in cases.axes.values()]
    out = xr.Dataset(attrs=found.attrs)
    for name, array in found.data_vars.items():
        if name in cases.values:
            continue
        dims = (*cases.axes, *array.dims[1:])
        out[name] = (dims, array.values.reshape(*shape, *array.shape[1:]), array.attrs)
    coords = {path: (path, x, found[path].attrs) for path, x in cases.axes.items()}
    return out.assign_coords(coords | {k: v for k, v in found.coords.items() if k != "case"})
