"""Design by gradient: the best machine under constraints."""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
import optax
from tqdm import tqdm

from ..core.arguments import listed, number, whole
from ..core.errors import ConvergenceError, InputError
from ..core.gate import takes
from ..core.parameter import require_x64
from ..machine.machine import Machine
from ..objectives.criterion import Constraint, as_criterion
from ..search.instrumented import Instrumented
from ..search.space import Space, place_of
from ..search.unknown import expanded
from .augmented_lagrangian import Layout, tell
from .optimum import Optimum, summed_up
from .problem import in_parts, pose
from .search import Search

# Up to so many unknowns their slopes are cheaper by forward mode.
_FEW = 8
# On squares of scaled violations, at first.
_PENALTY = 10.0


@takes(
    constraints=listed,
    starts=listed,
    iterations=whole(1),
    tolerance=number(above=0.0, below=1.0),
    optimiser=None,
)
def optimize(
    machine: Machine,
    parameters: Any,
    objective: Any,
    constraints: Sequence[Constraint] = (),
    *,
    starts: Sequence[Mapping[str, float]] = (),
    iterations: int = 300,
    tolerance: float = 1e-8,
    optimiser: optax.GradientTransformation | None = None,
    reverse: bool | None = None,
    progress: bool | None = None,
) -> Optimum:
    """Finds `parameters` of `machine` that make `objective` as small as it gets while `constraints` hold.

    **Arguments:**

    - `parameters`: `Unknown`s or plain paths, as for `identify`; a path to a list stands for all its
      entries. Positive ones are searched for by their logarithm, bounded ones by a logistic map: bounds are
      never left on the way.
    - `objective`: what an experiment measures (`SimulatedRun(...).measure(RootMeanSquare(...))`), a
      measure of
      the machine (`ResponsePeaks(...)`), sums of these, or a function of the machine. Of one with several
      entries (peaks, machines of a batch) the largest is minimised, exactly: a minimax in epigraph form.
    - `constraints`: `criterion <= limit`, `>= limit`, or `.equal_to(value)`, SI.
    - `starts`: further starts, path -> value; the best of all searches is returned.
    - `iterations`: evaluations of one search at most. `tolerance`: on the slope of the scaled Lagrangian and
      on scaled constraints.
    - `optimiser`: of optax, such as `optax.adam(0.02)`, in place of BFGS (optimistix); it takes
      `iterations` steps in each round of the multipliers.
    - `reverse`: slopes by reverse mode; by default from seven unknowns on.

    **Returns** an `Optimum`; stopped by Ctrl-C after the first evaluation, that of the best place so far,
    marked `interrupted`. Raises `InputError` for wrong input before anything runs, and `ConvergenceError`
    where no start gives a finite objective. Source: Nocedal & Wright, Numerical Optimization, 2nd ed., ch. 6
    (BFGS) and 17 (augmented Lagrangian).
    """
    require_x64()
    if not isinstance(machine, Machine):
        raise InputError(f"machine must be a Machine, but is {machine!r}")
    machine.check()
    bench = Instrumented(machine, {})
    space = Space.of(bench, expanded(parameters, bench.machine))
    wanted = as_criterion(objective)
    for one in constraints:
        if not isinstance(one, Constraint):
            raise InputError(
                f"a constraint is written `criterion <= limit`, but one is {one!r} ({type(one).__name__})"
            )
    if isinstance(iterations, bool) or not isinstance(iterations, int) or iterations < 1:
        raise InputError(f"iterations must be a whole number, 1 at least, but is {iterations!r}")
    if not 0 < tolerance < 1:
        raise InputError(f"tolerance must lie between 0 and 1, but is {tolerance!r}")
    places = [jnp.zeros(len(space)), *(place_of(space, bench, start) for start in starts)]
    backward = len(space) > _FEW if reverse is None else bool(reverse)
    problem = pose(bench, space, [wanted, *constraints], backward)
    layout = Layout(tuple(problem.sizes()), tuple(c.sense for c in constraints))
    limits = [c.limit for c in constraints]
    blank = layout.begun(limits, np.ones(sum(layout.sizes)), _PENALTY)
    longer = jnp.zeros(int(layout.minimax))
    firsts = [tell(problem, layout, jnp.append(u, longer), blank).vector for u in places]
    good = [bool(np.all(np.isfinite(first))) for first in firsts]
    if not any(good):
        said = _not_finite(np.asarray(firsts[0]), layout.sizes, [wanted, *constraints])
        raise ConvergenceError(f"no start gives finite numbers: {said}")
    terms = layout.begun(limits, firsts[int(np.argmax(good))], _PENALTY)
    bar = tqdm(
        total=iterations * sum(good),
        unit="evaluation",
        file=sys.stderr,
        leave=False,
        disable=None if progress is None else not progress,
    )
    with bar:
        search = Search(problem, layout, terms, tolerance, bar)
        found = []
        for u, first, fine in zip(places, firsts, good):
            if fine:
                top = jnp.max(layout.split(first)[0]) / terms.scales[0]
                try:
                    found.append(search.run(jnp.append(u, longer + top), iterations, optimiser))
                except KeyboardInterrupt:
                    if not found:  # nothing has been found yet
                        raise
                    found[-1] = found[-1]._replace(interrupted=True)
                if found[-1].interrupted:
                    break

    def badness(one):
        worst = np.max(in_parts(one.vector, layout.sizes)[0])
        return (max(one.violation, tolerance) if np.isfinite(worst) else np.inf, worst)

    best = min(found, key=badness)
    return summed_up(
        problem, layout, terms, constraints, best, found, np.asarray(firsts[0]), wanted
    )


def _not_finite(vector: np.ndarray, sizes: Sequence[int], criteria: Sequence[Any]) -> str:
    for one, values in zip(criteria, in_parts(vector, sizes)):
        if not np.all(np.isfinite(values)):
            bad = values[~np.isfinite(values)][0]
            return f"`{one}` is {bad}: is the machine stable, and the step short enough?"
    return ""
