"""How a run is stepped by an exponential solver."""

import math
from dataclasses import dataclass, field, replace

from ..core.errors import InputError
from ..core.result_text import shows
from ..integrators.blocks import LENGTH
from .state_parts import StateParts

# Sample intervals in a step come in powers of two, up to this.
LONGEST_SPAN = 64
# Steps in a sample interval come in these numbers, so that few programs are compiled.
BUCKETS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128)
# rad of rotation in a step from which the search begins.
_LARGEST_TURN = 1.0
DEFAULT_TOLERANCE = 5e-5
# Part of the tolerance that steps which span samples keep to. What is sampled finely is to be as right as
# steps from sample to sample had made it, unless its tolerance was asked for.
SPANNING, SPANNING_ASKED = 1e-3, 0.2


@shows(speed="rad/s", top_speed="rad/s")
@dataclass(frozen=True)
class Plan:
    """How a run is stepped; give it to `simulate(..., step=plan)`.

    - `substeps`: steps in a sample interval. - `span`: or sample intervals in a step, a power of two up to
      64; where it is above one, `substeps` is one. - `order`: of the exponential Adams method.
    - `speed`: rad/s, half the highest, with its direction: the machine is linearised at speeds up to
      twice that. - `top_speed`: the highest expected.
    - `error`: what the pilot saw, as part of each coordinate's peak; `tolerance`: what was asked.
    - `evaluations`: of the field in a step; two where forces change fast with the state.
    - `block`: steps by the same weights, which know the speed: fewer where that changes fast. - `slowest`:
      rad/s, the lowest speed, whatever its direction: at slower ones the machine is not linearised.
    - `parts`: of the state, which no linear term mixes, and which have weights of their own inside `jit`.
    - `spanning`: part of the tolerance that steps which span samples keep to. - `excitation`: rad/s, of a
      load; where it is three times the speed and more, steps are fitted to it in place of the speed.

    Plans that step alike are equal, whatever their pilots saw: that differs with every value of every
    parameter, and would have programs that hold a plan compiled anew for it.
    """

    substeps: int
    order: int
    speed: float
    top_speed: float
    error: float = field(compare=False)
    tolerance: float
    evaluations: int = 1
    block: int = field(default=LENGTH, repr=False)
    slowest: float = field(default=0.0, repr=False)
    parts: StateParts | None = field(default=None, repr=False)
    span: int = 1
    spanning: float = field(default=SPANNING, repr=False, compare=False)
    excitation: float = field(default=0.0, repr=False)

    def __post_init__(self) -> None:
        if self.span > 1 and self.substeps > 1:
            raise InputError(
                f"substeps is {self.substeps} and span {self.span}, but a step is a part of a sample "
                "interval or several of them: leave one of them at 1"
            )
        if self.span not in SPANS:
            raise InputError(
                f"span must be a power of two from 1 to {LONGEST_SPAN}, but is {self.span!r}"
            )

    @property
    def steps_a_sample(self) -> float:
        return self.substeps / self.span

    def misses(self, error: float) -> bool:
        """Whether a run whose own error this is should be tried with a shorter step."""
        # another run for less than twice of it is not worth while
        return not error <= min(2.0 * self.kept_to, self.tolerance)

    @property
    def kept_to(self) -> float:
        """The error allowed to its steps."""
        return self.tolerance if self.span == 1 else self.spanning * self.tolerance

    def by_samples(self) -> "Plan":
        """With steps that are no longer than from sample to sample."""
        return replace(self, span=1)


SPANS = tuple(2**i for i in range(LONGEST_SPAN.bit_length()))

# Times that a run which left the finite numbers is tried with a shorter step.
RETRIES = 2


def bucket(substeps: float) -> int:
    """The next bucket that has at least so many steps."""
    for size in BUCKETS:
        if size >= substeps - 1e-9:
            return size
    return 64 * math.ceil(substeps / 64 - 1e-9)


def any_bucket(steps: float) -> float:
    """As `bucket`, where steps may span samples: below one, the next half, quarter, ..."""
    if steps > 0.5 + 1e-9:
        return bucket(steps)
    spans = (span for span in reversed(SPANS) if span * steps <= 1 + 1e-9)
    return 1.0 / next(spans)


def in_whole(steps: float) -> tuple[int, int]:
    """So many in a sample interval, by what `any_bucket` gives: `substeps` and `span` of a `Plan`."""
    return (1, round(1.0 / steps)) if steps < 1 else (round(steps), 1)


def finer(steps: float) -> float:
    """More in a sample interval, at least."""
    return 2 * steps if steps < 1 else steps + 1


def fewest(frequency: float, interval: float) -> int:
    """Steps in a sample interval that follow what turns or swings at `frequency` (rad/s)."""
    return bucket(longest_turn(frequency, interval))


def longest_turn(frequency: float, interval: float) -> float:
    """As `fewest`, before it is a whole number."""
    return frequency * interval / _LARGEST_TURN


def refined(plan: Plan, error: float) -> Plan:
    """For a run by `plan` whose own error it misses."""
    growth, now = 2.0, plan.steps_a_sample
    if math.isfinite(error):
        growth = min(8.0, 1.1 * (error / plan.kept_to) ** (1 / (plan.order + 1)))
    substeps, span = in_whole(any_bucket(max(finer(now), now * growth)))
    return replace(plan, substeps=substeps, span=span)
