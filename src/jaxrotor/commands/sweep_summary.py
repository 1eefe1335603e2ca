"""What a finished sweep says: its summary, its table, its figures."""

import platform
from typing import Any

import numpy as np
import xarray as xr

from ..study.settings import settings_of
from ..study.study import Study
from ..sweeps.sensitivity import indices_of, rank_regression
from ..sweeps.statistics import axes_of, numbers_of, percentiles, share
from .made import made_of
from .options import study_name

_PERCENT = (5, 25, 50, 75, 95)
# Over time or speed: of each case the largest value, or the least where that is limited.
_OF_LARGEST, _OF_LEAST = "of_the_largest", "of_the_least"
# Failed cases that are told one by one.
_FAILURES = 20


def summary_of(study: Study, found: xr.Dataset) -> dict[str, Any]:
    """SI, fit for JSON."""
    from ..simulation.export import versions

    asked = study.sweep
    whole = found if not asked.base else found.isel(case=slice(0, 2 * asked.base))
    failed = np.flatnonzero(found["failure"].values.ravel() != "")
    reasons = found["failure"].values.ravel()
    outputs = {name: _told(name, whole, asked) for name in asked.outputs}
    parameters = {}
    for path in asked.cases.values:
        x = asked.cases.values[path]
        parameters[path] = {
            "unit": asked.units[path],
            "lowest": float(x.min()),
            "median": float(np.median(x)),
            "highest": float(x.max()),
        }
    return _plain(
        {
            "study": study_name(study),
            "made": made_of(study),
            "title": study.title,
            "cases": found.attrs["cases"],
            "count": len(asked.cases),
            "settings": settings_of(study.settings),
            "parameters": parameters,
            "outputs": outputs,
            "failed": len(failed),
            "failures": [
                {
                    "case": int(row) + 1,
                    "why": str(reasons[row]),
                    "parameters": {p: float(x[row]) for p, x in asked.cases.values.items()},
                }
                for row in failed[:_FAILURES]
            ],
            "sensitivities": _weights_told(weights_of(study, found)),
            "solver": {k: found.attrs[k] for k in ("solver", "linear_part")},
            "seconds": round(found.attrs["seconds"], 3),
            "versions": {"python": platform.python_version(), **versions()},
        }
    )


def _told(name: str, found: xr.Dataset, asked: Any) -> dict[str, Any]:
    """Of one output."""
    told: dict[str, Any] = {"kind": type(asked.outputs[name]).__name__, "unit": asked.units[name]}
    limit = asked.limits.get(name)
    if numbers_of(found, [name]):
        kind, values = "percentiles", numbers_of(found, [name])[name]
    else:
        least = limit is not None and limit.kind == "at_least"
        kind, values = _OF_LEAST if least else _OF_LARGEST, _extreme(name, found, least)
    sound = values[np.isfinite(values)]
    told[kind] = dict(zip(map(str, _PERCENT), percentiles(values, _PERCENT)))
    if sound.size:
        told |= {"lowest": sound.min(), "highest": sound.max(), "mean": sound.mean()}
        told["standard_deviation"] = sound.std(ddof=1) if sound.size > 1 else None
    told["ran"] = sound.size
    if limit is not None:
        met = limit.met(sound)
        part, low, high = share(met)
        told["limit"] = {
            limit.kind: limit.value,
            "within": int(met.sum()),
            "share": part,
            "interval_95": [low, high],
        }
    return told


def _extreme(name: str, found: xr.Dataset, least: bool) -> np.ndarray:
    """(n,): the largest (or least) value of each case over time or speed; NaN where it failed."""
    axes = axes_of(found)
    array = found[name].transpose(*axes, ...)
    side, nothing = (np.min, np.inf) if least else (np.max, -np.inf)
    # an axis of a grid, or as much of a sample as is read at once
    step = 1 if len(axes) > 1 else 256
    parts = []
    first_axis = str(array.dims[0])
    for first in range(0, array.sizes[first_axis], step):
        part = array.isel({first_axis: slice(first, first + step)}).values
        part = part.reshape(-1, part.shape[-1])
        parts.append(side(np.where(np.isfinite(part), part, nothing), axis=1))
    values = np.concatenate(parts)
    failed = found["failure"].values.ravel() != ""
    return np.where(failed | ~np.isfinite(values), np.nan, values)


def weights_of(study: Study, found: xr.Dataset) -> xr.Dataset | None:
    """Sobol's indices of Saltelli's design, else rank regression, where there is enough for it."""
    asked = study.sweep
    names = [name for name in numbers_of(found, asked.outputs)]
    if not names:
        return None
    if asked.base:
        sound = {n: np.isfinite(v) for n, v in numbers_of(found, names).items()}
        whole = [n for n in names if sound[n].reshape(-1, asked.base).all(axis=0).sum() > 1]
        return indices_of(found, whole, asked.paths, asked.base) if whole else None
    if len(asked.cases.axes) == 1:
        return None
    return rank_regression(flat_of(found), names, asked.paths)


