"""Channels weighed by what is left of them."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .fit import search
from .fit_by_channel import ChannelFit, meet, noise_given
from .loss import LOSSES, robust_size
from .problem import Problem, weighed
from .simulated import records

# A channel met better than this part of its own size has no noise to be weighed by.
_QUIET = 1e-6
# Channels contradict each other where one is met worse than this: in standard deviations of its noise, or as
# part of its signal where the noise was not given.
_WORSE, _PART = 2.0, 0.2
# Searches, and iterations of each, that find out which ones agree.
_ROUNDS, _ITERATIONS = 4, 6


def levels(problem: Problem, u: Float[Array, " n"]) -> list[float]:
    """The residual of each signal, in its standard deviations; where the loss is robust that of
    the most of it."""
    robust = LOSSES[int(problem.loss)] != "squares"
    found = []
    for signal, record in zip(problem.signals, records(problem.simulated, u)):
        r = np.asarray(signal.residual(record))
        if robust:
            r = r[np.asarray(signal.valid) > 0] if signal.compared.matrix is None else r
            found.append(robust_size(r))
        else:
            found.append(float(np.sqrt(r @ r / signal.count)))
    return found


def weighed_by_residuals(
    problem: Problem, u: Float[Array, " n"], given: Sequence[bool]
) -> Problem | None:
    """With the noise that was not given taken from what is left; None where nothing is left."""
    found = levels(problem, u)
    if max(level for level, known in zip(found, given) if not known) < _QUIET:
        return None
    return weighed(
        problem,
        [
            s.std if known else s.std * max(level, _QUIET)
            for s, level, known in zip(problem.signals, found, given)
        ],
    )


def agreeing(problem: Problem, u: Float[Array, " n"]) -> tuple[ChannelFit, ...] | None:
    """Where one channel contradicts the others all are met badly: the search goes on with each weighed by its
    residual, again and again, until most of them agree and the wrong ones count for nothing. None where none
    is met badly, or there is nothing to compare. No estimate is changed by it; nothing is compiled anew."""
    given = noise_given(problem)
    sizes = [
        float(np.std(np.asarray(s.values)[np.asarray(s.valid) > 0])) / float(s.std)
        for s in problem.signals
    ]
    bad = [
        level > (_WORSE if known else _PART * size)
        for level, known, size in zip(levels(problem, u), given, sizes)
    ]
    if len(problem.signals) < 2 or not any(bad):
        return None
    own = [float(s.std) for s in problem.signals]
    moving = problem
    for _ in range(_ROUNDS):
        stds = [
            max(float(s.std) * level, std if known else _QUIET * std)
            for s, level, std, known in zip(moving.signals, levels(moving, u), own, given)
        ]
        if np.allclose(stds, [float(s.std) for s in moving.signals], rtol=0.02):
            break
        moving = weighed(problem, stds)
        (fit,) = search(moving, jnp.asarray(u)[None], _ITERATIONS)
        if not np.isfinite(fit.costs[-1]):
            return None
        u = fit.u
    return meet(problem, u, 1.0)
