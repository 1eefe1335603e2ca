"""Which sensors, and which runs, tell the unknowns best: for a bench that is still to be instrumented."""

import sys
from collections.abc import Mapping
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from ..core.arguments import mapping, nearest, short, whole
from ..core.errors import ConvergenceError, InputError
from ..core.gate import takes
from ..machine.machine import Machine
from .experiment import Experiment, ExperimentDesign
from .fisher import Bench, bench_of, broken
from .selection import judge_of


@takes(sensors=mapping, runs=mapping, choose=whole(1))
def experiment_design(
    machine: Machine,
    parameters: Any,
    sensors: Mapping[str, Any],
    runs: Mapping[str, Any],
    *,
    choose: int | None = None,
    of: Literal["sensors", "runs", "pairs"] = "sensors",
    criterion: str = "D",
    progress: bool | None = None,
) -> ExperimentDesign:
    """Which `sensors` in which `runs` would tell `parameters` of `machine` best, and how well: the standard
    deviations that `identify` would state, before anything is recorded.

    **Arguments:**

    - `machine`: a guess of it. What is said holds near it: where the guess is poor, ask for several.
    - `parameters`: `Unknown`s, or plain paths, as for `identify`. Their priors count as information.
    - `sensors`: candidates, name -> `Channel` with a `noise`, whose `std` is all that counts of it (white).
    - `runs`: candidates, name -> `Simulation`, or `jr.identification.CandidateRun` where something is
      different in a run (`conditions`: a speed, a trial mass), or its settings as a mapping. All sensors
      record at each sample.
    - `choose`: how many are chosen; left out, all are, and put in order.
    - `of`: what is chosen. `"sensors"`: each records in all runs. `"runs"`: each is made with all sensors.
      `"pairs"`: each sensor in each run by itself, `"probe of run-up"`.
    - `criterion`: what is made small. `"D"`: the geometric mean of the standard deviations along the
      principal axes (log det of the information); `"A"`: their root mean square; `"E"`: the largest; or the
      path of one unknown: its standard deviation. All are relative: to the size of the guess, for a circular
      unknown to 1 rad, for one with a `scale` to that. Unknowns of the machine count, those of channels
      merely disturb, unless there are no others. What all candidates together do not see is left out.
    - `progress`: a bar over the runs; by default on a terminal, for work of over two seconds.

    Those that help most are taken one after the other, then exchanged one for one as long as that helps: no
    single exchange makes the chosen ones better, yet another set altogether may be.

    **Returns** an `ExperimentDesign`. Raises `InputError` for wrong input, before anything runs, and where
    none of the candidates sees what counts; `ConvergenceError` where a run does not stay finite.
    """
    bench = bench_of(machine, parameters, sensors, runs)
    paths = bench.space.paths
    if criterion not in ("D", "A", "E", *paths):
        guess = nearest(criterion, paths)
        raise InputError(
            f"criterion must be 'D', 'A', 'E' or one of the unknowns ({', '.join(paths)}), but is "
            f"{short(criterion)}{guess}"
        )
    names = candidates(of, bench.sensors, tuple(bench.runs))
    if choose is not None and choose > len(names):
        raise InputError(f"choose: there are not {choose} {of} to choose from, but {len(names)}")
    slopes = _slopes(bench, progress)
    return _designed(bench, slopes, of, names, choose or len(names), criterion)


def candidates(of: str, sensors: tuple[str, ...], runs: tuple[str, ...]) -> tuple[str, ...]:
    """Names of what is chosen from."""
    if of == "pairs":
        return tuple(f"{sensor} of {run}" for sensor in sensors for run in runs)
    return sensors if of == "sensors" else runs


def _slopes(bench: Bench, progress: bool | None) -> list[list[np.ndarray]]:
    """Of each sensor in each run, no more rows than unknowns: triangles, whose products with themselves are
    those of the slopes."""
    found: list[list[np.ndarray]] = [[] for _ in bench.sensors]
    bar = tqdm(
        bench.runs,
        unit="run",
        file=sys.stderr,
        leave=False,
        delay=2.0,
        disable=None if progress is None else not progress,
    )
    for name in bar:
        for k, (sensor, told) in enumerate(zip(bench.sensors, bench.slopes(name))):
            words = broken(bench, name, sensor, *told)
            if words:
                raise ConvergenceError(words)
            found[k].append(np.asarray(np.linalg.qr(np.asarray(told[2]), mode="r")))
    return found


def _designed(
    bench: Bench,
    slopes: list[list[np.ndarray]],
    of: str,
    names: tuple[str, ...],
    count: int,
    criterion: str,
) -> ExperimentDesign:
    space, n = bench.space, len(bench.space)
    start = jnp.zeros(n)
    rate = np.asarray(jax.jacfwd(space.values)(start)).diagonal()
    sizes = _sizes(bench)
    prior = np.asarray([row[0] for row in jax.jacfwd(space.priors)(start)]).reshape(-1, n)
    if of == "pairs":
        rows = [one for per_run in slopes for one in per_run]
    elif of == "sensors":
        rows = [np.vstack(per_run) for per_run in slopes]
    else:
        rows = [np.vstack(per_sensor) for per_sensor in zip(*slopes)]
    interest = np.diag(rate / sizes)[_counting(bench, criterion)]
    kind = criterion if criterion in ("D", "A", "E") else "A"
    judge = judge_of(prior, rows, interest, kind)  # pyright: ignore[reportArgumentType]
    if judge is None:
        words = "any of the unknowns" if kind == criterion else f"`{criterion}`"
        raise InputError(
            f"no candidate sees {words}, or not apart from the others: offer another sensor or run, hold one "
            "of the unknowns, or give it a prior"
        )
    chosen = judge.best(count)
    order = judge.added(chosen)
    told = np.array([[(r / rate).T @ (r / rate) for r in per_run] for per_run in slopes])
    return ExperimentDesign(
        experiment=Experiment(
            paths=space.paths,
            units=tuple(bench.instrumented.unit(path) for path in space.paths),
            values=space.shown(space.values(start)),
            sizes=sizes,
            circular=tuple(kind == "circular" for kind in space.kinds),
            rate=np.abs(rate),
            prior=prior,
            rows=tuple(rows),
            names=names,
            own=bench.sensors,
        ),
        of=of,
        criterion=criterion,
        count=count,
        order=tuple(order),
        spreads=np.array([judge.spread(order[:k]) for k in range(len(order) + 1)]),
        further={names[c]: judge.spread([*chosen, c]) for c in order[count:]},
        information=told,
        prior_information=(prior / rate).T @ (prior / rate),
        runs=tuple(bench.runs),
        correlated=tuple(
            name
            for name, channel in bench.instrumented.channels.items()
            if channel.noise is not None and float(channel.noise.correlation_time) > 0
        ),
    )


def _sizes(bench: Bench) -> np.ndarray:
    """What a standard deviation is relative to."""
    space = bench.space
    width = np.asarray(space.bounds[:, 1] - space.bounds[:, 0]) / 2
    found = np.asarray(space.scales)
    around_zero = np.array([k == "bounded" for k in space.kinds]) & (np.asarray(space.starts) == 0)
    found = np.where(around_zero, width, found)
    return np.where([k == "circular" for k in space.kinds], 1.0, found)


def _counting(bench: Bench, criterion: str) -> list[int]:
    """The unknowns that are judged by."""
    paths = bench.space.paths
    if criterion in paths:
        return [paths.index(criterion)]
    own = [i for i, path in enumerate(paths) if path.split(".")[0] not in bench.sensors]
    return own or list(range(len(paths)))
