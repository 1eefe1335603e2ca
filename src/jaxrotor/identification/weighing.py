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
_ROUNDS, _ITERATIONS = 4, 5


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
    known = [np.asarray(s.values)[np.asarray(s.valid) > 0] for s in problem.signals]
    bad = [
        level > (_WORSE if noise else _PART * float(np.std(values)) / float(s.std))
        for level, noise, values, s in zip(levels(problem, u), given, known, problem.signals)
    ]
    if len(problem.signals) < 2 or not any(bad):
        return None
    # at first one voice each, by what is simulated too: what reads far too little would count too much by its
    # own size; what never moves is no witness
    start = jnp.zeros_like(u)
    stds, least = [], []
    for s, noise, values, record in zip(
        problem.signals, given, known, records(problem.simulated, start)
    ):
        size = max(float(np.std(values)), float(np.nanstd(record))) or 1.0
        stds.append(size / _QUIET if np.ptp(values) == 0 else size)
        least.append(float(s.std) if noise else _QUIET * stds[-1])
    moving = weighed(problem, stds)
    u = min(start, u, key=lambda at: sum(x**2 for x in levels(moving, at)))
    for _ in range(_ROUNDS):
        (fit,) = search(moving, u[None], _ITERATIONS)
        if not np.isfinite(fit.costs[-1]):
            return None
        u, before = fit.u, stds
        left = [std * level for std, level in zip(stds, levels(moving, u))]
        stds = [max(pair) for pair in zip(left, least)]
        if np.allclose(stds, before, rtol=0.2):
            break
        moving = weighed(problem, stds)
    return meet(problem, u, 1.0)
