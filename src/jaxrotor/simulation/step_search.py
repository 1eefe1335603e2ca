"""The search for the longest step that keeps to a tolerance, and what its work is."""

import math
from collections.abc import Callable

from ..integrators.fitted_weights import first_steps
from .planned import SPANS, bucket, finer, in_whole

# Steps in a sample, at most.
_MOST = 8192
# Two samples a step spare little, and whoever samples so is rarely after speed.
_SHORTEST_SPAN = 4
# A sample within a step, as part of a step.
_SAMPLE = 0.2


def longest_step(
    seen: Callable[[float, int], float],
    substeps: float,
    order: int,
    tolerance: float,
    spanning: float,
) -> tuple[float, int, float] | None:
    """Steps in a sample and evaluations in a step, and the error then: the fewest evaluations. With one in a
    step, steps must be short where forces change fast with the state; two serve where that costs less."""
    tries: dict[float, float] = {}

    def longest(substeps: float, evaluations: int, times: int, most: float):
        for _ in range(times):
            if substeps > most:
                return None
            error = seen(substeps, evaluations)
            if error <= tolerance:
                return substeps, evaluations, error
            tries[substeps] = error
            growth = min(4.0, _growth(error, tolerance, order))
            substeps = bucket(max(finer(substeps), substeps * growth))
        return None

    first = max(1, substeps)
    found = longest(first, 1, 3, _MOST)
    if found is not None:
        wanted, most = spanning * tolerance, round(1 / substeps)
        if found[0] > 1 or found[2] > wanted or most < _SHORTEST_SPAN:
            return found
        return _longest_span(lambda span: seen(1 / span, 1), most, order, wanted) or found
    twice = longest(first, 2, 6, _MOST)
    most = _MOST if twice is None else 2 * twice[0] - 1
    once = longest(finer(max(tries)), 1, 4, most)
    return once or twice


def _growth(error: float, wanted: float, order: int) -> float:
    """Times as many steps as bring the error down to what is wanted; two where it is no number."""
    return 1.05 * (error / wanted) ** (1 / (order + 1)) if math.isfinite(error) else 2.0


def _longest_span(
    seen: Callable[[int], float], most: int, order: int, wanted: float
) -> tuple[float, int, float] | None:
    """As `longest_step`, of those that span samples, from the shortest on: a machine that needs short steps
    is not tried with long ones."""
    span, tried, best = _SHORTEST_SPAN, set[int](), None
    while span not in tried:
        error = seen(span)
        tried.add(span)
        good = error <= wanted
        if good:
            best = 1 / span, 1, error
        elif best is None:
            return None
        growth = max(_growth(error, wanted, order), 1 / most)
        ahead = max(2 * span, span / growth) if good else min(span / 2, span / growth)
        span = 2 ** math.floor(math.log2(min(max(ahead, _SHORTEST_SPAN), most)))
    return best


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

    longest = in_whole(steps)[1]
    spans = [span for span in SPANS if _SHORTEST_SPAN <= span <= longest]
    return 1 / min((1, *spans), key=work)
