"""How a run is stepped by an exponential solver."""

import math
from dataclasses import dataclass, field, replace

from ..core.result_text import shows
from ..integrators.blocks import LENGTH
from .state_parts import StateParts

# Steps in a sample interval come in these numbers, so that few programs are compiled.
BUCKETS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128)
# rad of rotation in a step from which the search begins.
_LARGEST_TURN = 1.0
DEFAULT_TOLERANCE = 5e-5


@shows(speed="rad/s", top_speed="rad/s")
@dataclass(frozen=True)
class Plan:
    """How a run is stepped; give it to `simulate(..., step=plan)`.

    - `substeps`: steps in a sample interval. - `order`: of the exponential Adams method.
    - `speed`: rad/s, half the highest, with its direction: the machine is linearised at speeds up to
      twice that. - `top_speed`: the highest expected.
    - `error`: what the pilot saw, as part of each coordinate's peak; `tolerance`: what was asked.
    - `evaluations`: of the field in a step; two where forces change fast with the state.
    - `block`: steps by the same weights, which know the speed: fewer where that changes fast. - `slowest`:
      rad/s, the lowest speed, whatever its direction: at slower ones the machine is not linearised.
    - `parts`: of the state, which no linear term mixes, and which have weights of their own inside `jit`.

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


# Times that a run which left the finite numbers is tried with a shorter step.
RETRIES = 2


def bucket(substeps: float) -> int:
    """The next bucket that has at least so many steps."""
    for size in BUCKETS:
        if size >= substeps - 1e-9:
            return size
    return 64 * math.ceil(substeps / 64 - 1e-9)


def fewest(frequency: float, interval: float) -> int:
    """Steps in a sample interval that follow what turns or swings at `frequency` (rad/s)."""
    return bucket(frequency * interval / _LARGEST_TURN)


def refined(plan: Plan, error: float) -> Plan:
    """For a run by `plan` whose own error was above its tolerance."""
    growth = 2.0
    if math.isfinite(error):
        growth = min(8.0, 1.1 * (error / plan.tolerance) ** (1 / (plan.order + 1)))
    return replace(plan, substeps=bucket(max(plan.substeps + 1, plan.substeps * growth)))
