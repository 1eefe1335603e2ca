"""Profiles: how the misfit grows as one parameter is held away from its estimate and the rest follow."""

import dataclasses
import sys
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from ..core.arguments import positive, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from .fit import search
from .identification import Identification


@shows(values="@unit", std="@unit")
@dataclasses.dataclass(frozen=True)
class LikelihoodProfile:
    """Of one parameter: `values` (k,), rising, and `root` (k,): the root of the growth of twice the cost at
    each, in standard deviations of the noise, negative below the estimate. For a linear model it is
    (value - estimate) / std, a straight line. `unit`: of the values. `std`: by the curvature at the optimum.
    """

    path: str
    unit: str
    values: np.ndarray
    root: np.ndarray
    std: float

    def interval(self, reach: float) -> tuple[float, float]:
        """Where the profile first reaches so many standard deviations to either side; infinite where it
        does not."""
        middle = int(np.argmin(np.abs(self.root)))
        low = _crossing(-self.root[middle::-1], self.values[middle::-1], reach)
        high = _crossing(self.root[middle:], self.values[middle:], reach)
        return -np.inf if low is None else low, np.inf if high is None else high


def _crossing(root: np.ndarray, values: np.ndarray, reach: float) -> float | None:
    beyond = np.flatnonzero(root >= reach)
    if not beyond.size:
        return None
    i = beyond[0]
    return float(np.interp(reach, root[i - 1 : i + 1], values[i - 1 : i + 1]))


@takes(reach=positive(), points=whole(1), iterations=whole(1))
def likelihood_profiles(
    found: Identification,
    paths: Sequence[str] | None = None,
    *,
    reach: float = 3.0,
    points: int = 3,
    iterations: int = 6,
    progress: bool | None = None,
) -> dict[str, LikelihoodProfile]:
    """The profile of each parameter (of `paths`), `points` on either side up to `reach` standard deviations,
    searched in one batch for each parameter.

    It shows what the curvature at the optimum cannot: intervals that are lopsided, or open. Raises
    `InputError` for a parameter that is not looked for, or that the data cannot see.

    Source: Bates & Watts, Nonlinear Regression Analysis and Its Applications (1988), sec. 6.1.
    """
    names = found.paths if paths is None else tuple(paths)
    blind = {path for direction in found.blind for path in direction}
    for path in names:
        if path not in found.paths:
            raise InputError(f"`{path}`: is not looked for: name one of {', '.join(found.paths)}")
        if path in blind:
            raise InputError(f"`{path}`: the data cannot see it: it has no profile")
    steps = reach * np.arange(1, points + 1) / points
    steps = np.concatenate([-steps[::-1], steps])
    covariance, std = found.knowledge.covariance, found.knowledge.std
    finite = np.where(np.isfinite(covariance), covariance, 0.0)
    best, scale = found.cost, found.knowledge.scale
    result = {}
    for path in tqdm(
        names,
        unit="profile",
        file=sys.stderr,
        leave=False,
        disable=None if progress is None else not progress,
    ):
        i = found.paths.index(path)
        # where a linear model would have the others
        starts = found.u + steps[:, None] * finite[i] / std[i]
        free = np.ones_like(starts)
        free[:, i] = 0.0
        fits = search(found.problem, jnp.asarray(starts), iterations, free=jnp.asarray(free))
        growth = np.array([fit.costs[-1] for fit in fits]) - best
        root = np.sign(steps) * np.sqrt(2 * np.maximum(growth, 0.0)) / scale
        searched = found.space.values(jnp.stack([fit.u for fit in fits]))
        values = (np.asarray(searched) + found.turns)[:, i]
        middle = len(steps) // 2
        result[path] = LikelihoodProfile(
            path,
            found.units[i],
            np.insert(values, middle, found.values[path]),
            np.insert(root, middle, 0.0),
            found.std[path],
        )
    return result
