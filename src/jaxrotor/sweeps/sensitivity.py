"""Which parameter matters: shares of the variance (Sobol), ranks, and slopes of every member."""

from collections.abc import Mapping, Sequence
from typing import Any, Unpack

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from scipy import stats

from ..core.arguments import mapping, number, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.quick import lightly_compiled
from ..machine.machine import Machine
from ..search.instrumented import Instrumented
from ..simulation.simulate import for_slopes
from ..simulation.simulation import Settings, Simulation
from .batch import member, with_steps
from .cases import Cases, as_cases
from .outputs import OverSpeed, TimeSeries, checked, coordinates, unit_of
from .planning import NO_STEP
from .statistics import numbers_of
from .sweep import set_up, simulation_of, sweep

_RESAMPLES = 300


def sobol_cases(distributions: Mapping[str, Any], count: int, seed: int = 0) -> Cases:
    """Saltelli's design, `count * (len(distributions) + 2)` rows: `count` machines A, as many B independent
    of them, then for each parameter those A that have this one parameter of B.

    `count`: a power of two. Raises `InputError` for another. Source: Saltelli et al., Comput. Phys. Commun.
    181 (2010) 259.
    """
    d = len(distributions)
    if d < 2:
        raise InputError("shares of the variance need two parameters at least: name another")
    if isinstance(count, bool) or not isinstance(count, int) or count < 2 or count & (count - 1):
        raise InputError(f"count must be a power of two, such as 256, but is {count!r}")
    for path, one in distributions.items():
        if not hasattr(one, "ppf"):
            raise InputError(
                f"`{path}`: must be a frozen distribution such as scipy.stats.norm(1.0, 0.1), but is {one!r}"
            )
    drawn = stats.qmc.Sobol(2 * d, rng=seed, bits=64).random(count)
    drawn = np.clip(drawn, np.finfo(float).eps, 1 - np.finfo(float).eps)
    columns = {}
    for k, (path, one) in enumerate(distributions.items()):
        a, b = one.ppf(drawn[:, k]), one.ppf(drawn[:, d + k])
        columns[path] = np.concatenate([a, b, *(b if j == k else a for j in range(d))])
    return Cases(columns, f"Saltelli's design of {count} Sobol points, seed {seed}")


@takes(
    distributions=mapping, outputs=mapping, count=whole(1), confidence=number(above=0.0, below=1.0)
)
def sobol_indices(
    machine: Machine,
    distributions: Mapping[str, Any],
    outputs: Mapping[str, Any],
    count: int = 256,
    *,
    seed: int = 0,
    confidence: float = 0.95,
    **run: Any,
) -> xr.Dataset:
    """How much of each output's variance comes from which parameter, all of them independent.

    **Arguments:**

    - `distributions`: path -> frozen distribution of scipy.stats, as for `Cases.sampled`.
    - `outputs`: measures of one number each, as for `sweep`.
    - `count`: of the design, a power of two: `count * (parameters + 2)` machines are run.
    - `run`: further arguments of `sweep`, such as `t_end`, `sample_rate` and `store`.

    **Returns** over `output` and `parameter`: `first`, the share that goes if this parameter alone were
    known; `total`, the share that stays if all others were; each with `_low` and `_high`, the ends of its
    bootstrap interval. Where a machine of the design failed, only complete sets count; `used` says how many.
    Raises `InputError` for wrong input, a `count` that is no power of two among it, before anything runs.
    """
    cases = sobol_cases(distributions, count, seed)
    found = sweep(machine, cases, outputs, **run)
    return indices_of(found, tuple(outputs), tuple(distributions), count, confidence, seed)


