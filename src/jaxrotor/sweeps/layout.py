"""The dataset of a sweep: as it lies in memory or in a store, and as it is handed out."""

import platform
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from ..core.errors import InputError
from ..core.version import installed_version
from ..search.instrumented import Instrumented
from ..simulation.response import Response
from ..simulation.run_info import RunInfo
from .batch import Outcome, Setup, placed
from .cases import Cases
from .memory import state_size
from .outputs import coordinates, evaluated, needs_run, unit_of
from .planning import NO_STEP, Steps

# Names in the dataset that are the sweep's own.
OWN = ("case", "failed_at", "failure", "steps_a_sample", "done", "chunk")
# Attributes that are handed out.
TOLD = ("cases", "count", "solver", "linear_part", "linearised_at", "program")


def check_names(outputs: Mapping[str, Any], cases: Cases) -> None:
    for name in outputs:
        if not isinstance(name, str) or not name or "/" in name or name.startswith("."):
            raise InputError(
                f"outputs: {name!r} is no name of an output: take some words without a slash"
            )
        if name in OWN or name in cases.values:
            raise InputError(f"outputs: `{name}` is taken by the sweep itself: take another name")


def chunks_of(substeps: np.ndarray, size: int) -> list[np.ndarray]:
    """Rows of the table in each chunk: those of one number of steps together."""
    found = []
    for steps in np.unique(substeps):
        rows = np.flatnonzero(substeps == steps)
        found += [rows[first : first + size] for first in range(0, rows.size, size)]
    return found


def filled(rows: np.ndarray, size: int) -> np.ndarray:
    """A batch of another size would be compiled anew: the last row fills it up."""
    return np.concatenate([rows, np.repeat(rows[-1], size - rows.size)])


def layout_of(
    setup: Setup, cases: Cases, steps: Steps, size: int
) -> tuple[xr.Dataset, dict[str, xr.Variable]]:
    """Rows as they are run, a chunk after the other; `case` -1 fills up. The second: what the runs will give,
    NaN that takes no memory."""
    row = {path: jnp.asarray(x[0]) for path, x in cases.values.items()}
    shapes = eqx.filter_eval_shape(_results, setup, row)
    chunks = chunks_of(steps.substeps, size)
    rows = np.concatenate([filled(c, size) for c in chunks])
    own = np.concatenate([np.append(c, np.full(size - c.size, -1)) for c in chunks])
    t = np.asarray(setup.run.times)
    found = xr.Dataset(coords={"case": ("case", own)})
    for path, x in cases.values.items():
        found[path] = ("case", x[rows], {"units": _unit(setup.machine, path)})
    results = {"failed_at": _nothing(("case",), (rows.size,), float, "s")}
    for name, output in setup.outputs.items():
        dims, coords = coordinates(output, t)
        shape = shapes[name].shape
        # of one's own measures nobody knows what their entries are
        names = [f"{name}_{d or i}" for i, d in enumerate(dims or [""] * len(shape))]
        results[name] = _nothing(
            ("case", *names), (rows.size, *shape), shapes[name].dtype, unit_of(output)
        )
        for d, own_name in zip(dims, names):
            found = found.assign_coords({own_name: (own_name, coords[d])})
    found["steps_a_sample"] = ("case", steps.substeps[rows])
    found["done"] = ("chunk", np.zeros(len(chunks), np.int8))
    found.attrs.update(
        cases=cases.how,
        count=len(cases),
        solver=type(setup.run.solver).__name__,
        linear_part="shared" if setup.linear is not None else "one for each case",
        linearised_at=float(steps.speed),
        no_step=steps.reason,
        program=f"jaxrotor {installed_version()}, JAX {jax.__version__}, Python {platform.python_version()}",
    )
    return found, results


def _results(setup: Setup, row: dict) -> dict[str, jax.Array]:
    """Of a run that stands still, in shape like any other."""
    machine = placed(setup.machine, row)
    seen = None
    if any(needs_run(one) for one in setup.outputs.values()):
        t = setup.run.times
        y = jnp.zeros((setup.run.count, state_size(setup.machine)))
        seen = Response(machine, t, y, RunInfo("sweep"))
    return evaluated(setup.outputs, seen, machine)


def _nothing(dims, shape, dtype, unit: str) -> xr.Variable:
    dtype = np.promote_types(dtype, float)
    return xr.Variable(dims, np.broadcast_to(np.array(np.nan, dtype), shape), {"units": unit})


def _unit(machine: Any, path: str) -> str:
    try:
        return Instrumented(machine, {}).unit(path)
    except InputError:
        return ""


def kept(outcome: Outcome, setup: Setup) -> dict[str, np.ndarray]:
    """What is written of a chunk."""
    when = np.where(outcome.failed < 0, np.nan, outcome.failed * float(setup.run.interval))
    return {name: np.asarray(x) for name, x in outcome.values.items()} | {"failed_at": when}


def finished(found: xr.Dataset, cases: Cases, setup: Setup, seconds: float) -> xr.Dataset:
    """In the order of the table, a grid over its axes, with the failures in words."""
    found = found.isel(case=np.flatnonzero(found["case"].values >= 0)).sortby("case")
    reason = found.attrs["no_step"]
    failed, steps = np.asarray(found["failed_at"]), np.asarray(found["steps_a_sample"])
    words = [
        reason if n == NO_STEP else _failure(t, setup) if np.isfinite(t) else ""
        for t, n in zip(failed, steps)
    ]
    found["failure"] = ("case", np.array(words, dtype=object).astype(str))
    names = (*cases.values, *setup.outputs, "failure", "failed_at", "steps_a_sample")
    found = found[list(names)]
    found.attrs = {k: found.attrs[k] for k in TOLD} | {"seconds": seconds}
    if not cases.axes:
        return found
    shape = [x.size for x in cases.axes.values()]
    out = xr.Dataset(attrs=found.attrs)
    for name, array in found.data_vars.items():
        if name in cases.axes:
            continue
        dims = (*cases.axes, *array.dims[1:])
        out[name] = (dims, array.values.reshape(*shape, *array.shape[1:]), array.attrs)
    coords = {path: (path, x, found[path].attrs) for path, x in cases.axes.items()}
    return out.assign_coords(coords | {k: v for k, v in found.coords.items() if k != "case"})


def _failure(t: float, setup: Setup) -> str:
    if t > 0:
        return f"not finite from t = {t:.6g} s on"
    start = {
        "steady": "no periodic whirl was found",
        "static": "no static equilibrium was found",
        "running": "no equilibrium was found at this speed",
    }
    words = start.get(setup.run.initial if isinstance(setup.run.initial, str) else "")
    return "not finite from the start" if words is None else f"{words}, or it is not finite"
