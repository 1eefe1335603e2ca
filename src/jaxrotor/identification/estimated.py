"""What is known of the parameters where a search has ended."""

import jax
import numpy as np
from jaxtyping import Array, Float

from .fit_by_channel import noise_given
from .loss import LOSSES, slope_and_square
from .problem import Problem, residual_and_slopes, with_data, with_loss
from .uncertainty import Knowledge, knowledge


def known_from(
    problem: Problem, u: Float[Array, " n"], found: tuple[Array, ...], slopes: tuple[Array, ...]
) -> Knowledge:
    """At `u`, where `found` was simulated with these `slopes`."""
    plain = with_loss(problem, "squares")
    return _known(problem, *(np.asarray(x) for x in residual_and_slopes(plain, u, found, slopes)))


def known_from_each(problem: Problem, data, u, found, slopes) -> list[Knowledge]:
    """The same for a batch of measured `data`."""
    plain = with_loss(problem, "squares")
    each = jax.vmap(lambda d, u, x, dx: residual_and_slopes(with_data(plain, d), u, x, dx))
    r, J = (np.asarray(x) for x in each(data, u, found, slopes))
    return [_known(problem, *one) for one in zip(r, J)]


def _known(problem: Problem, r: np.ndarray, J: np.ndarray) -> Knowledge:
    loss, paths, count = LOSSES[int(problem.loss)], problem.space.paths, problem.count
    if loss == "squares":
        return knowledge(J, r, paths, count, all(noise_given(problem)))
    # the normal equations of an M-estimator: rows weighed by the mean slope of psi in their channel
    roots, spread = np.ones(len(r)), np.ones(len(r))
    at = 0
    for signal in problem.signals:
        rows = slice(at, at + len(signal.compared.spread))
        own = r[rows]
        if signal.compared.matrix is None:
            own = own[np.asarray(signal.valid) > 0]
        slope, square = slope_and_square(loss, own, len(paths) * len(own) / count)
        roots[rows], spread[rows] = np.sqrt(slope), square / slope
        at = rows.stop
    return knowledge(roots[:, None] * J, r, paths, count, True, spread)