def flat_of(found: xr.Dataset) -> xr.Dataset:
    """A grid as a list of cases."""
    axes = axes_of(found)
    if axes == ("case",):
        return found
    return found.stack(case=axes).reset_index("case").transpose("case", ...)


def _weights_told(weights: xr.Dataset | None) -> dict[str, Any] | None:
    if weights is None:
        return None
    keys = ("first", "total") if "total" in weights else ("coefficient",)
    out: dict[str, Any] = {"kind": "shares of variance" if len(keys) == 2 else "rank regression"}
    for name in weights["output"].values:
        own = weights.sel(output=name)
        told: dict[str, Any] = {}
        for path in weights["parameter"].values:
            one = own.sel(parameter=path)
            told[str(path)] = {}
            for key in keys:
                ends = (f"{key}_low", f"{key}_high") if len(keys) == 2 else ("low", "high")
                told[str(path)][key] = float(one[key])
                told[str(path)][f"{key}_interval_95"] = [float(one[end]) for end in ends]
            if len(keys) == 1:
                told[str(path)]["rank_correlation"] = float(one["correlation"])
        out[str(name)] = {"parameters": told}
        if "explained" in weights:
            out[str(name)]["explained"] = float(own["explained"])
    return out


def _plain(value: Any) -> Any:
    """NaN is no JSON."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value


def table_of(study: Study, told: dict[str, Any]) -> str:
    """Percentiles with units, shares within limits, what matters, what failed."""
    from ..plot.labels import number, readable

    asked, rows = study.sweep, []
    grid = bool(asked.cases.axes)
    heads = ("lowest", "median", "highest") if grid else ("5 %", "50 %", "95 %")
    for name, one in told["outputs"].items():
        kind = next(k for k in ("percentiles", _OF_LARGEST, _OF_LEAST) if k in one)
        own = one[kind]
        keys = (5, 50, 95)
        values = [own[str(k)] for k in keys]
        if grid and "lowest" in one:
            values = [one["lowest"], own["50"], one["highest"]]
        finite = [v for v in values if v is not None]
        size, unit = readable(one["unit"], finite or [0.0])
        cells = ["" if v is None else number(size * v) for v in values]
        limit = one.get("limit")
        words = ""
        if limit is not None:
            kept = asked.limits[name]
            words = f"{kept} {number(size * kept.value)}: {limit['within']} of {one['ran']}"
            if limit["share"] is not None and not grid:
                low, high = (100 * x for x in limit["interval_95"])
                words += f", {100 * limit['share']:.3g} % ({low:.3g} to {high:.3g} %)"
        called = name if kind == "percentiles" else f"{name}, its {kind.removeprefix('of_the_')}"
        rows.append((called, unit, *cells, words))
    limited = any(row[-1] for row in rows)
    rows.insert(0, ("", "", *heads, "within its limit (95 % interval)" if limited else ""))
    widths = [max(len(row[k]) for row in rows) for k in range(6)]
    lines = [
        "  ".join(
            cell.rjust(w) if 1 < k < 5 else cell.ljust(w)
            for k, (cell, w) in enumerate(zip(row, widths))
        ).rstrip()
        for row in rows
    ]
    lines += ["", *_matters(told["sensitivities"])]
    how = told["cases"]
    words = how if how.startswith(str(told["count"])) else f"{told['count']} cases, {how}"
    lines.append(f"{words}: {told['failed'] or 'none'} failed")
    for one in told["failures"][:3]:
        own = ", ".join(
            f"{p} = {v:.6g} {asked.units[p]}".rstrip() for p, v in one["parameters"].items()
        )
        lines.append(f"! case {one['case']}: {one['why']} ({own})")
    return "\n".join(lines)


def _matters(told: dict[str, Any] | None) -> list[str]:
    """A line for each output: the three parameters that matter most."""
    if told is None:
        return []
    shares = told["kind"] == "shares of variance"
    key = "total" if shares else "coefficient"
    lines = [
        "what matters, as shares of the variance (with interactions):"
        if shares
        else "what matters, by standardised rank regression:"
    ]
    for name, one in told.items():
        if name == "kind":
            continue
        ranked = sorted(one["parameters"].items(), key=lambda kv: -abs(kv[1][key]))[:3]
        words = ", ".join(
            f"{path} {100 * v[key]:.0f} %" if shares else f"{path} {v[key]:+.2f}"
            for path, v in ranked
        )
        more = "" if shares else f"   (R² {one['explained']:.2f})"
        lines.append(f"  {name}: {words}{more}")
    return [*lines, ""]
