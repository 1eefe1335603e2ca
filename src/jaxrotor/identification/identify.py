"""Parameters from measured runs."""

import contextlib
import dataclasses
import sys
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array
from tqdm import tqdm

from ..core.arguments import listed, mapping, whole
from ..core.errors import ConvergenceError, InputError
from ..core.gate import takes
from ..core.parameter import require_x64
from ..machine.machine import Machine
from ..machine.wiring import unknown
from ..search.instrumented import Instrumented
from ..search.space import Space, place_of, wrapped
from ..search.unknown import as_unknowns
from ..sensors.channel import as_channels
from .descent import descend
from .domain import AbstractDomain, Time
from .estimated import known_from
from .fit import Fit, search
from .fit_by_channel import meet, noise_given
from .identification import Identification
from .loss import LOSSES, Loss, loss_number
from .problem import Problem, check_data, in_reverse, pose, with_loss
from .simulated import places_remembered, records_and_slopes
from .suspects import suspects
from .trials import Trial, as_trials
from .weighing import agreeing, weighed_by_residuals

# A robust loss needs the size of the noise first: so often it is taken from what is left, and searched again.
_AGAIN = 3


@takes(iterations=whole(1), optimiser=None)
@dataclasses.dataclass(frozen=True)
class Stage:
    """One search of several: in a `domain`, from where the last one ended.

    By Levenberg-Marquardt, or by an `optimiser` of optax on reverse-mode gradients: for more parameters
    than forward sensitivities are worth (some dozens), or a misfit too rough for its curvature to mean
    anything. It moves in the search's own coordinates, in which 1 is a large change (a factor e of a
    positive parameter, a radian, the scale of a free one): `Stage(Time(), 300, optax.adam(0.02))`.
    """

    domain: AbstractDomain
    iterations: int = 20
    optimiser: optax.GradientTransformation | None = None


@takes(sensors=mapping, stages=None, starts=listed)
def identify(
    machine: Machine,
    parameters: Any,
    sensors: Mapping[str, Any],
    data: Any,
    *,
    stages: Sequence[Stage | AbstractDomain] = (Time(),),
    starts: Sequence[Mapping[str, float]] = (),
    loss: Loss = "squares",
    shaft: str | None = None,
    progress: bool | None = None,
) -> Identification:
    """Finds `parameters` of `machine` (and of its channels) such that what `sensors` would have recorded
    meets `data`, by Levenberg-Marquardt on forward-mode sensitivities (or as a `Stage` says).

    **Arguments:**

    - `parameters`: `Unknown`s, or plain paths.
    - `sensors`: name -> a sensor or a `Channel`. A channel's `noise.std` weighs it; without one, its noise is
      taken from its residual.
    - `data`: `Record`s or `MeasuredRun`s, of one or several runs, or `MeasuredResponse`s, steady vectors over
      speed; series carry the names of `sensors`.
    - `stages`: searches one after the other, such as `(Orders(), Time())`: by order no cycle can be skipped,
      over time everything counts. The uncertainty is that of the last.
    - `starts`: further starts, path -> value, for the first stage, searched in one batch; the best goes on.
    - `loss`: how residuals count. `"huber"` and `"student"` let no spike decide: beyond some standard
      deviations a value pulls no harder (Huber), or less and less (Student's t of four degrees).
    - `shaft`: station whose angle counts the turns for `Orders`; by default the first.

    **Returns** an `Identification`; stopped by Ctrl-C after the first iteration, that of the best place so
    far, marked `interrupted`. Raises `InputError` for wrong input, before anything runs, and
    `ConvergenceError` where no start leads to a run that stays finite.
    """
    require_x64()
    bench, space, searches, places, given = asked(
        machine, parameters, sensors, data, stages, starts, loss, shaft
    )
    begun = space.set(bench, space.starts)
    trials = [trial.planned(begun.machine) for trial in given]
    total = sum(stage.iterations for stage in searches)
    bar = tqdm(
        total=total,
        unit="iteration",
        file=sys.stderr,
        leave=False,
        disable=None if progress is None else not progress,
    )
    histories: dict[str, np.ndarray] = {}
    problem: Problem | None = None
    best: Fit | None = None
    with bar, places_remembered():
        for i, stage in enumerate(searches):
            kind = type(stage.domain).__name__.lower()
            words = kind if len(searches) == 1 else f"stage {i + 1} of {len(searches)}, {kind}"
            try:
                posed = pose(bench, space, trials, stage.domain, shaft, loss)
                posed, fits = _search(posed, places, stage, bar, words)
            except KeyboardInterrupt:
                if best is None:  # nothing has been found yet
                    raise
                best = best._replace(interrupted=True)
                break
            problem, best = posed, fits[-1]
            places = best.u[None]
            name = f"{i + 1}: {kind}"
            for k, fit in enumerate(fits):
                again = ("", ", weighed by its residuals")[k] if k < 2 else f", repeated {k} times"
                histories[name + again] = fit.costs
            if best.interrupted:
                break
        assert problem is not None and best is not None
        bar.set_description_str("intervals")
        return _told(problem, best, histories, searches[-1])


class Asked(NamedTuple):
    """What is looked for, and in what: `places` (b, n), where the first search starts."""

    bench: Instrumented
    space: Space
    searches: list[Stage]
    places: Array
    trials: tuple[Trial, ...]