def indices_of(
    found: xr.Dataset,
    names: Sequence[str],
    paths: Sequence[str],
    count: int,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """The indices from a sweep of `sobol_cases`, of those outputs that are numbers."""
    numbers = numbers_of(found, names)
    if not numbers:
        raise InputError("outputs: none is one number for each machine: give a measure, PeakValue")
    d, kept = len(paths), {}
    rng = np.random.default_rng(seed)
    parts = ("first", "total")
    for name, values in numbers.items():
        sets = values.reshape(d + 2, count)
        whole = np.flatnonzero(np.isfinite(sets).all(axis=0))
        if whole.size < 2:
            raise InputError(
                f"`{name}`: {whole.size} of {count} sets of machines ran to the end, too few: see `failure`"
            )
        # SciPy takes powers of two
        used = 2 ** int(np.log2(whole.size))
        sets = sets[:, whole[:used]]
        own = np.array(_indices(sets))
        again = np.array(
            [_indices(sets[:, rng.integers(0, used, used)]) for _ in range(_RESAMPLES)]
        )
        ends = np.quantile(again, [0.5 - confidence / 2, 0.5 + confidence / 2], axis=0)
        kept[name] = own, ends, used
    out = xr.Dataset(coords={"output": list(kept), "parameter": list(paths)})
    for k, part in enumerate(parts):
        out[part] = (("output", "parameter"), np.array([own[k] for own, _, _ in kept.values()]))
        for end, which in enumerate(("low", "high")):
            values = np.array([ends[end, k] for _, ends, _ in kept.values()])
            out[f"{part}_{which}"] = (("output", "parameter"), values)
    out["used"] = ("output", np.array([used for *_, used in kept.values()]))
    out.attrs.update(confidence=confidence, count=count)
    return out


def _indices(sets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(d,) each, from (d + 2, n)."""
    if np.ptp(sets) == 0:
        nothing = np.zeros(len(sets) - 2)
        return nothing, nothing
    A, B, AB = sets[:1], sets[1:2], sets[2:, None]
    found = stats.sobol_indices(func={"f_A": A, "f_B": B, "f_AB": AB}, n=sets.shape[1])
    return found.first_order, found.total_order


def rank_regression(
    found: xr.Dataset, names: Sequence[str], paths: Sequence[str], seed: int = 0
) -> xr.Dataset | None:
    """How many standard deviations of its rank each output moves with one of each parameter's rank.

    **Returns** over `output` and `parameter`: `coefficient` with the ends `low` and `high` of its 95 %
    bootstrap interval, and `correlation`, Spearman's; over `output`: `explained`, the part of the ranks'
    variance that the coefficients account for, near 1 where the output rises or falls evenly with each
    parameter. `None` where there are too few cases, or where the parameters hang together. Source: Saltelli
    et al., Sensitivity Analysis (2000).
    """
    x = np.stack([np.asarray(found[path]).ravel() for path in paths], axis=1)
    rng = np.random.default_rng(seed)
    rows: dict[str, list] = {}
    for name, values in numbers_of(found, names).items():
        sound = np.isfinite(values)
        y, own = values[sound], x[sound]
        if len(y) < 3 * (len(paths) + 1) or np.ptp(y) == 0:
            continue
        ranks = np.stack([stats.rankdata(c) for c in (*own.T, y)], axis=1)
        fit = _standardised(ranks)
        if fit is None:
            continue
        picks = rng.integers(0, len(y), (_RESAMPLES, len(y)))
        again = [f[0] for f in (_standardised(ranks[pick]) for pick in picks) if f is not None]
        low, high = np.quantile(again, [0.025, 0.975], axis=0)
        spearman = np.corrcoef(ranks.T)[-1, :-1]
        rows[name] = [fit[0], low, high, spearman, fit[1]]
    if not rows:
        return None
    out = xr.Dataset(coords={"output": list(rows), "parameter": list(paths)})
    for k, key in enumerate(("coefficient", "low", "high", "correlation")):
        out[key] = (("output", "parameter"), np.array([row[k] for row in rows.values()]))
    out["explained"] = ("output", np.array([row[4] for row in rows.values()]))
    return out


def _standardised(ranks: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Coefficients and the part explained."""
    spread = ranks.std(axis=0)
    if np.any(spread == 0):
        return None
    z = (ranks - ranks.mean(axis=0)) / spread
    fit, _, rank, _ = np.linalg.lstsq(z[:, :-1], z[:, -1], rcond=1e-6)
    if rank < z.shape[1] - 1:
        return None
    return fit, float(1 - np.mean((z[:, -1] - z[:, :-1] @ fit) ** 2))


@takes(parameters=None, outputs=mapping, chunk=whole(1))
def local_slopes(
    machine: Machine,
    parameters: Cases | Mapping[str, Any],
    outputs: Mapping[str, Any],
    paths: Sequence[str] | None = None,
    simulation: Simulation | None = None,
    *,
    chunk: int = 32,
    **settings: Unpack[Settings],
) -> xr.Dataset:
    """Derivatives of every output by the parameters at `paths` (left out: those that are swept), of all
    members, exact to rounding for the discrete run: forward mode, a batch of `chunk` machines at a time.

    `paths` may name parameters that are not swept. The other arguments are those of `sweep`.

    **Returns** over `case` and `parameter`, SI: each output's derivative in its unit per unit of the
    parameter (coordinate `per`), NaN for a machine that failed. Where a maximum jumps from one crest to
    another, it is that of the highest. Raises `InputError` for wrong input before anything runs.
    """
    cases = as_cases(parameters)
    wanted = checked(outputs)
    bench = Instrumented(machine, {})
    paths = tuple(cases.values) if paths is None else tuple(paths)
    if not paths:
        raise InputError("paths: name one parameter at least")
    more = {p: np.full(len(cases), float(bench.get(p))) for p in paths if p not in cases.values}
    whole = Cases({**cases.values, **more}, cases.how)
    asked = for_slopes(simulation_of(simulation, settings), reverse=False)
    setup, substeps = set_up(machine, whole, wanted, asked)
    if substeps.any():
        setup = with_steps(setup, max(1, int(substeps.max())))
    n, size = len(cases), min(chunk, len(cases))
    parts = []
    for first in range(0, n, size):
        rows = np.minimum(np.arange(first, first + size), n - 1)
        values = {path: jnp.asarray(x[rows]) for path, x in whole.values.items()}
        got = _slopes(setup, {p: values.pop(p) for p in paths}, values)
        parts.append(jax.tree.map(lambda x: np.asarray(x)[: n - first], got))  # noqa: B023
    unable = substeps == NO_STEP
    t = np.asarray(setup.run.times)
    units = [bench.unit(p) for p in paths]
    out = xr.Dataset(coords={"case": np.arange(n), "parameter": list(paths)})
    out = out.assign_coords(per=("parameter", units))
    for path, x in cases.values.items():
        out = out.assign_coords({path: ("case", x)})
    for name, output in wanted.items():
        value = np.stack([np.concatenate([part[name][p] for part in parts]) for p in paths], axis=1)
        value[unable] = np.nan
        dims, along = coordinates(output, t)
        named = [f"{name}_{k}" for k in (dims or range(value.ndim - 2))]
        out[name] = (("case", "parameter", *named), value, {"units": unit_of(output)})
        if isinstance(output, (TimeSeries, OverSpeed)):
            out = out.assign_coords({named[0]: (named[0], along[dims[0]])})
    return out


@lightly_compiled
def _slopes(setup: Any, by: dict, others: dict) -> dict:
    """Output -> path -> (b, ...)."""

    def one(by, others):
        return jax.jacfwd(lambda own: member(setup, {**others, **own}).values)(by)

    return jax.vmap(one)(by, others)
