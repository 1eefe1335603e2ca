"""The search for the longest step that keeps to a tolerance, and what its work is."""

import math
from collections.abc import Callable

from ..integrators.fitted_weights import first_steps
from .planned import any_bucket, finer, in_whole, kept_to

# Steps in a sample, at most.
_MOST = 8192
# A sample within a step, as part of a step.
_SAMPLE = 0.2


def longest_step(
    seen: Callable[[float, int], float], substeps: float, order: int, tolerance: float
) -> tuple[float, int, float] | None:
    """Steps in a sample and evaluations in a step, and the error then: the fewest evaluations. With one in a
    step, steps must be short where forces change fast with the state; two serve where that costs less."""
    tries: dict[float, float] = {}

    def longest(substeps: float, evaluations: int, times: int, most: float):
        for _ in range(times):
            if substeps > most:
                return None
            error = seen(substeps, evaluations)
            wanted = kept_to(tolerance, substeps)
            if error <= wanted:
                return substeps, evaluations, error
            tries[substeps] = error

            def better(wanted, now=substeps, error=error):
                growth = 2.0
                if math.isfinite(error):
                    growth = min(4.0, 1.05 * (error / wanted) ** (1 / (order + 1)))
                return any_bucket(max(finer(now), now * growth))

            ahead = better(wanted)
            # one from sample to sample need not be so fine
            substeps = max(1, better(tolerance)) if substeps < 1 <= ahead else ahead
        return None

    found = longest(substeps, 1, 3 if substeps >= 1 else 4, _MOST)
    if found is not None:
        return found
    twice = longest(substeps, 2, 6, _MOST)
    most = _MOST if twice is None else 2 * twice[0] - min(twice[0], 1)
    once = longest(finer(max(tries)), 1, 4, most)
    return once or twice


def that_pays(steps: float, intervals: float, jumps: int, order: int) -> float:
    """In a sample interval: so many, or more where that takes less work in a run of so many `intervals`: the
    longer a step, the more is done while a history fills, at the start and about each jump."""
    if steps >= 1:
        return steps

    def work(span: int) -> float:
        if span == 1:
            return intervals + (1 + 3 * jumps) * len(first_steps(order).ends)
        filling = (1 + 5 * jumps) * len(first_steps(order, span).ends)
        return intervals * (1 / span + _SAMPLE) + filling + jumps * span

    spans = [2**i for i in range(in_whole(steps)[1].bit_length())]
    # two samples a step spare little, and whoever samples so is rarely after speed
    return 1 / min((span for span in spans if span != 2), key=work)