def asked(
    machine: Machine,
    parameters: Any,
    sensors: Mapping[str, Any],
    data: Any,
    stages: Sequence[Stage | AbstractDomain] = (Time(),),
    starts: Sequence[Mapping[str, float]] = (),
    loss: Loss = "squares",
    shaft: str | None = None,
) -> Asked:
    """The arguments of `identify`, judged as far as they can be before anything runs; raises `InputError`."""
    machine.check()
    loss_number(loss)
    bench = Instrumented(machine, as_channels(dict(sensors)))
    bench.check()
    space = Space.of(bench, as_unknowns(parameters))
    searches = [s if isinstance(s, Stage) else Stage(s) for s in listed(stages, "stages")]
    if shaft is not None and shaft not in machine.wiring.stations:
        raise InputError(f"shaft: {unknown('station', shaft, machine.wiring.stations)}")
    if not searches:
        raise InputError("stages: name one at least, such as Time()")
    begun = space.set(bench, space.starts)
    places = [jnp.zeros(len(space)), *(place_of(space, bench, start) for start in starts)]
    trials = as_trials(data)
    for trial in trials:
        trial.check(begun.machine)
    check_data(bench, space, trials, [search.domain for search in searches])
    return Asked(bench, space, searches, jnp.stack(places), trials)


def _best(problem: Problem, places, stage: Stage, bar, words: str, nearly: bool = False) -> Fit:
    """`nearly`: another search follows. `words`: what the bar is told to be at; it counts to this search's
    end, however early that comes."""
    bar.set_description_str(words)
    end = bar.n + stage.iterations
    bar.total = max(bar.total, end)
    if stage.optimiser is None:
        fits = search(problem, places, stage.iterations, bar, nearly=nearly)
    else:
        fits = descend(in_reverse(problem), places, stage.optimiser, stage.iterations, bar)
    if not any(fit.interrupted for fit in fits):
        bar.update(end - bar.n)
    best = min(fits, key=lambda fit: np.inf if np.isnan(fit.costs[-1]) else fit.costs[-1])
    if not np.isfinite(best.costs[-1]):
        raise ConvergenceError(
            "no start leads to a run that stays finite: give other `start`s, or a smaller `step`"
        )
    return best


def _search(problem: Problem, places, stage: Stage, bar, words: str) -> tuple[Problem, list[Fit]]:
    """Searches, and where noise was not given weighs the channels by their residuals and searches again."""
    robust = LOSSES[int(problem.loss)] != "squares"
    given = noise_given(problem)
    # from afar a loss that forgets large residuals would rest anywhere
    nearing = with_loss(problem, "huber") if robust else problem
    more = (_AGAIN if robust else 1) if not all(given) and (robust or len(given) > 1) else 0
    fits = [_best(nearing, places, stage, bar, words, nearly=more > 0)]
    try:
        for k in range(more):
            if fits[-1].interrupted:
                break
            again = weighed_by_residuals(nearing, fits[-1].u, given)
            nearing = nearing if again is None else again
            weighed = f"{words}, weighed by its residuals"
            last = again is None or k + 1 == more
            fits.append(_best(nearing, fits[-1].u[None], stage, bar, weighed, nearly=not last))
            if again is None:
                break
        if int(nearing.loss) != int(problem.loss) and not fits[-1].interrupted:
            again = with_loss(nearing, LOSSES[int(problem.loss)])
            fits.append(_best(again, fits[-1].u[None], stage, bar, f"{words}, by its loss"))
            nearing = again
    except KeyboardInterrupt:
        fits[-1] = fits[-1]._replace(interrupted=True)
    return nearing, fits


def _wrapped(space: Space, bench: Instrumented) -> Instrumented:
    """With the angles that were looked for, and those tied to them, from -pi to pi."""
    turned = {}
    for path, kind, ties in zip(space.paths, space.kinds, space.ties):
        for angle in (path, *dict(ties)) if kind == "circular" else ():
            if bench.unit(angle) == "rad":
                turned[angle] = wrapped(bench.get(angle))
    return bench.set(turned)


def _told(problem: Problem, best: Fit, histories, last: Stage) -> Identification:
    space = problem.space
    found, slopes = records_and_slopes(problem.simulated, best.u[None])
    first = jax.tree.map(lambda x: x[0], (found, slopes))
    known = known_from(problem, best.u, *first)
    bench = _wrapped(space, space.placed(problem.simulated.bench, best.u))
    robust = LOSSES[int(problem.loss)] != "squares"
    channels = meet(problem, best.u, 1.0 if robust else known.scale)
    judged = None
    if not best.interrupted and last.optimiser is None:
        with contextlib.suppress(KeyboardInterrupt):
            judged = agreeing(problem, best.u)
    return Identification(
        machine=bench.machine,
        sensors=bench.channels,
        space=space,
        u=np.asarray(best.u),
        slopes=np.diag(np.asarray(jax.jacfwd(space.values)(best.u))),
        knowledge=known,
        channels=channels,
        histories=histories,
        stopped=best.stopped,
        interrupted=best.interrupted,
        cost=float(0.5 * jnp.sum(problem.residual_of(best.u, first[0]) ** 2)),
        count=problem.count,
        units=tuple(bench.unit(path) for path in space.paths),
        problem=problem,
        suspects=suspects(channels if judged is None else judged),
    )
