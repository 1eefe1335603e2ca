"""The shapes in which a run of inner stations moves beside following its ends as in statics.

Between two ends that shake at a frequency ω a run is bent, each to first order, by its own inertia and by
the gyroscopic moments of a circling motion; and its natural shapes with fixed ends add `ω² / (ω_j² - ω²)` to
that. The first few singular vectors of all these make the largest part of it. Those with ends that move alike
and against each other are taken in turn, for of a symmetric run a few of its stations tell as many symmetric
shapes apart as others.

Source: Craig & Bampton (1968); Bampton & Craig's static correction; Qu, Model Order Reduction Techniques
(2004), ch. 8 and 11.
"""

from typing import Any

import numpy as np

# How much more than in statics a natural shape may count, where its frequency is met.
_RESONANT = 1e3
# Of what counts most: natural shapes come, by rising frequency, where nothing else does.
_LEAST = 1e-9


def ritz_shapes(
    xp: Any, K: Any, M: Any, loads: list[Any], ends: Any, count: int, frequency: float
) -> Any:
    """So many shapes, (n, count), orthogonal with respect to K.

    - `K`, `M`: (n, n), of the run with its ends held. `frequency`: the highest that counts, rad/s.
    - `loads`: of inertia and of gyroscopic moments, (n, 2 w), for each unit motion of the ends: across of one
      and the other, then tilting, where w is 2. `ends`: (2 w, 2 w), the force on the ends that move so.
    """
    n = K.shape[0]
    # scaled first: metres and radians differ by orders
    size = 1.0 / xp.sqrt(xp.diagonal(K))
    back = xp.linalg.solve(xp.linalg.cholesky(K * size[:, None] * size), xp.eye(n)) * size
    own = back @ M @ back.T
    values, natural = xp.linalg.eigh(own)  # 1/ω_j²
    values, natural = values[: -count - 1 : -1], natural[:, : -count - 1 : -1]
    met = frequency**2 * values
    beyond = met / xp.maximum(xp.abs(1.0 - met), 1.0 / _RESONANT)

    pushed = [back @ load for load in loads]
    alike, against = np.array([[1.0], [1.0]]), np.array([[1.0], [-1.0]])
    even, odd = alike, against
    if ends.shape[0] == 4:
        length = xp.sqrt(ends[2, 2] / ends[0, 0])
        none = np.zeros((2, 1))
        even, odd = (
            xp.concatenate(
                [np.concatenate([across, none]), xp.concatenate([none, tilting / length])], axis=1
            )
            for across, tilting in ((alike, against), (against, alike))
        )
    # its own weight bends it so: statics are to be exact
    found = pushed[0] @ even[:, :1]
    found = found / xp.linalg.norm(found)
    for ways, number in ((even, (count + 1) // 2 - 1), (odd, count // 2)):
        static = xp.concatenate([load @ ways for load in pushed], axis=1)
        share = xp.linalg.norm(natural.T @ static, axis=1)
        least = _LEAST * xp.linalg.norm(static) * values / values[0]
        all_ = xp.concatenate([static, natural * (share * beyond + least)], axis=1)
        for _ in range(2):  # once leaves rounding behind
            all_ = all_ - found @ (found.T @ all_)
        found = xp.concatenate(
            [found, xp.linalg.svd(all_, full_matrices=False)[0][:, :number]], axis=1
        )
    return back.T @ xp.linalg.qr(found)[0]
